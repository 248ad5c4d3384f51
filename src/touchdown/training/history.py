"""Records of training: lines for episodes, for some updates and for validations."""

from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from touchdown.core import records
from touchdown.core.errors import UserError
from touchdown.core.types import Outcome
from touchdown.envs.episodes import Episode
from touchdown.evaluation.evaluator import EpisodeResult
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import EpisodeRow, UpdateRow, ValidationRow
from touchdown.training.loggers import Recorder

RECENT = 100
"""Number of episodes that count as recent, as is usual."""


class History:
    """Writes a run's records, passes scalars to a callback, and keeps the recent episodes.

    Args:
        folder: the run's folder; episodes from before a resume also count as recent.
        recorder: appends to the records.
        on_scalars: called with the environment steps so far and the scalars by tag, after they are
            recorded.

    Raises:
        UserError: `episodes.jsonl` is broken.
    """

    def __init__(
        self,
        folder: RunFolder,
        recorder: Recorder,
        on_scalars: Callable[[int, Mapping[str, float]], object] = lambda _step, _scalars: None,
    ) -> None:
        self._folder = folder
        self._recorder = recorder
        self._on_scalars = on_scalars
        rows = records.decode_jsonl(folder.episodes, EpisodeRow)[-RECENT:]
        self._returns = deque((row.episode_return for row in rows), RECENT)
        self._timed_out = deque((row.outcome == "timed out" for row in rows), RECENT)
        self.last_loss: float | None = None

    @property
    def recent_return(self) -> float:
        """Mean return of the recent episodes."""
        return float(np.mean(self._returns))

    @property
    def recent_time_limit_share(self) -> float:
        """Share of the recent episodes that reached the time limit."""
        return float(np.mean(self._timed_out))

    def episode(
        self,
        episode: Episode,
        outcome: Outcome,
        *,
        number: int,
        env_steps: int,
        epsilon: float,
        seconds: float,
    ) -> None:
        """Record a finished episode.

        Args:
            episode: the finished episode.
            outcome: how it ended.
            number: number of finished episodes so far, including this one.
            env_steps: environment steps so far.
            epsilon: probability of a random action in its last step.
            seconds: seconds of training so far.
        """
        steps = len(episode.actions)
        self._returns.append(episode.episode_return)
        self._timed_out.append(outcome == "timed out")
        row = EpisodeRow(
            episode=number,
            env_steps=env_steps,
            episode_return=episode.episode_return,
            steps=steps,
            outcome=outcome,
            epsilon=epsilon,
            seconds=round(seconds, 3),
        )
        scalars = {
            "rollout/ep_rew": episode.episode_return,
            "rollout/ep_rew_mean": self.recent_return,
            "rollout/ep_len": float(steps),
            "rollout/exploration_rate": epsilon,
            "rollout/time_limit_share": self.recent_time_limit_share,
            "time/fps": env_steps / max(seconds, 1e-9),
        }
        self._recorder.write(self._folder.episodes, row)
        self._log(env_steps, scalars)

    def update(
        self, metrics: Mapping[str, float], *, updates: int, env_steps: int, learning_rate: float
    ) -> None:
        """Record an update.

        Raises:
            UserError: a metric is not finite, so training diverged.
        """
        metrics = {name: float(value) for name, value in metrics.items()}
        self.last_loss = metrics.get("loss")
        if not all(np.isfinite(value) for value in metrics.values()):
            said = ", ".join(f"{name} {value:g}" for name, value in metrics.items())
            raise diverged(learning_rate, f"update {updates}", said)
        row = UpdateRow(update=updates, env_steps=env_steps, metrics=metrics)
        self._recorder.write(self._folder.updates, row)
        self._log(env_steps, {f"train/{name}": value for name, value in metrics.items()})

    def validation(
        self, results: list[EpisodeResult], mean_return: float, *, episode: int, env_steps: int
    ) -> None:
        """Record the greedy episodes of a validation."""
        row = ValidationRow(
            env_steps=env_steps,
            episode=episode,
            mean_return=mean_return,
            returns=[result.episode_return for result in results],
            time_limit_share=float(np.mean([r.outcome == "timed out" for r in results])),
        )
        self._recorder.write(self._folder.validations, row)
        self._log(env_steps, {"eval/mean_reward": mean_return})

    def _log(self, env_steps: int, scalars: Mapping[str, float]) -> None:
        self._recorder.log(env_steps, scalars)
        self._on_scalars(env_steps, scalars)


def diverged(learning_rate: float, when: str, said: str) -> UserError:
    """The error of a training whose weights or metrics are no longer finite.

    Args:
        learning_rate: the setting that most often is the reason.
        when: the update, or the episode and the step.
        said: what is not finite.
    """
    return UserError(
        f"learning_rate = {learning_rate}: training diverged at {when} ({said}); the run stays "
        "unfinished; start another with a lower learning_rate, gradient clipping (max_grad_norm) "
        "or a lower reward_scale"
    )
