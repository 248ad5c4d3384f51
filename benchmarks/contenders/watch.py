"""Evaluates a policy during training, with its clock stopped."""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from touchdown.core.starts import TEST_STARTS, VALIDATION_STARTS
from touchdown.core.types import Policy
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander.rules import SOLVED_RETURN

ENV_ID = "LunarLander-v3"
FIRST_LOOK = 5.0  # seconds
RATIO = 1.08  # ratio of the times of two evaluations: evenly spaced on a logarithmic axis

# different from those that a preset selects its checkpoints on
_VALIDATION = VALIDATION_STARTS[500_000:500_100]
_TEST = TEST_STARTS[:100]


class Stopwatch:
    """A clock of training that stops during evaluations."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._stopped = 0.0

    def seconds(self) -> float:
        """Seconds since its creation, without those in which it was stopped."""
        return time.perf_counter() - self._began - self._stopped

    @contextmanager
    def paused(self) -> Generator[None]:
        """Stop the clock within the block."""
        stopped = time.perf_counter()
        try:
            yield
        finally:
            self._stopped += time.perf_counter() - stopped


def next_look(seconds: float, marks: Sequence[float]) -> float:
    """The time of the next evaluation: `RATIO` times the last one, and at every mark.

    Args:
        seconds: time of the last evaluation.
        marks: seconds at which all systems are compared.
    """
    regular = max(FIRST_LOOK, seconds * RATIO)
    return min([regular, *(mark for mark in marks if mark > seconds)])


class Judge:
    """Evaluates policies greedily and records the results.

    Validation uses the exact engine, which equals stock to the last bit; a test uses stock itself.

    Args:
        record: called with the result of an evaluation, as a JSON object.
    """

    def __init__(self, record: Callable[[dict[str, Any]], object]) -> None:
        self._record = record
        self._validation = Evaluator(ENV_ID, len(_VALIDATION), "exact")
        self._test = Evaluator(ENV_ID)
        self._best = -np.inf
        self._verified = False

    def look(
        self,
        policy: Policy,
        seconds: float,
        env_steps: int,
        *,
        chosen: bool = False,
        last: bool = False,
    ) -> None:
        """Validate a policy; test it if it becomes the held policy or is solved in validation.

        Args:
            policy: to evaluate.
            seconds: seconds of training.
            env_steps: environment steps of training.
            chosen: whether the system itself selected the policy; otherwise the best in
                validation is held.
            last: whether these are the final weights of training.
        """
        results = self._validation.rollout(policy, _VALIDATION)
        validation = float(np.mean([result.episode_return for result in results]))
        held = chosen or validation > self._best
        self._best = max(self._best, validation)
        row = {
            "seconds": seconds,
            "observations": env_steps,
            "validation_return": validation,
            "held": held,
            "last": last,
        }
        if held or last or (validation >= SOLVED_RETURN and not self._verified):
            flown = self._test.rollout(policy, _TEST)
            tested = float(np.mean([result.episode_return for result in flown]))
            row["test_return"] = tested
            row["landed"] = float(np.mean([result.outcome == "landed" for result in flown]))
            self._verified |= min(validation, tested) >= SOLVED_RETURN
        self._record(row)


class Enough(Exception):  # noqa: N818 - not an error: the peer's time is over
    """A peer has used up its training time."""


class Watch:
    """Evaluates a peer at intervals.

    Args:
        judge: evaluates its policies.
        marks: seconds at which all systems are compared.
        most: limit of the seconds of training.
    """

    def __init__(self, judge: Judge, marks: Sequence[float], most: float = np.inf) -> None:
        self._judge = judge
        self._marks = marks
        self._most = most
        self._next = next_look(0.0, marks)
        self._clock = Stopwatch()

    def step(self, env_steps: int, policy: Policy) -> None:
        """Call this often, between steps of training.

        Raises:
            Enough: the peer has used up its training time.
        """
        seconds = self._clock.seconds()
        if seconds >= self._most:
            self.end(env_steps, policy)
            raise Enough
        if seconds < self._next:
            return
        with self._clock.paused():
            self._judge.look(policy, seconds, env_steps)
            self._next = next_look(seconds, self._marks)

    def end(self, env_steps: int, policy: Policy) -> None:
        """Call this when training has ended."""
        self._judge.look(policy, self._clock.seconds(), env_steps, last=True)
