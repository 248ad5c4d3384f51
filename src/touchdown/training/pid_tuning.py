"""Tunes the PID controller with Twiddle on training starts."""

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
import tomli_w

from touchdown.control.pid import PIDConfig, PIDPolicy, Rule
from touchdown.control.twiddle import Trial, twiddle
from touchdown.core.seeding import tuning_starts
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander.engine import engine_in_use
from touchdown.lander.rules import LANDER_ID

TUNED = ("kp_vertical", "ki_vertical", "kp_angle", "kd_angle", "dead_band")
HAND_PICKED = PIDConfig(
    rule="signed",
    kp_vertical=-0.5,
    ki_vertical=-0.25,
    kp_angle=-0.5,
    kd_angle=-0.5,
    dead_band=0.05,
)
"""Initial gains for Twiddle: signs from physics, magnitudes chosen by hand."""
_NUM_ENVS = 256  # environments in a pool: the controller's arithmetic is cheap, the calls are not
_FIRST_STEPS = (0.2, 0.2, 0.2, 0.2, 0.02)


@dataclass(frozen=True, slots=True)
class TuningStep:
    """One trial of the tuner."""

    trial: int
    mean_return: float
    best_return: float
    best: PIDConfig
    step: float
    """Largest relative step size; tuning ends when it is below the tolerance."""


class Objective:
    """The mean return of gains over training starts.

    All gains fly from the same starts, so that chance does not decide between two of them.

    Args:
        rule: the action rule to tune for.
        starts: number of training starts.
        seed: seed that selects them.
        begin: supplies the fields that are not tuned; its rule is ignored.
    """

    def __init__(self, rule: Rule, starts: int, seed: int, begin: PIDConfig = HAND_PICKED) -> None:
        self._begin = replace(begin, rule=rule)
        self._starts = tuning_starts(seed, starts)
        self._evaluator = Evaluator(LANDER_ID, min(starts, _NUM_ENVS), engine_in_use())

    def __enter__(self) -> "Objective":
        return self

    def __exit__(self, *_: object) -> None:
        self._evaluator.close()

    def __call__(self, point: tuple[float, ...]) -> float:
        """Evaluate gains in the order of `TUNED`."""
        results = self._evaluator.rollout(PIDPolicy(self.config_of(point)), self._starts)
        return float(np.mean([result.episode_return for result in results]))

    def config_of(self, point: tuple[float, ...]) -> PIDConfig:
        """The controller with gains in the order of `TUNED`; dead bands are at least 0."""
        values = dict(zip(TUNED, point, strict=True))
        values["dead_band"] = max(0.0, values["dead_band"])
        return replace(self._begin, **values)

    @staticmethod
    def point_of(config: PIDConfig) -> tuple[float, ...]:
        """A controller's gains in the order of `TUNED`."""
        return tuple(getattr(config, name) for name in TUNED)


def search(
    objective: Callable[[tuple[float, ...]], float], begin: tuple[float, ...], tolerance: float
) -> Iterator[Trial]:
    """Twiddle over gains in the order of `TUNED`, one trial at a time.

    Args:
        objective: function of gains to maximise.
        begin: initial gains.
        tolerance: relative step size at which to stop.
    """
    return twiddle(objective, begin, _FIRST_STEPS, tolerance)


def tune_pid(
    rule: Rule,
    starts: int,
    seed: int = 0,
    tolerance: float = 0.2,
    begin: PIDConfig = HAND_PICKED,
) -> Iterator[TuningStep]:
    """Maximise the mean return over training starts, one trial at a time.

    Args:
        rule: the action rule to tune for.
        starts: number of training starts per trial.
        seed: seed that selects them.
        tolerance: relative step size at which to stop.
        begin: initial gains and dead band; its rule is ignored.
    """
    with Objective(rule, starts, seed, begin) as objective:
        trials = search(objective, objective.point_of(begin), tolerance)
        for number, trial in enumerate(trials, start=1):
            best = objective.config_of(trial.best)
            yield TuningStep(number, trial.value, trial.best_value, best, trial.step)


def share_done(step: float, tolerance: float) -> float:
    """Share of the search that is done, by its step sizes, which shrink by a constant factor."""
    return min(1.0, math.log(min(1.0, step)) / math.log(tolerance))


def to_toml(step: TuningStep, starts: int, seed: int, begin: PIDConfig) -> str:
    """The tuned gains as TOML, with their origin in a comment."""
    first = ", ".join(f"{name} {getattr(begin, name):g}" for name in TUNED)
    return (
        f"# touchdown tune pid --rule {step.best.rule} --starts {starts} --seed {seed}\n"
        f"# mean return {step.best_return:.1f} on those training starts, {step.trial} trials\n"
        f"# begun from {first}\n" + tomli_w.dumps(asdict(step.best))
    )
