"""Progress, speed and remaining time of a training run."""

import time
from dataclasses import dataclass

from touchdown.config.sections import TrainingConfig


@dataclass(frozen=True, slots=True)
class TrainingStatus:
    """State of training for a progress view, once per episode."""

    episode: int
    env_steps: int
    episode_return: float
    recent_return: float
    """Mean over the recent episodes."""
    epsilon: float
    loss: float | None
    recent_time_limit_share: float
    """Share of the recent episodes that reached the time limit."""
    steps_per_second: float
    share_done: float
    """Share of the limits of training."""
    seconds_left: float
    """Estimated seconds up to the limits."""
    may_stop_early: bool = False
    """Whether training ends before its limits once the environment is solved."""


class Budget:
    """How much of training is done, by episodes or by steps, whichever is closer to its limit.

    Args:
        training: the limits.
    """

    def __init__(self, training: TrainingConfig) -> None:
        self._episodes = training.episodes
        self._env_steps = training.max_env_steps

    def done(self, episodes: int, env_steps: int) -> float:
        """From 0 at the start to 1 at the end."""
        share = episodes / self._episodes
        if self._env_steps:
            share = max(share, env_steps / self._env_steps)
        return min(1.0, share)


class Pace:
    """Speed of training since this process started or resumed it.

    Args:
        budget: the run's budget.
        episodes: episodes before this process.
        env_steps: environment steps before this process.
        seconds: seconds of training before this process.
        began: start of this process, by `time.monotonic`.
    """

    def __init__(
        self, budget: Budget, *, episodes: int, env_steps: int, seconds: float, began: float
    ) -> None:
        self._budget = budget
        self._began = began
        self._seconds_before = seconds
        self._env_steps_before = env_steps
        self._done_before = budget.done(episodes, env_steps)

    def seconds(self) -> float:
        """Seconds of training, including those before a resume."""
        return self._seconds_before + time.monotonic() - self._began

    def steps_per_second(self, env_steps: int) -> float:
        """Environment steps per second of this process."""
        return (env_steps - self._env_steps_before) / (time.monotonic() - self._began)

    def done_and_left(self, episodes: int, env_steps: int) -> tuple[float, float]:
        """The share of training that is done, and the estimated seconds for the rest."""
        done = self._budget.done(episodes, env_steps)
        gained = done - self._done_before
        if done >= 1 or gained <= 0:
            return done, 0.0
        return done, (1 - done) * (time.monotonic() - self._began) / gained
