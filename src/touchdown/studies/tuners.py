"""Tuners of PID gains: by hand, Twiddle, and two Optuna samplers."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import tomli_w

from touchdown.control.pid import PIDConfig, Rule
from touchdown.core import installation
from touchdown.core.errors import UserError
from touchdown.training import pid_tuning
from touchdown.training.pid_tuning import TUNED, Objective

Tuner = Literal["hand", "twiddle", "cma-es", "tpe"]
TUNERS: tuple[Tuner, ...] = ("hand", "twiddle", "cma-es", "tpe")
_REACH = {"dead_band": (0.0, 0.2)}
_WIDE = (-2.0, 2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuning:
    """Settings of a search for gains.

    Raises:
        UserError: a number is out of range.
    """

    tuner: Tuner
    seed: int
    """Seed of the training starts and of a sampler."""
    rule: Rule = "signed"
    trials: int = 200
    """Largest number of trials, the same for every tuner."""
    starts: int = 100
    """Training starts per trial."""
    test_episodes: int = 100

    def __post_init__(self) -> None:
        for name in ("trials", "starts", "test_episodes"):
            if getattr(self, name) < 1:
                raise UserError(f"{name} = {getattr(self, name)}: must be at least 1")

    def to_dict(self) -> dict[str, Any]:
        """Everything that determines the gains."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Tuned:
    """The result of a tuner."""

    gains: PIDConfig
    best_return: float
    """Mean return over the training starts of its trials."""
    history: tuple[float, ...]
    """The best mean return after each trial."""

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return asdict(self)

    def to_toml(self) -> str:
        """The gains in the form that `fly` and `evaluate` read."""
        return tomli_w.dumps(asdict(self.gains))


def tune(tuning: Tuning, on_trial: Callable[[float, float], object]) -> Tuned:
    """Find gains.

    Args:
        tuning: settings of the search.
        on_trial: called after each trial with the share of trials done and the best mean return.

    Raises:
        UserError: the tuner is an Optuna sampler and Optuna is not installed.
    """
    with Objective(tuning.rule, tuning.starts, tuning.seed) as objective:
        search = _Search(objective, tuning.trials, on_trial)
        if tuning.tuner == "hand":
            search.try_out(objective.point_of(pid_tuning.HAND_PICKED))
        elif tuning.tuner == "twiddle":
            search.by_twiddle()
        else:
            search.by_optuna(tuning.tuner, tuning.seed)
    return Tuned(objective.config_of(search.best), search.best_return, tuple(search.history))


class _Search:
    """Tries gains until no trials are left, and keeps the best."""

    def __init__(
        self, objective: Objective, trials: int, on_trial: Callable[[float, float], object]
    ) -> None:
        self._objective = objective
        self._trials = trials
        self._on_trial = on_trial
        self.history: list[float] = []
        self.best: tuple[float, ...] = ()
        self.best_return = -np.inf

    @property
    def is_over(self) -> bool:
        return len(self.history) >= self._trials

    def try_out(self, point: tuple[float, ...]) -> float:
        value = self._objective(point)
        if value > self.best_return:
            self.best, self.best_return = point, value
        self.history.append(self.best_return)
        self._on_trial(len(self.history) / self._trials, self.best_return)
        return value

    def by_twiddle(self) -> None:
        """Run Twiddle until no trials are left; if it converges, restart from the best gains."""
        start = self._objective.point_of(pid_tuning.HAND_PICKED)
        while not self.is_over:
            for _ in pid_tuning.search(self.try_out, start, tolerance=0.05):
                if self.is_over:
                    return
            start = self.best

    def by_optuna(self, tuner: Literal["cma-es", "tpe"], seed: int) -> None:
        try:
            import optuna  # noqa: PLC0415 - an extra
        except ImportError:
            raise installation.missing(f"tuner = {tuner!r}", "Optuna", "optuna") from None
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        start: dict[str, Any] = dict(
            zip(TUNED, self._objective.point_of(pid_tuning.HAND_PICKED), strict=True)
        )
        sampler = (
            optuna.samplers.CmaEsSampler(seed=seed)
            if tuner == "cma-es"
            else optuna.samplers.TPESampler(seed=seed)
        )
        study = optuna.create_study(direction="maximize", sampler=sampler)
        study.enqueue_trial(start)
        while not self.is_over:
            trial = study.ask()
            point = tuple(trial.suggest_float(name, *_REACH.get(name, _WIDE)) for name in TUNED)
            study.tell(trial, self.try_out(point))
