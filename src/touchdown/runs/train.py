"""Training one run from a config, or going on with one, to the last file in its folder."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from touchdown import files
from touchdown.agents.dqn import DQNAgent, GreedyPilot, Spaces
from touchdown.agents.learner import Metrics
from touchdown.config import Config
from touchdown.errors import Interrupted, UserError
from touchdown.lander import env as lander
from touchdown.runs import checkpoint, pilots
from touchdown.runs import folder as folders
from touchdown.runs.checkpoint import Finalist
from touchdown.runs.evaluate import Fleet
from touchdown.runs.folder import RunFolder
from touchdown.runs.loop import interact
from touchdown.runs.record import Recorder
from touchdown.seeding import VALIDATION_STARTS, streams, training_start
from touchdown.types import FloatArray

RECENT = 100  # episodes that "recent" means, as everywhere in the field
_STEPS_BETWEEN_LOOKS = 50


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
        self._observations = config.training.max_observations

    def done(self, episodes: int, observations: int) -> float:
        """From 0 at the start to 1 at the end."""
        share = episodes / self._episodes
        if self._observations:
            share = max(share, observations / self._observations)
        return min(1.0, share)


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
        self._folder = folder
        self._config = folder.config()
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
        engine = lander.engine_in_use()
        self._world = lander.make(config.env_id, engine=engine)
        resources.callback(self._world.env.close)
        self._streams = streams(config.seed)
        spaces = Spaces(self._world.observation_size, self._world.num_actions)
        self._agent = DQNAgent(config, spaces, self._streams)
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
        self._fleet = Fleet(config.env_id, engine=engine)
        resources.callback(self._fleet.close)
        rows = files.read_jsonl(folder.episodes, ("episode_return", "outcome"))[-RECENT:]
        self._recent_returns = [float(row["episode_return"]) for row in rows]
        self._recent_timed_out = [row["outcome"] == "timed out" for row in rows]
        self._last_loss: float | None = None

    def _check_records(self) -> None:
        for name, size in self._progress.record_sizes.items():
            if not name.endswith(".jsonl"):
                continue  # TensorBoard's events are a copy: a run does without them
            path = self._folder.path / name
            if not path.is_file() or path.stat().st_size < size:
                raise UserError(f"{path}: shorter than its checkpoint says; it was altered")

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
        if self._progress.midway is not None or not self._trained():
            self._train()
        self._choose()

    def _trained(self) -> bool:
        return self._budget.done(self._progress.episodes, self._agent.observations) >= 1

    def _train(self) -> None:
        progress, config = self._progress, self._config
        began = last_saved = time.monotonic()
        before, steps_before = progress.seconds, self._agent.observations
        share_before = self._budget.done(progress.episodes, steps_before)
        episode_return, actions, underway = self._go_on()
        for step in interact(
            self._agent,
            self._world.env,
            lambda episode: training_start(config.seed, episode),
            progress.episodes,
            underway,
        ):
            episode_return += step.reward
            actions.append(step.action)
            if step.metrics is not None:
                self._record_update(step.metrics)
            if not (step.terminated or step.truncated):
                if len(actions) % _STEPS_BETWEEN_LOOKS == 0 and self._should_stop():
                    progress.seconds = before + time.monotonic() - began
                    progress.midway = checkpoint.Midway(
                        tuple(actions), np.asarray(step.o_t, np.float32), *self._agent.mood()
                    )
                    self._save()
                    raise Interrupted
                continue
            outcome = lander.outcome_of(
                config.env_id, step.o_t, step.reward, terminated=step.terminated
            )
            now = time.monotonic()
            progress.seconds = before + now - began
            progress.episodes += 1
            self._record_episode(episode_return, len(actions), outcome)
            share = self._budget.done(progress.episodes, self._agent.observations)
            rate = (share - share_before) / (now - began)
            self._on_status(
                Status(
                    episode=progress.episodes,
                    observations=self._agent.observations,
                    episode_return=episode_return,
                    recent_return=float(np.mean(self._recent_returns)),
                    epsilon=self._agent.epsilon,
                    loss=self._last_loss,
                    recent_time_limit_share=float(np.mean(self._recent_timed_out)),
                    steps_per_second=(self._agent.observations - steps_before) / (now - began),
                    share_done=share,
                    seconds_left=(1 - share) / rate if share < 1 else 0.0,
                )
            )
            episode_return, actions = 0.0, []
            if self._agent.observations >= progress.next_validation or share >= 1:
                self._validate()
            stop = self._should_stop()
            saved_long_ago = now - last_saved >= config.training.checkpoint_seconds
            if stop or share >= 1 or saved_long_ago:
                self._save()
                last_saved = time.monotonic()
            if stop:
                raise Interrupted
            if share >= 1:
                return

    def _go_on(self) -> tuple[float, list[int], FloatArray | None]:
        """Return, actions and latest observation of an episode under way, if there is one."""
        midway = self._progress.midway
        self._progress.midway = None
        if midway is None:
            return 0.0, [], None
        env = self._world.env
        observation, _ = env.reset(seed=training_start(self._config.seed, self._progress.episodes))
        episode_return = 0.0
        for action in midway.actions:
            before = observation
            observation, reward, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                break
            self._agent.recall(before, action, float(reward), observation)
            episode_return += float(reward)
        if np.asarray(observation, np.float32).tobytes() != midway.observation.tobytes():
            raise UserError(
                f"{self._folder.checkpoints}: saved in mid-flight, and {self._config.env_id} flown "
                "again does not come to the same place: another machine or version, or a world "
                "of chance"
            )
        self._agent.restore_mood(midway.epsilon, midway.next_q)
        return episode_return, list(midway.actions), observation

    def _save(self) -> None:
        self._progress.record_sizes = self._recorder.sizes()
        checkpoint.save_checkpoint(
            self._folder.checkpoints,
            self._config.digest,
            self._agent,
            self._streams,
            self._progress,
        )

    def _record_episode(self, episode_return: float, steps: int, outcome: str) -> None:
        agent, progress = self._agent, self._progress
        self._recent_returns = [*self._recent_returns[1 - RECENT :], episode_return]
        self._recent_timed_out = [*self._recent_timed_out[1 - RECENT :], outcome == "timed out"]
        row = {
            "episode": progress.episodes,
            "observations": agent.observations,
            "episode_return": episode_return,
            "steps": steps,
            "outcome": outcome,
            "epsilon": agent.epsilon,
            "seconds": round(progress.seconds, 3),
        }
        scalars = {
            "rollout/ep_rew": episode_return,
            "rollout/ep_rew_mean": float(np.mean(self._recent_returns)),
            "rollout/ep_len": float(steps),
            "rollout/exploration_rate": agent.epsilon,
            "rollout/time_limit_share": float(np.mean(self._recent_timed_out)),
            "time/fps": agent.observations / max(progress.seconds, 1e-9),
        }
        self._recorder.write(self._folder.episodes, row, scalars)

    def _record_update(self, metrics: Metrics) -> None:
        agent = self._agent
        scale = self._config.learning.reward_scale
        shares = agent.memory.shares()
        self._last_loss = float(metrics.loss)
        numbers = {
            "loss": self._last_loss,
            "mean_q": float(metrics.mean_q) / scale,
            "max_q": float(metrics.max_q) / scale,
            "gradient_norm": float(metrics.gradient_norm),
            "rewarded_share": shares.rewarded,
            "terminal_share": shares.terminal,
        }
        if not all(np.isfinite(value) for value in numbers.values()):
            raise UserError(
                f"learning_rate = {self._config.learning.learning_rate}: training diverged at "
                f"update {agent.updates} (loss {numbers['loss']}, mean Q {numbers['mean_q']}); "
                "a lower learning_rate, a max_grad_norm or a smaller reward_scale would help"
            )
        row = {"update": agent.updates, "observations": agent.observations, **numbers}
        scalars = {f"train/{name}": value for name, value in numbers.items()}
        self._recorder.write(self._folder.updates, row, scalars)

    def _validate(self) -> None:
        training, progress = self._config.training, self._progress
        observations = self._agent.observations
        progress.next_validation = (
            observations // training.validation_period + 1
        ) * training.validation_period
        starts = VALIDATION_STARTS[: training.validation_episodes]
        results = self._fleet.fly(self._agent.pilot(), starts)
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
        params = np.array(self._agent.state.online_params)
        best_so_far = max((f.validation_return for f in progress.finalists), default=-np.inf)
        finalists = [*progress.finalists, Finalist(observations, mean, params)]
        # the earlier of two equals first: sorting is stable
        finalists.sort(key=lambda finalist: -finalist.validation_return)
        progress.finalists = finalists[: training.finalists]
        if mean > best_so_far:
            self._write_best(progress.finalists[0], {"validation_return": mean})

    def _choose(self) -> None:
        """Fly the finalists on fresh validation starts; the best of them is the run's result."""
        training, progress = self._config.training, self._progress
        first = training.validation_episodes
        starts = VALIDATION_STARTS[first : first + training.final_validation_episodes]
        self._on_phase(
            f"choosing among {len(progress.finalists)} checkpoints on validation starts",
            len(starts) * len(progress.finalists),
        )
        means: list[float] = []
        for finalist in progress.finalists:
            pilot = GreedyPilot(self._agent.network, finalist.params)
            results = self._fleet.fly(pilot, starts, self._on_flight)
            means.append(float(np.mean([result.episode_return for result in results])))
            if self._should_stop():
                raise Interrupted
        best = progress.finalists[int(np.argmax(means))]
        chosen = {
            "validation_return": best.validation_return,
            "final_validation_return": max(means),
        }
        self._write_best(best, chosen)
        progress.finished = True
        self._save()

    def _write_best(self, finalist: Finalist, facts: dict[str, Any]) -> None:
        pilots.save_weights(
            self._folder.best,
            self._agent.network,
            finalist.params,
            {"observations": finalist.observations, **facts},
            self._config,
        )
