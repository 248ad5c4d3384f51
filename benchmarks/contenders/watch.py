"""Looking at a policy while it is trained, with its clock stopped."""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from touchdown.core.seeding import TEST_STARTS, VALIDATION_STARTS
from touchdown.core.types import Policy
from touchdown.evaluation.evaluator import Evaluator

ENV_ID = "LunarLander-v3"
SOLVED = 200.0
FIRST_LOOK = 5.0  # seconds
RATIO = 1.08  # from a look to the next: as fine early as late, on a logarithmic axis

# far from those that a preset chooses its own checkpoints on
_VALIDATION = VALIDATION_STARTS[500_000:500_100]
_TEST = TEST_STARTS[:100]


class Stopwatch:
    """Seconds of training; it stands while somebody looks."""

    def __init__(self) -> None:
        self._began = time.perf_counter()
        self._stood = 0.0

    def seconds(self) -> float:
        """Since it was made, less what it stood."""
        return time.perf_counter() - self._began - self._stood

    @contextmanager
    def standing(self) -> Generator[None]:
        """Stopped within the block."""
        stopped = time.perf_counter()
        try:
            yield
        finally:
            self._stood += time.perf_counter() - stopped


def next_look(seconds: float, marks: Sequence[float]) -> float:
    """When to look again: as regularly as `RATIO` says, and at every mark.

    Args:
        seconds: of the look before.
        marks: seconds at which all systems are compared.
    """
    regular = max(FIRST_LOOK, seconds * RATIO)
    return min([regular, *(mark for mark in marks if mark > seconds)])


class Judge:
    """Flies policies greedily and writes down what comes of it.

    Validation flies the exact engine, which is stock to the last bit; a test flies stock itself.

    Args:
        record: takes one look as a JSON object.
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
        observations: int,
        *,
        chosen: bool = False,
        last: bool = False,
    ) -> None:
        """Validate a policy; test it if it is held from now on, or says that it lands.

        Args:
            policy: the policy.
            seconds: of training.
            observations: of training.
            chosen: the system holds it by a choice of its own; else the best validated is held.
            last: the last weights of the training.
        """
        results = self._validation.fly(policy, _VALIDATION)
        validation = float(np.mean([result.episode_return for result in results]))
        held = chosen or validation > self._best
        self._best = max(self._best, validation)
        row = {
            "seconds": seconds,
            "observations": observations,
            "validation_return": validation,
            "held": held,
            "last": last,
        }
        if held or last or (validation >= SOLVED and not self._verified):
            flown = self._test.fly(policy, _TEST)
            tested = float(np.mean([result.episode_return for result in flown]))
            row["test_return"] = tested
            row["landed"] = float(np.mean([result.outcome == "landed" for result in flown]))
            self._verified |= min(validation, tested) >= SOLVED
        self._record(row)


class Enough(Exception):  # noqa: N818 - no error: the time that a peer was given is over
    """A peer has trained as long as it was to."""


class Watch:
    """Looks at a peer from time to time.

    Args:
        judge: flies what is looked at.
        marks: seconds at which all systems are compared.
        most: seconds that the peer may train.
    """

    def __init__(self, judge: Judge, marks: Sequence[float], most: float = np.inf) -> None:
        self._judge = judge
        self._marks = marks
        self._most = most
        self._next = next_look(0.0, marks)
        self._clock = Stopwatch()

    def step(self, observations: int, policy: Policy) -> None:
        """To be called between steps of training, often.

        Raises:
            Enough: the peer has trained as long as it was to.
        """
        seconds = self._clock.seconds()
        if seconds >= self._most:
            self.end(observations, policy)
            raise Enough
        if seconds < self._next:
            return
        with self._clock.standing():
            self._judge.look(policy, seconds, observations)
            self._next = next_look(seconds, self._marks)

    def end(self, observations: int, policy: Policy) -> None:
        """To be called when the training has ended."""
        self._judge.look(policy, self._clock.seconds(), observations, last=True)
