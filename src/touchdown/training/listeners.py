"""Who hears of a run's scalars while it trains: any object with `log` and `close`."""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Protocol, Self

from touchdown.core.errors import UserError, one_line


class Listener(Protocol):
    """Anything that takes a run's scalars: a logger, a plot, a message to a phone."""

    def log(self, step: int, scalars: Mapping[str, float]) -> object:
        """Take the scalars of one moment of training.

        Args:
            step: environment steps so far. Several calls may have the same step. A resumed run
                begins again at its last checkpoint, so a step may come a second time.
            scalars: by tag, such as `rollout/ep_rew_mean`. The dictionary is the listener's own.
        """
        ...

    def close(self) -> object:
        """Finish; called once, however the run ends."""
        ...


class ListenerError(UserError):
    """A listener raised an exception, which is this one's `__cause__`."""


class Listeners:
    """Hands a run's scalars to each listener, and closes each once at the end of a `with` block.

    Args:
        listeners: in the order in which they are told.

    Raises:
        UserError: this is not a sequence. Entering the block refuses what is not a listener.
    """

    def __init__(self, listeners: Iterable[Listener]) -> None:
        try:
            each = {id(listener): listener for listener in listeners}.values()  # each once
        except TypeError:
            raise UserError(
                f"listeners = {listeners!r}: must be a list of objects with log and close"
            ) from None
        self._named = [(f"listener {type(listener).__name__}", listener) for listener in each]

    def __enter__(self) -> Self:
        for _, listener in self._named:
            methods = (getattr(listener, name, None) for name in ("log", "close"))
            if isinstance(listener, type) or not all(callable(method) for method in methods):
                error = UserError(f"listeners: {listener!r}: must be an object with log and close")
                self._close(error)
                raise error
        return self

    def __exit__(
        self, _: type[BaseException] | None, error: BaseException | None, __: TracebackType | None
    ) -> None:
        self._close(error)

    def add(self, name: str, listener: Listener) -> None:
        """Add a listener, which is closed with the others.

        Args:
            name: of it in errors.
            listener: told from here on.
        """
        self._named.append((name, listener))

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Tell each listener; see `Listener.log`.

        Raises:
            ListenerError: one of them raised an exception; those after it are not told.
        """
        for name, listener in self._named:
            try:
                listener.log(step, dict(scalars))
            except Exception as error:
                raise _named_error(name, "log", error) from error

    def _close(self, pending: BaseException | None) -> None:
        """Close each, whatever the others raise; an error that is under way keeps the lead."""
        failures: list[ListenerError] = []

        def close(name: str, listener: Listener) -> None:
            try:
                listener.close()
            except Exception as error:  # noqa: BLE001 - whatever a user's code raises
                failure = _named_error(name, "close", error)
                failure.__cause__ = error
                failures.append(failure)

        # a stack goes on with the others after a Ctrl-C in one of them; its last is the first
        with ExitStack() as stack:
            for name, listener in reversed(self._named):
                stack.callback(close, name, listener)
        if pending is not None:
            for failure in failures:
                pending.add_note(str(failure))
        elif failures:
            raise failures[0]


def _named_error(name: str, method: str, error: Exception) -> ListenerError:
    return ListenerError(f"{name}: {method} raised {type(error).__name__}: {one_line(error)}")
