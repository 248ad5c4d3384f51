"""The one exception whose message is meant for the person at the keyboard."""


class UserError(Exception):
    """Bad input: one line that names the field, its value and what would be right.

    The command line prints the message and exits with code 2; a notebook sees an exception.
    """


def one_line(error: BaseException) -> str:
    """An exception's message on one line, or its type where it has none."""
    text = " ".join(str(error).split())
    return text or type(error).__name__
