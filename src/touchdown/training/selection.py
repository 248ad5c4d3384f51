"""Selects the result of a training run: validation, candidates and final selection."""

from collections.abc import Callable

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.config.config import Config
from touchdown.core import finite
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.starts import VALIDATION_STARTS
from touchdown.core.types import Tensors
from touchdown.envs.custom import threshold_of
from touchdown.evaluation.evaluator import EpisodeResult, Evaluator
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.weights import save_weights
from touchdown.runs.folder import RunFolder
from touchdown.training.checkpoint import Candidate, Progress
from touchdown.training.history import History, diverged
from touchdown.training.policy_saver import PolicySaver
from touchdown.training.state import Solved

# standard errors by which a mean must exceed the threshold: in the worst case 1 in 700 is wrong
_SURE = 3.0


def stop_threshold(config: Config) -> float | None:
    """The mean return at which training may stop; None if it uses its full budget.

    Raises:
        UserError: `stop_when_solved` is set, but Gymnasium defines no threshold.
    """
    if not config.training.stop_when_solved:
        return None
    threshold = threshold_of(config.env_id)
    if threshold is None:
        raise UserError(
            f"stop_when_solved = True: must be False for env_id = {config.env_id!r}, for which "
            "Gymnasium defines no reward threshold"
        )
    return threshold


class Selection:
    """Validates the agent during training, keeps the best candidates, and selects one of them.

    Args:
        config: the run's config.
        folder: the run's folder; the best weights so far are written there.
        agent: the agent in training.
        evaluator: runs the validation episodes.
        progress: the run's progress, which contains the candidates.
        history: records validations.
        saver: saves the policy at each validation; None saves none.

    Raises:
        UserError: `stop_when_solved` is set, but the environment has no threshold.
    """

    def __init__(
        self,
        config: Config,
        folder: RunFolder,
        agent: Agent,
        evaluator: Evaluator,
        progress: Progress,
        history: History,
        saver: PolicySaver | None = None,
    ) -> None:
        self._config = config
        self._folder = folder
        self._agent = agent
        self._evaluator = evaluator
        self._progress = progress
        self._history = history
        self._saver = saver
        self._threshold = stop_threshold(config)

    def validate(self, seconds: Callable[[], float]) -> None:
        """Validate the current policy, and keep it if it is a candidate.

        Args:
            seconds: returns the seconds of training so far; called if the environment is solved.

        Raises:
            UserError: the weights are not finite, so training diverged.
        """
        training, progress = self._config.training, self._progress
        env_steps = progress.env_steps
        period = training.validation_period
        progress.next_validation = (env_steps // period + 1) * period
        weights = self._agent.weights()
        if said := finite.complaint(weights):
            raise diverged(
                self._config.learning.learning_rate,
                f"episode {progress.episodes}, step {env_steps}",
                said,
            )
        results = self._rollout(weights, VALIDATION_STARTS[: training.validation_episodes])
        mean = _mean_return(results)
        self._history.validation(results, mean, episode=progress.episodes, env_steps=env_steps)
        if self._saver is not None:
            self._saver.save(self._agent, weights, env_steps, mean)
        best_so_far = max((c.validation_return for c in progress.candidates), default=-np.inf)
        candidate = Candidate(env_steps, mean, weights)
        candidates = [*progress.candidates, candidate]
        # in a tie the earlier one is first, as sorting is stable
        candidates.sort(key=lambda each: -each.validation_return)
        progress.candidates = candidates[: training.candidate_checkpoints]
        if mean > best_so_far:
            self._write_best(progress.candidates[0])
        if self._threshold is not None and mean >= self._threshold:
            self._stop_if_sure(candidate, self._threshold, seconds)

    def _stop_if_sure(
        self, candidate: Candidate, threshold: float, seconds: Callable[[], float]
    ) -> None:
        """End training if fresh starts show with confidence that the test will succeed."""
        training, progress = self._config.training, self._progress
        results = self._rollout(candidate.weights, self._final_starts())
        returns = [result.episode_return for result in results]
        mean = _mean_return(results)
        # both means are estimates, this one and that of the test
        error = float(np.std(returns)) * (1 / len(returns) + 1 / training.test_episodes) ** 0.5
        if mean - _SURE * error < threshold:
            return
        progress.solved = Solved(seconds(), mean, len(returns))
        progress.candidates = [candidate]
        progress.trained = True

    def choose(
        self,
        on_phase: Callable[[str, int], object],
        on_episode: Callable[[], object],
        should_stop: Callable[[], bool],
    ) -> None:
        """Evaluate the candidates from fresh validation starts; the best one is the run's result.

        Args:
            on_phase: called with a description and the number of episodes to come.
            on_episode: called after each episode.
            should_stop: called after each candidate.

        Raises:
            Interrupted: `should_stop` returned True.
        """
        progress = self._progress
        if progress.solved is not None:
            self._write_result(progress.candidates[0], progress.solved.mean_return)
            return
        starts = self._final_starts()
        on_phase(
            f"evaluating {len(progress.candidates)} candidate checkpoints on validation starts",
            len(starts) * len(progress.candidates),
        )
        means: list[float] = []
        for candidate in progress.candidates:
            means.append(_mean_return(self._rollout(candidate.weights, starts, on_episode)))
            if should_stop():
                raise Interrupted
        self._write_result(progress.candidates[int(np.argmax(means))], max(means))

    def _rollout(
        self,
        weights: Tensors,
        starts: range,
        on_episode: Callable[[], object] = lambda: None,
    ) -> list[EpisodeResult]:
        return self._evaluator.rollout(self._agent.policy(weights), starts, on_episode)

    def _final_starts(self) -> range:
        """Validation starts that no candidate has been evaluated on yet."""
        training = self._config.training
        first = training.validation_episodes
        return VALIDATION_STARTS[first : first + training.final_validation_episodes]

    def _write_result(self, best: Candidate, mean: float) -> None:
        solved = self._progress.solved
        seconds = None if solved is None else round(solved.seconds, 3)
        self._write_best(best, final_validation_return=mean, solved_seconds=seconds)

    def _write_best(
        self,
        candidate: Candidate,
        final_validation_return: float | None = None,
        solved_seconds: float | None = None,
    ) -> None:
        facts = WeightsFacts(
            env_steps=candidate.env_steps,
            validation_return=candidate.validation_return,
            final_validation_return=final_validation_return,
            solved_seconds=solved_seconds,
        )
        policy = self._agent.policy(candidate.weights)
        save_weights(self._folder.best, candidate.weights, policy, facts, self._config)


def _mean_return(results: list[EpisodeResult]) -> float:
    return float(np.mean([result.episode_return for result in results]))
