"""Exceptions with a message for the user."""

_OF_NO_MEMORY = (
    "RESOURCE_EXHAUSTED",
    "Cannot allocate memory",
    "Unable to allocate",
    "failed to map segment",
    "Out of memory",
    "out of memory",
)
"""Parts of the messages of JAX, NumPy and the dynamic loader when memory runs out."""


class UserError(Exception):
    """Bad input. The message is one line that names the field, its value and what is allowed.

    The command line prints it and exits with code 2; in a notebook it is an ordinary exception.
    """


class UnreadableError(UserError):
    """A file that cannot be read, though what was written may be whole.

    The system refuses it for now, or something that is not a regular file is in its place.
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


def is_out_of_memory(error: BaseException) -> bool:
    """Whether memory ran out; JAX and the dynamic loader say so only in their messages."""
    if isinstance(error, MemoryError):
        return True
    return any(words in str(error) for words in _OF_NO_MEMORY)
