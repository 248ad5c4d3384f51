"""Exceptions with a message for the user."""


class UserError(Exception):
    """Bad input. The message is one line that names the field, its value and what is allowed.

    The command line prints it and exits with code 2; in a notebook it is an ordinary exception.
    """


class Interrupted(Exception):  # noqa: N818 - not an error: the run was saved as asked
    """The user asked to stop; unfinished work was saved."""


def one_line(error: BaseException) -> str:
    """An exception's message on one line, or the name of its type if it has none.

    For an `OSError` this omits the path, which the caller names.
    """
    message = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    text = " ".join(message.split())
    return text or type(error).__name__
