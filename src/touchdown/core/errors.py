"""Exceptions whose message is meant for the person at the keyboard."""


class UserError(Exception):
    """Bad input: one line that names the field, its value and what would be right.

    The command line prints the message and exits with code 2; a notebook sees an exception.
    """


class Interrupted(Exception):  # noqa: N818 - no error: the run was saved as asked
    """A run was asked to stop, and has saved where it was."""


def one_line(error: BaseException) -> str:
    """An exception's message on one line, or its type where it has none.

    Of an error of the system only what it says: its path is named by whoever reports it.
    """
    said = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    text = " ".join(said.split())
    return text or type(error).__name__
