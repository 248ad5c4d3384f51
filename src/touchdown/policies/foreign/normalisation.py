"""Statistics of observations that Stable-Baselines3's `VecNormalize` saved; never unpickled."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.core import limits, reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, IntArray, Policy
from touchdown.policies.foreign import pickles
from touchdown.policies.foreign.pickles import Made, Name

NONE = "none"
"""Instead of a file: the observations were not normalised."""
_WRAPPER = "stable_baselines3.common.vec_env.vec_normalize VecNormalize"
_MOMENTS = "stable_baselines3.common.running_mean_std RunningMeanStd"
_ARRAYS = ("numpy.core.multiarray _reconstruct", "numpy._core.multiarray _reconstruct")
_BUFFERS = ("numpy.core.numeric _frombuffer", "numpy._core.numeric _frombuffer")
_SCALARS = ("numpy.core.multiarray scalar", "numpy._core.multiarray scalar")
_DTYPES = {"f8": np.dtype("<f8"), "f4": np.dtype("<f4")}
_STATISTICS = re.compile(r".*vec_?norm.*\.pkl", re.IGNORECASE)
_STEPS = re.compile(r"(.*)_(\d+)_steps")


@dataclass(frozen=True, slots=True)
class Normalisation:
    """Shifts and scales observations: clip((o − mean) / √(variance + ε))."""

    mean: NDArray[np.float64]
    """[D]"""
    variance: NDArray[np.float64]
    """[D]"""
    epsilon: float
    clip: float
    """Largest absolute value afterwards."""

    def __call__(self, observations: FloatArray) -> NDArray[np.float32]:
        """Normalised observations: [N, D] to [N, D]."""
        scaled = (observations - self.mean) / np.sqrt(self.variance + self.epsilon)
        return np.clip(scaled, -self.clip, self.clip).astype(np.float32)


@dataclass(frozen=True, slots=True)
class NormalisedPolicy:
    """A policy that sees normalised observations."""

    policy: Policy
    normalisation: Normalisation

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation of the environment: [N, D] to [N]."""
        return self.policy.act(self.normalisation(observations))


def read_normalisation(path: Path, observation_size: int) -> Normalisation | None:
    """The statistics in a file that `VecNormalize.save` wrote; None if only rewards are normalised.

    The file is a pickle. It is interpreted, never unpickled: it can run nothing.

    Args:
        path: the file.
        observation_size: D.

    Raises:
        UserError: it is something else, is broken, or is for other observations.
    """
    data = reading.read_bytes(path, limits.PICKLE_BYTES)
    try:
        return _normalisation(pickles.read(data, "its pickle"), observation_size)
    except ValueError as error:
        raise UserError(f"{path}: not statistics of VecNormalize: {one_line(error)}") from None


def statistics_near(path: Path) -> list[Path]:
    """Files that may hold the statistics of an archive, the most likely one first.

    They are in its folder, or in a folder there as RL Zoo makes one.
    """
    folder = path.parent
    found = [each for each in folder.glob("*.pkl") if _STATISTICS.fullmatch(each.name)]
    found += folder.glob("*/vecnormalize.pkl")
    steps = _STEPS.fullmatch(path.stem)
    own = f"{steps[1]}_vecnormalize_{steps[2]}_steps.pkl" if steps else ""
    return sorted(found, key=lambda each: (each.name != own, each))


def _normalisation(saved: Any, observation_size: int) -> Normalisation | None:
    facts = _state(saved, _WRAPPER)
    if facts.get("norm_obs") is False:
        return None
    moments = _state(facts.get("obs_rms"), _MOMENTS)
    mean, variance = (_array(moments.get(name)) for name in ("mean", "var"))
    epsilon, clip = (_number(facts.get(name), name) for name in ("epsilon", "clip_obs"))
    if mean.shape != (observation_size,) or variance.shape != mean.shape:
        raise ValueError(
            f"it is for observations of shape {list(mean.shape)}, but the environment has "
            f"[{observation_size}]; set it with --env-id"
        )
    if not (np.isfinite(mean).all() and np.isfinite(variance).all() and (variance >= 0).all()):
        raise ValueError("its mean or variance is not finite, or a variance is below 0")
    if not (epsilon > 0 and clip > 0):
        raise ValueError(f"epsilon = {epsilon} and clip_obs = {clip}: must be above 0")
    return Normalisation(mean, variance, epsilon, clip)


def _state(value: Any, name: str) -> dict[str, Any]:
    match value:
        case Made(Name(text=found), state=state) if found == name and isinstance(state, dict):
            return cast(dict[str, Any], state)
        case _:
            raise ValueError(f"it has no {name.rpartition(' ')[2]} of Stable-Baselines3")


def _number(value: Any, name: str) -> float:
    match value:
        case Made(Name(text=text), (dtype, bytes(data))) if text in _SCALARS:
            value = float(_numbers(data, dtype, (1,))[0])
        case _:
            pass
    if type(value) not in (int, float):
        raise ValueError(f"its {name} is missing")
    return float(value)


def _array(value: Any) -> NDArray[np.float64]:
    """An array of numbers, as NumPy pickles one."""
    match value:
        case Made(Name(text=text), state=(_, shape, dtype, False, bytes(data))) if text in _ARRAYS:
            return _numbers(data, dtype, pickles.sizes(shape))
        case Made(Name(text=text), (bytes() | bytearray() as data, dtype, shape, "C")) if (
            text in _BUFFERS
        ):
            return _numbers(bytes(data), dtype, pickles.sizes(shape))
        case _:
            raise ValueError("its mean or variance is not an array")


def _numbers(data: bytes, dtype: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    match dtype:
        case Made(Name("numpy dtype"), (str(kind), *_), state=(_, "<", *_)) if kind in _DTYPES:
            numbers = np.frombuffer(data, _DTYPES[kind])
        case _:
            raise ValueError("its numbers are not little-endian floats")
    if len(shape) != 1 or shape[0] != len(numbers):
        raise ValueError("its mean or variance is not one number for each dimension")
    return numbers.astype(np.float64)
