"""Listeners receive a run's scalars during training: any objects with `log` and `close`."""

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Protocol, Self

from touchdown.core.errors import UserError, one_line


class Listener(Protocol):
    """Receives a run's scalars: a logger, a live plot, a notification."""

    def log(self, step: int, scalars: Mapping[str, float]) -> object:
        """Receive the scalars of one event, such as an update or the end of an episode.

        Args:
            step: environment steps so far. Several calls may have the same step. A resumed run
                continues from its last checkpoint, so it may repeat steps.
            scalars: values by tag, such as `rollout/ep_rew_mean`, in a dictionary of its own.
        """
        ...

    def close(self) -> object:
        """Finish; called exactly once, however the run ends."""
        ...


class ListenerError(UserError):
    """A listener raised an exception, which is the `__cause__` of this one."""


class Listeners:
    """Passes a run's scalars to all listeners, and closes each once at the end of a `with` block.

    Args:
        listeners: called in this order.

    Raises:
        UserError: `listeners` is not a sequence. An object that is not a listener is refused when
            the block is entered.
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
            name: its name in errors.
            listener: receives scalars from now on.
        """
        self._named.append((name, listener))

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Call each listener; see `Listener.log`.

        Raises:
            ListenerError: one of them raised an exception; the later ones are not called.
        """
        for name, listener in self._named:
            try:
                listener.log(step, dict(scalars))
            except Exception as error:
                raise _named_error(name, "log", error) from error

    def _close(self, pending: BaseException | None) -> None:
        """Close each listener, even if others raise; an exception in flight takes precedence."""
        failures: list[ListenerError] = []

        def close(name: str, listener: Listener) -> None:
            try:
                listener.close()
            except Exception as error:  # noqa: BLE001 - a user's code may raise anything
                failure = _named_error(name, "close", error)
                failure.__cause__ = error
                failures.append(failure)

        # even after a Ctrl-C in one the stack closes the others; it begins with the last one pushed
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
