from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64, UInt8

HELIPAD: Final[tuple[float, float, float]]

class Pcg64:
    def __init__(self, seed: int) -> None: ...
    def uniform(self, low: float, high: float) -> float: ...
    def integers(self, low: int, high: int) -> int: ...

class Batch:
    def __init__(
        self,
        num_envs: int,
        *,
        num_threads: int = 1,
        continuous: bool = False,
        gravity: float = -10.0,
        enable_wind: bool = False,
        wind_power: float = 15.0,
        turbulence_power: float = 1.5,
    ) -> None: ...
    def __len__(self) -> int: ...
    def seed(self, index: int, seed: int) -> None: ...
    def step(
        self,
        actions: Int64[np.ndarray, " N"] | Float32[np.ndarray, "N 2"],
        observations: Float32[np.ndarray, "N 8"],
        rewards: Float64[np.ndarray, " N"],
        terminated: Bool[np.ndarray, " N"],
        tasks: UInt8[np.ndarray, " N"] | None = None,
    ) -> None: ...
    def step_episodes(
        self,
        actions: Int64[np.ndarray, " N"] | Float32[np.ndarray, "N 2"],
        observations: Float32[np.ndarray, "N 8"],
        rewards: Float64[np.ndarray, " N"],
        terminated: Bool[np.ndarray, " N"],
        truncated: Bool[np.ndarray, " N"],
        steps: Int64[np.ndarray, " N"],
        ended: Bool[np.ndarray, " N"],
        limit: int,
    ) -> None: ...
    def snapshot(self, index: int) -> bytes: ...
    def restore(self, index: int, snapshot: bytes) -> None: ...
    def copy(self, index: int, to: Sequence[int]) -> None: ...
    def states(
        self,
        bodies: Float32[np.ndarray, "N 3 6"],
        leg_contacts: Bool[np.ndarray, "N 2"],
        awake: Bool[np.ndarray, " N"],
        engines: Float64[np.ndarray, "N 3"],
    ) -> None: ...
    def terrain(self, index: int, points: Float64[np.ndarray, "11 2"]) -> None: ...
    def coverage(self) -> dict[str, Any]: ...

def simd() -> str: ...
