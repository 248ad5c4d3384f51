"""Uses landers in every way that their interface allows, and in many that it does not.

`make sanitize` runs it with an engine that stops at a wrong address or a data race.
"""

import pickle
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.error import ClosedEnvironmentError, Error
from gymnasium.vector import AutoresetMode

from touchdown.lander.single import LanderEnv
from touchdown.lander.vector import LanderVectorEnv, StepArrays

REFUSED = (
    ValueError,
    TypeError,
    IndexError,
    RuntimeError,
    OverflowError,
    ClosedEnvironmentError,
    Error,  # of Gymnasium, about a seed
)
ODD_NUMBERS = (-1, 0, 3, 4, 7, 2**31, 2**63, 2**70, -(2**70), 0.5, float("nan"), None, "1", True)


class Fuzzer:
    """Random calls from one stream of random numbers.

    Args:
        seed: of the stream.
    """

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.accepted = self.refused = 0
        self.snapshots: list[bytes] = [b"", b"x" * 500]
        self.remake()

    def one_of(self, *choices: Any) -> Any:
        return choices[int(self.rng.integers(len(choices)))]

    def number(self) -> Any:
        return self.one_of(*ODD_NUMBERS)

    def remake(self) -> None:
        settings = {
            "continuous": bool(self.one_of(0, 1)),
            "enable_wind": bool(self.one_of(0, 1)),
            "gravity": self.one_of(-10.0, -0.01, -11.9),
            "wind_power": self.one_of(15.0, 1e30, -3.0),
        }
        self.one = LanderEnv(**settings, max_episode_steps=self.one_of(None, -1, 50))
        self.many = LanderVectorEnv(
            int(self.rng.integers(1, 70)),
            autoreset_mode=self.one_of(*AutoresetMode),
            num_threads=self.one_of(1, 1, 3),
            max_episode_steps=self.one_of(1, 60, 1_000),
            **settings,
        )

    def tried(self, call: Callable[[], Any]) -> Any:
        try:
            result = call()
        except REFUSED:
            self.refused += 1
            return None
        self.accepted += 1
        return result

    def array(self) -> Any:
        """An array that may be anything."""
        shape = self.one_of((), (1,), (2,), (8,), (self.many.num_envs,), (self.many.num_envs, 2))
        kind = self.one_of(np.int64, np.float32, np.float64, np.bool_, np.uint8, object)
        given = self.rng.integers(-2, 9, shape).astype(kind)
        return self.one_of(given, given[..., None], given[::2] if shape else given, given.tolist())

    def actions(self) -> Any:
        if self.rng.random() < 0.15:
            return self.array()
        return self.many.action_space.sample()

    def out(self) -> StepArrays | None:
        if self.rng.random() < 0.5:
            return None
        arrays = StepArrays.empty(self.many.num_envs)
        if self.rng.random() < 0.3:
            arrays = arrays._replace(truncated=arrays.terminated)
        if self.rng.random() < 0.3:
            arrays = arrays._replace(**{self.one_of(*StepArrays._fields): self.array()})
        return arrays

    def snapshot(self) -> bytes:
        given = bytearray(self.one_of(*self.snapshots))
        if given and self.rng.random() < 0.6:
            given[int(self.rng.integers(len(given)))] ^= int(self.rng.integers(1, 256))
        return bytes(given[: self.one_of(len(given), int(self.rng.integers(len(given) + 1)))])

    def kept(self, snapshot: bytes | None) -> None:
        if snapshot is not None:
            self.snapshots = [*self.snapshots[-20:], snapshot]

    def operation(self) -> None:
        """One call of one environment."""
        tried, one, many = self.tried, self.one, self.many
        mask = self.rng.random(many.num_envs) < 0.5
        index = self.one_of(self.number(), int(self.rng.integers(many.num_envs)))
        operations: tuple[Callable[[], Any], ...] = (
            *[lambda: tried(lambda: many.step(self.actions(), out=self.out()))] * 8,
            *[lambda: tried(lambda: one.step(self.one_of(one.action_space.sample(), self.array())))]
            * 4,
            lambda: tried(lambda: one.reset(seed=self.one_of(None, 3, self.number()))),
            lambda: tried(lambda: many.reset(seed=self.one_of(None, 3, self.number()))),
            lambda: tried(lambda: many.reset(options={"reset_mask": self.one_of(mask, 1, None)})),
            lambda: tried(lambda: one.restore(self.snapshot())),
            lambda: tried(lambda: many.restore(index, self.snapshot())),
            lambda: self.kept(tried(one.snapshot)),
            lambda: self.kept(tried(lambda: many.snapshot(index))),
            lambda: tried(lambda: many.copy_state(index, [0, self.one_of(0, self.number())])),
            lambda: tried(lambda: many.terrain(index)),
            lambda: tried(many.states),
            lambda: tried(many.coverage),
            lambda: (
                tried(lambda: LanderVectorEnv(self.number(), num_threads=self.number()))
                if self.rng.random() < 0.1
                else None
            ),
        )
        self.one_of(*operations)()

    def pickled(self) -> None:
        copies = self.tried(lambda: pickle.loads(pickle.dumps((self.one, self.many))))  # noqa: S301
        if copies is not None:
            self.one, self.many = copies

    def together(self) -> None:
        """Two threads that use the same environments at once."""
        seeds = self.rng.integers(2**32, size=2)
        others = [Fuzzer(int(seed)) for seed in seeds]
        for other in others:
            other.one, other.many = self.one, self.many

        def work(other: Fuzzer) -> None:
            for _ in range(40):
                other.operation()

        threads = [threading.Thread(target=work, args=(other,)) for other in others]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.accepted += sum(other.accepted for other in others)
        self.refused += sum(other.refused for other in others)

    def run(self, operations: int) -> None:
        """Make this many calls, and now and then a copy, two threads, or other environments."""
        self.tried(self.one.reset)
        self.tried(self.many.reset)
        for number in range(1, operations + 1):
            self.operation()
            if number % 50 == 0:
                self.pickled()
            if number % 150 == 0:
                self.together()
            if number % 300 == 0:
                self.remake()


def main(rounds: int) -> None:
    """Fuzz, and say how much of it was accepted."""
    fuzzers = [Fuzzer(seed) for seed in range(rounds)]
    for fuzzer in fuzzers:
        fuzzer.run(600)
    accepted, refused = (sum(getattr(f, name) for f in fuzzers) for name in ("accepted", "refused"))
    sys.stdout.write(f"{accepted:,} calls accepted, {refused:,} refused\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
