"""Training one run from a config, or going on with one, to the last file in its folder."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.core import files
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.seeding import VALIDATION_STARTS, streams, training_start
from touchdown.core.types import Outcome, Policy
from touchdown.envs import environment
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.outcome import outcome_of, threshold_of
from touchdown.envs.pool import make_pool
from touchdown.evaluation.evaluator import NUM_ENVS, Evaluator
from touchdown.lander import engine as engines
from touchdown.lander import rules
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training import checkpoint
from touchdown.training.checkpoint import Candidate, Solved
from touchdown.training.loggers import Recorder
from touchdown.training.loop import AgentStep, begin, interact

RECENT = 100  # episodes that "recent" means, as everywhere in the field
_STEPS_BETWEEN_LOOKS = 50
# worlds of the exact engine flown side by side: cheap to keep, and the more the faster
_NUM_EXACT_ENVS = 128
# standard errors that a mean has to be above the threshold: wrong once in 700 times at the edge
_SURE = 3.0


@dataclass(frozen=True, slots=True)
class Status:
    """What a progress view shows; one a training episode."""

    episode: int
    observations: int
    episode_return: float
    recent_return: float
    epsilon: float
    loss: float | None
    recent_time_limit_share: float
    steps_per_second: float
    share_done: float
    seconds_left: float


class _Budget:
    """How much of the training is done: by episodes or by observations, whichever is nearer."""

    def __init__(self, config: Config) -> None:
        self._episodes = config.training.episodes
        self._observations = config.training.max_env_steps

    def done(self, episodes: int, observations: int) -> float:
        """From 0 at the start to 1 at the end."""
        share = episodes / self._episodes
        if self._observations:
            share = max(share, observations / self._observations)
        return min(1.0, share)


def stop_threshold(config: Config) -> float | None:
    """The mean return at which training may stop; None where it goes on to the end of its budget.

    Raises:
        UserError: it is to stop when the world is solved, and Gymnasium names no threshold for it.
    """
    if not config.training.stop_when_solved:
        return None
    threshold = threshold_of(config.env_id)
    if threshold is None:
        raise UserError(
            f"stop_when_solved = True: must be False for env_id = {config.env_id!r}, for which "
            "Gymnasium names no reward threshold"
        )
    return threshold


class _Pace:
    """How fast training goes, from where it began or was gone on with."""

    def __init__(
        self, budget: _Budget, progress: checkpoint.Progress, observations: int, began: float
    ) -> None:
        self._budget = budget
        self._began = began
        self._seconds_before = progress.seconds
        self._observations_before = observations
        self._done_before = budget.done(progress.episodes, observations)

    def seconds(self) -> float:
        """Of training, those before a resume included."""
        return self._seconds_before + time.monotonic() - self._began

    def steps_per_second(self, observations: int) -> float:
        """Observations a second since it began."""
        return (observations - self._observations_before) / (time.monotonic() - self._began)

    def done_and_left(self, episodes: int, observations: int) -> tuple[float, float]:
        """The share that is done, and the seconds that the rest will take."""
        done = self._budget.done(episodes, observations)
        gained = done - self._done_before
        if done >= 1 or gained <= 0:
            return done, 0.0
        return done, (1 - done) * (time.monotonic() - self._began) / gained


class Trainer:
    """One run being trained.

    Args:
        folder: the run's; it holds a config, and a checkpoint if the run is to go on.
        should_stop: asked now and then; True saves and raises `Interrupted`.
        on_status: told after each training episode.
        on_phase: told what begins: a line of words, and how many episodes it will fly.
        on_flight: told after each episode of the final choice.
    """

    def __init__(
        self,
        folder: RunFolder,
        *,
        should_stop: Callable[[], bool] = lambda: False,
        on_status: Callable[[Status], object] = lambda _: None,
        on_phase: Callable[[str, int], object] = lambda _text, _count: None,
        on_flight: Callable[[], object] = lambda: None,
    ) -> None:
        self._began = time.monotonic()
        self._folder = folder
        self._config = folder.config()
        self._threshold = stop_threshold(self._config)
        self._should_stop = should_stop
        self._on_status = on_status
        self._on_phase = on_phase
        self._on_flight = on_flight
        with ExitStack() as resources:
            resources.enter_context(folders.lock(folder))
            self._open(resources)
            self._resources = resources.pop_all()

    def _open(self, resources: ExitStack) -> None:
        """Make the agent and the world, go on from the last checkpoint, and open the records."""
        folder, config = self._folder, self._config
        engine = engines.engine_in_use()
        spaces = environment.spaces_of(config.env_id, engine=engine)
        self._pool = make_pool(config.env_id, config.training.num_envs, engine)
        resources.callback(self._pool.close)
        self._streams = streams(config.seed)
        self._agent: Agent = make_agent(config, spaces, self._streams)
        self._budget = _Budget(config)
        self._progress = checkpoint.Progress(next_validation=config.training.validation_period)
        files.remove_temporaries([folder.path, folder.checkpoints])
        newest = checkpoint.newest_checkpoint(folder.checkpoints)
        if newest:
            self._progress = checkpoint.restore_checkpoint(
                newest, config.digest, self._agent, self._streams
            )
            self._check_records()
        self._recorder = Recorder(folder, self._progress.record_sizes)
        resources.callback(self._recorder.close)
        exact = engine == "exact" and rules.is_lander(config.env_id)
        self._evaluator = Evaluator(config.env_id, _NUM_EXACT_ENVS if exact else NUM_ENVS, engine)
        resources.callback(self._evaluator.close)
        rows = files.read_jsonl(folder.episodes, ("episode_return", "outcome"))[-RECENT:]
        self._recent_returns = [float(row["episode_return"]) for row in rows]
        self._recent_timed_out = [row["outcome"] == "timed out" for row in rows]
        self._last_loss: float | None = None
        self._underway: Underway | None = None

    def _check_records(self) -> None:
        for name, size in self._progress.record_sizes.items():
            if not name.endswith(".jsonl"):
                continue  # TensorBoard's events are a copy: a run does without them
            path = self._folder.path / name
            if not path.is_file() or path.stat().st_size < size:
                raise UserError(f"{path}: shorter than its checkpoint says; it was altered")

    @property
    def last_policy(self) -> Policy:
        """What the agent has learnt so far, chosen or not, flown greedily."""
        return self._agent.model.policy(self._agent.params())

    def close(self) -> None:
        """Give back files, environments and the right to write to the run."""
        self._resources.close()

    def run(self) -> None:
        """Train to the end, choose the best checkpoint and write it.

        Raises:
            Interrupted: `should_stop` said so; the run was saved.
            OSError: something could not be written; the last checkpoint is whole.
        """
        if self._progress.finished and self._folder.best.is_file():
            return
        if not self._progress.trained:
            self._train()
        self._choose()

    def _train(self) -> None:
        progress, period = self._progress, self._config.training.checkpoint_seconds
        self._pace = pace = _Pace(self._budget, progress, self._agent.env_steps, self._began)
        last_saved = time.monotonic()
        self._underway = underway = self._go_on()
        for agent_step in interact(self._agent, self._pool, self._start_of, underway):
            observations = self._agent.env_steps
            if agent_step.metrics is not None:
                self._record_update(agent_step.metrics)
            for episode, outcome in self._ended(agent_step):
                progress.seconds = pace.seconds()
                progress.episodes += 1
                self._record_episode(episode, outcome, agent_step.epsilon)
                self._on_status(self._status(episode, agent_step, pace))
            if agent_step.ended:
                progress.trained = self._budget.done(progress.episodes, observations) >= 1
                if observations >= progress.next_validation or progress.trained:
                    self._validate()
            elif underway.steps[0] % _STEPS_BETWEEN_LOOKS:
                continue
            stop = self._should_stop()
            due = agent_step.ended and time.monotonic() - last_saved >= period
            if stop or progress.trained or due:
                progress.seconds = pace.seconds()
                self._save()
                last_saved = time.monotonic()
            if stop:
                raise Interrupted
            if progress.trained:
                return

    def _status(self, episode: Episode, agent_step: AgentStep, pace: _Pace) -> Status:
        observations = self._agent.env_steps
        done, left = pace.done_and_left(self._progress.episodes, observations)
        return Status(
            episode=self._progress.episodes,
            observations=observations,
            episode_return=episode.episode_return,
            recent_return=float(np.mean(self._recent_returns)),
            epsilon=agent_step.epsilon,
            loss=self._last_loss,
            recent_time_limit_share=float(np.mean(self._recent_timed_out)),
            steps_per_second=pace.steps_per_second(observations),
            share_done=done,
            seconds_left=left,
        )

    def _start_of(self, episode: int) -> int:
        return training_start(self._config.seed, episode)

    def _ended(self, agent_step: AgentStep) -> list[tuple[Episode, Outcome]]:
        steps = agent_step.steps
        outcomes: list[Outcome] = [
            outcome_of(
                self._config.env_id,
                steps.observations[index],
                float(steps.rewards[index]),
                terminated=bool(steps.terminated[index]),
            )
            for index in np.flatnonzero(steps.ended)
        ]
        return list(zip(agent_step.ended, outcomes, strict=True))

    def _go_on(self) -> Underway:
        """Every world's episode: the first, or what was under way at the last checkpoint."""
        underway = self._progress.underway
        if not underway:
            self._agent.begin_episode(0)
            return begin(self._pool, self._start_of, self._config.training.num_envs)
        return Underway([self._flown_again(index, saved) for index, saved in enumerate(underway)])

    def _flown_again(self, index: int, saved: Episode) -> Episode:
        """An episode that was under way, brought to where it was by the actions it took."""
        observation = self._pool.reset(index, self._start_of(saved.number))
        episode = Episode(saved.number, observation)
        for action in saved.actions:
            steps = self._pool.step(np.array([index]), np.array([action]))
            if steps.ended[0]:
                break
            before, episode.observation = episode.observation, steps.observations[0]
            reward = float(steps.rewards[0])
            self._agent.recall(index, before, action, reward, episode.observation)
            episode.actions.append(action)
            episode.episode_return += reward
        same = np.asarray(episode.observation, np.float32).tobytes() == saved.observation.tobytes()
        if saved.actions and not same:
            raise UserError(
                f"{self._folder.checkpoints}: saved in mid-flight, and {self._config.env_id} flown "
                "again does not come to the same place: another machine or version, or a world "
                "of chance"
            )
        return episode

    def _save(self) -> None:
        self._progress.record_sizes = self._recorder.sizes()
        checkpoint.save_checkpoint(
            self._folder.checkpoints,
            self._config.digest,
            self._agent,
            self._streams,
            self._progress,
            self._underway.episodes() if self._underway else [],
        )

    def _record_episode(self, episode: Episode, outcome: Outcome, epsilon: float) -> None:
        agent, progress = self._agent, self._progress
        episode_return, steps = episode.episode_return, len(episode.actions)
        self._recent_returns = [*self._recent_returns[1 - RECENT :], episode_return]
        self._recent_timed_out = [*self._recent_timed_out[1 - RECENT :], outcome == "timed out"]
        row = {
            "episode": progress.episodes,
            "observations": agent.env_steps,
            "episode_return": episode_return,
            "steps": steps,
            "outcome": outcome,
            "epsilon": epsilon,
            "seconds": round(progress.seconds, 3),
        }
        scalars = {
            "rollout/ep_rew": episode_return,
            "rollout/ep_rew_mean": float(np.mean(self._recent_returns)),
            "rollout/ep_len": float(steps),
            "rollout/exploration_rate": epsilon,
            "rollout/time_limit_share": float(np.mean(self._recent_timed_out)),
            "time/fps": agent.env_steps / max(progress.seconds, 1e-9),
        }
        self._recorder.write(self._folder.episodes, row, scalars)

    def _record_update(self, metrics: dict[str, float]) -> None:
        agent = self._agent
        self._last_loss = metrics["loss"]
        if not all(np.isfinite(value) for value in metrics.values()):
            raise UserError(
                f"learning_rate = {self._config.learning.learning_rate}: training diverged at "
                f"update {agent.updates} (loss {metrics['loss']}, mean Q {metrics['mean_q']}); "
                "a lower learning_rate, a max_grad_norm or a smaller reward_scale would help"
            )
        row = {"update": agent.updates, "observations": agent.env_steps, **metrics}
        scalars = {f"train/{name}": value for name, value in metrics.items()}
        self._recorder.write(self._folder.updates, row, scalars)

    def _validate(self) -> None:
        training, progress = self._config.training, self._progress
        observations = self._agent.env_steps
        progress.next_validation = (
            observations // training.validation_period + 1
        ) * training.validation_period
        starts = VALIDATION_STARTS[: training.validation_episodes]
        params = self._agent.params()
        results = self._evaluator.rollout(self._agent.model.policy(params), starts)
        returns = [result.episode_return for result in results]
        mean = float(np.mean(returns))
        row = {
            "observations": observations,
            "episode": progress.episodes,
            "mean_return": mean,
            "returns": returns,
            "time_limit_share": float(np.mean([r.outcome == "timed out" for r in results])),
        }
        self._recorder.write(self._folder.validations, row, {"eval/mean_reward": mean})
        best_so_far = max((f.validation_return for f in progress.candidates), default=-np.inf)
        candidate = Candidate(observations, mean, params)
        candidates = [*progress.candidates, candidate]
        # the earlier of two equals first: sorting is stable
        candidates.sort(key=lambda each: -each.validation_return)
        progress.candidates = candidates[: training.candidate_checkpoints]
        if mean > best_so_far:
            self._write_best(progress.candidates[0], {"validation_return": mean})
        if self._threshold is not None and mean >= self._threshold:
            self._stop_if_sure(candidate, self._threshold)

    def _stop_if_sure(self, candidate: Candidate, threshold: float) -> None:
        """End training if fresh starts show that the mean of as many test starts will hold."""
        training, progress = self._config.training, self._progress
        results = self._evaluator.rollout(
            self._agent.model.policy(candidate.params), self._final_starts()
        )
        returns = [result.episode_return for result in results]
        mean = float(np.mean(returns))
        # both means are estimates: this one, and the test's to come
        error = float(np.std(returns)) * (1 / len(returns) + 1 / training.test_episodes) ** 0.5
        if mean - _SURE * error < threshold:
            return
        progress.solved = Solved(self._pace.seconds(), mean, len(returns))
        progress.candidates = [candidate]
        progress.trained = True

    def _final_starts(self) -> range:
        training = self._config.training
        first = training.validation_episodes
        return VALIDATION_STARTS[first : first + training.final_validation_episodes]

    def _choose(self) -> None:
        """Fly the finalists on fresh validation starts; the best of them is the run's result."""
        progress = self._progress
        if progress.solved is not None:
            self._finish(progress.candidates[0], progress.solved.mean_return)
            return
        starts = self._final_starts()
        self._on_phase(
            f"choosing among {len(progress.candidates)} checkpoints on validation starts",
            len(starts) * len(progress.candidates),
        )
        means: list[float] = []
        for candidate in progress.candidates:
            policy = self._agent.model.policy(candidate.params)
            results = self._evaluator.rollout(policy, starts, self._on_flight)
            means.append(float(np.mean([result.episode_return for result in results])))
            if self._should_stop():
                raise Interrupted
        self._finish(progress.candidates[int(np.argmax(means))], max(means))

    def _finish(self, best: Candidate, mean: float) -> None:
        facts: dict[str, Any] = {
            "validation_return": best.validation_return,
            "final_validation_return": mean,
        }
        if self._progress.solved is not None:
            facts["solved_seconds"] = round(self._progress.solved.seconds, 3)
        self._write_best(best, facts)
        self._progress.finished = True
        self._save()

    def _write_best(self, candidate: Candidate, facts: dict[str, Any]) -> None:
        policy_weights.save_weights(
            self._folder.best,
            self._agent.model,
            candidate.params,
            {"observations": candidate.observations, **facts},
            self._config,
        )
