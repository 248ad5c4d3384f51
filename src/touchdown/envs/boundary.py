"""The border to environments of others: what they return is checked, converted and copied here."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray

Env = gymnasium.Env[Any, Any]

_Info = dict[str, Any]  # named here, because it would be made again in every step
_Many = tuple[Any, ...]
_LONGEST = 60  # characters of a value shown in a message


class Boundary(gymnasium.Wrapper[FloatArray, int, Any, Any]):
    """An environment whose every value is what Gymnasium's interface promises.

    Observations are arrays of their own with the shape and type of the space, and finite. A
    Discrete observation is returned one-hot, in single precision. Rewards are finite floats,
    `terminated` and `truncated` are bools. Scalars may arrive as arrays with one element.

    Args:
        env: an environment of others.
        name: its id, for error messages.

    Attributes:
        name: as given.
    """

    def __init__(self, env: Env, name: str) -> None:
        super().__init__(env)
        self.name = name
        self._steps = 0
        self._closed = False
        inner = env.observation_space
        if isinstance(inner, spaces.Discrete):
            self._states: spaces.Discrete | None = inner
            self.observation_space = cast(Any, spaces.Box(0, 1, (int(inner.n),), np.float32))
        else:
            self._states = None
        box = cast(spaces.Box, self.observation_space)
        self._shape, self._dtype = box.shape, box.dtype
        self._ones = np.ones(box.shape, box.dtype) if box.dtype.kind == "f" else None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode.

        Raises:
            UserError: the environment raised an exception or returned something else.
        """
        self._steps = 0
        given = self._called(lambda: self.env.reset(seed=seed, options=options))
        observation, info = self._parts(given, 2, "observation, info")
        return self._observation(observation), self._info(info)

    def step(self, action: int) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Advance by one step.

        Raises:
            UserError: the environment raised an exception or returned something else.
        """
        self._steps += 1
        try:
            given: Any = self.env.step(action)
        except Exception as error:  # their code may raise anything
            raise self._raised(error) from error
        observation, reward, terminated, truncated, info = self._parts(
            given, 5, "observation, reward, terminated, truncated, info"
        )
        return (
            self._observation(observation),
            self._reward(reward),
            self._flag(terminated, "terminated"),
            self._flag(truncated, "truncated"),
            self._info(info),
        )

    def picture(self) -> NDArray[np.uint8]:
        """The environment as it looks now, RGB, [H, W, 3].

        Raises:
            UserError: its `render` raised an exception or returned no such picture.
        """
        given = self._called(self.env.render)
        if isinstance(given, np.ndarray):
            array = cast(NDArray[Any], given)
            if array.dtype == np.uint8 and array.ndim == 3 and array.size and array.shape[2] == 3:
                return array.copy()
            said = f"{array.dtype}{array.shape}"
        else:
            said = _shown(given)
        raise UserError(
            f"environment {self.name}: render() returned {said}, must be a picture, "
            "uint8(height, width, 3)"
        )

    def close(self) -> None:
        """Close the environment; it needs no answer, as nothing more is asked of it."""
        if not self._closed:
            self._closed = True
            with suppress(Exception):  # some fail before their first reset
                self.env.close()

    def _called(self, function: Callable[[], Any]) -> Any:
        try:
            return function()
        except Exception as error:  # their code may raise anything
            raise self._raised(error) from error

    def _raised(self, error: Exception) -> UserError:
        if isinstance(error, UserError):
            return error
        said = one_line(error)
        kind = type(error).__name__
        return self._refusal("raised " + (kind if said == kind else f"{kind}: {said}"))

    def _refusal(self, said: str) -> UserError:
        """An error with the environment and the step, in a line."""
        when = f"step {self._steps}" if self._steps else "reset"
        return UserError(f"environment {self.name}: {when} {said}")

    def _wrong(self, field: str, value: object, wanted: str) -> UserError:
        return self._refusal(f"returned {field} = {_shown(value)}, must be {wanted}")

    def _parts(self, given: Any, count: int, names: str) -> Any:
        if not isinstance(given, tuple) or len(cast(_Many, given)) != count:
            listed = isinstance(given, tuple | list)
            number = f"{len(cast(_Many, given))} values" if listed else "one value"
            raise self._refusal(f"returned {number}, must be a tuple of {count} ({names})")
        return cast(_Many, given)

    def _observation(self, given: Any) -> FloatArray:
        if self._states is not None:
            return self._one_hot(given, self._states)
        array: NDArray[Any] | None
        try:
            array = np.asarray(given)
            if array.dtype == self._dtype:
                array = array.copy()
            else:
                with np.errstate(over="ignore"):  # what overflows is found below
                    array = array.astype(self._dtype, casting="same_kind")
        except Exception:  # noqa: BLE001 - their objects may raise anything
            array = None
        if array is None or array.shape != self._shape:
            raise self._wrong("observation", given, f"{self._dtype}{self._shape}")
        # a sum takes a third of the time of a look at each number, and is finite if all of them are
        if (
            self._ones is not None
            and not math.isfinite(array.dot(self._ones))
            and not np.isfinite(array).all()
        ):
            raise self._wrong("observation", given, "finite")
        return cast(FloatArray, array)

    def _one_hot(self, given: Any, states: spaces.Discrete) -> FloatArray:
        value = _scalar(given)
        first, count = int(states.start), int(states.n)
        if value is None or value.dtype.kind not in "iu" or not first <= value < first + count:
            wanted = f"a whole number from {first} to {first + count - 1}"
            raise self._wrong("observation", given, wanted)
        array = np.zeros(count, np.float32)
        array[int(value) - first] = 1.0
        return array

    def _reward(self, given: Any) -> float:
        if type(given) is float and math.isfinite(given):  # the usual case is the fast one
            return given
        value = _scalar(given)
        if value is None or value.dtype.kind not in "fiub" or not math.isfinite(value):
            raise self._wrong("reward", given, "a finite number")
        return float(value)

    def _flag(self, given: Any, field: str) -> bool:
        if given is True or given is False:
            return given
        value = _scalar(given)
        if value is None or value.dtype.kind not in "biu" or value not in (0, 1):
            raise self._wrong(field, given, "True or False")
        return bool(value)

    def _info(self, given: Any) -> dict[str, Any]:
        if not isinstance(given, dict):
            raise self._wrong("info", given, "a dict")
        return cast(_Info, given)


def _scalar(given: Any) -> NDArray[Any] | None:
    """A value, or an array with one element, as an array without dimensions; None if it is none."""
    try:
        array = np.asarray(given)
    except Exception:  # noqa: BLE001 - their objects may raise anything
        return None
    return array.reshape(()) if array.size == 1 else None


def _shown(value: object) -> str:
    """A value on one line, cut off."""
    try:
        text = " ".join(repr(value).split())
    except Exception as error:  # noqa: BLE001 - their objects may raise anything
        text = f"an object whose repr raised {type(error).__name__}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
