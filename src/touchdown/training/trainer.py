"""Trains or resumes one run until its best checkpoint is selected."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from typing import cast

import numpy as np

from touchdown.agents.agent import Agent
from touchdown.agents.dqn import DQNAgent
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.registry import make_agent
from touchdown.core import records, temporaries
from touchdown.core.errors import Interrupted
from touchdown.core.seeding import streams, training_start
from touchdown.core.types import Outcome, Policy
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.outcome import outcome_of
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.evaluation.evaluator import NUM_ENVS, Evaluator
from touchdown.lander import engine as engines
from touchdown.lander import rules
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.loop import is_built, why_python
from touchdown.runs.rows import ValidationRow
from touchdown.runs.training_flights import TrainingFlightRow
from touchdown.training import checkpoint
from touchdown.training.compiled import CompiledLoop
from touchdown.training.compiled_pqn import CompiledPQN
from touchdown.training.history import History
from touchdown.training.loggers import Recorder
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin, interact
from touchdown.training.pace import Budget, Pace, TrainingStatus
from touchdown.training.policy_saver import PolicySaver
from touchdown.training.resume import replay_episodes
from touchdown.training.rollouts import CompiledSteps
from touchdown.training.selection import Selection

# environments of the exact engine in the evaluator; they are cheap, and more are faster
_NUM_EXACT_ENVS = 128


class Trainer:
    """Trains one run.

    Args:
        folder: the run's folder, with a config, and a checkpoint if the run is resumed.
        should_stop: called regularly; True saves the run and raises `Interrupted`.
        on_status: called after each training episode.
        on_phase: called when the final selection begins, with a description and the number of
            episodes to come.
        on_episode: called after each episode of the final selection.
        on_scalars: called with the environment steps so far and the scalars by tag, as they are
            recorded. An exception that it raises ends training; the last checkpoint stays intact.
        may_compile: whether to use the compiled loops if they support the config; results are the
            same without it.
        replayable: whether the run also records what is needed to watch its training: the actions
            of each episode of the lander, and the policy at each validation.

    Raises:
        DamagedError: the run has checkpoints, but none is whole.
        UserError: another process is training the run, its files are broken, or its environment
            cannot be made.
    """

    def __init__(
        self,
        folder: RunFolder,
        *,
        should_stop: Callable[[], bool] = lambda: False,
        on_status: Callable[[TrainingStatus], object] = lambda _: None,
        on_phase: Callable[[str, int], object] = lambda _text, _count: None,
        on_episode: Callable[[], object] = lambda: None,
        on_scalars: Callable[[int, Mapping[str, float]], object] = lambda _step, _scalars: None,
        may_compile: bool = True,
        replayable: bool = False,
    ) -> None:
        self._began = time.monotonic()
        self._folder = folder
        self._config = folder.config()
        self._should_stop = should_stop
        self._on_status = on_status
        self._on_phase = on_phase
        self._on_episode = on_episode
        self._on_scalars = on_scalars
        self._replayable = replayable
        self._may_compile = may_compile and is_built()
        self._compiled = may_compile and why_python(self._config) is None
        with ExitStack() as resources:
            resources.enter_context(folders.lock(folder))
            self._open(resources)
            self._resources = resources.pop_all()

    def _open(self, resources: ExitStack) -> None:
        """Make the agent and its environments, restore the last checkpoint and open the records."""
        folder, config = self._folder, self._config
        engine = engines.engine_in_use()
        self._pool = make_pool(config.env_id, config.training.num_envs, engine)
        resources.callback(self._pool.close)
        self._streams = streams(config.seed)
        self._agent: Agent = make_agent(config, self._pool.spaces, self._streams)
        self._budget = Budget(config.training)
        self._progress = checkpoint.Progress(next_validation=config.training.validation_period)
        folder.checkpoints.mkdir(exist_ok=True)  # a user may have deleted them to save space
        temporaries.remove_temporaries([folder.path, folder.checkpoints, folder.over_training])
        restored = checkpoint.restore_newest(
            folder.checkpoints, config.digest, self._agent, self._streams
        )
        if restored is not None:
            self._progress = restored
        self._keeps_flights = self._replayable and config.env_id == rules.LANDER_ID
        self._recorder = Recorder(folder, self._progress.records.sizes, flights=self._keeps_flights)
        resources.callback(self._recorder.close)
        self._history = History(folder, self._recorder, self._on_scalars)
        exact = engine == "exact" and rules.is_lander(config.env_id)
        evaluator = Evaluator(
            config.env_id,
            _NUM_EXACT_ENVS if exact else NUM_ENVS,
            engine,
            CompiledSteps() if self._may_compile else None,
        )
        resources.callback(evaluator.close)
        self._saver = self._policy_saver() if self._replayable else None
        self._selection = Selection(
            config,
            folder,
            self._agent,
            evaluator,
            self._progress,
            self._history,
            self._saver,
        )
        self._underway: Underway | None = None

    def _policy_saver(self) -> PolicySaver:
        """Keeps the policies until the resumed checkpoint; of a new run, writes the first."""
        rows = records.decode_jsonl(self._folder.validations, ValidationRow)
        saver = PolicySaver(self._folder, self._config, (row.env_steps for row in rows))
        if not self._progress.env_steps:
            saver.save(self._agent, self._agent.weights(), 0)
        return saver

    @property
    def last_policy(self) -> Policy:
        """The greedy policy with the final weights of training, selected or not."""
        return self._agent.policy(self._agent.weights())

    def close(self) -> None:
        """Close files and environments, and release the run's lock."""
        self._resources.close()

    def run(self) -> None:
        """Train to the end, select the best checkpoint and write it.

        Raises:
            Interrupted: `should_stop` returned True; the run was saved.
            OSError: something could not be written; the last checkpoint is intact.
        """
        if self._progress.finished and self._folder.best.is_file():
            return
        if not self._progress.trained:
            self._train()
        self._selection.choose(self._on_phase, self._on_episode, self._should_stop)
        self._progress.finished = True
        self._save()

    def _train(self) -> None:
        progress, period = self._progress, self._config.training.checkpoint_seconds
        pace = Pace(
            self._budget,
            episodes=progress.episodes,
            env_steps=progress.env_steps,
            seconds=progress.seconds,
            began=self._began,
        )
        last_saved = time.monotonic()
        self._underway = underway = self._first_episodes()
        for agent_step in self._steps(underway):
            progress.env_steps += agent_step.num_steps * len(agent_step.actions)
            if agent_step.metrics is not None:
                self._record_update(agent_step.metrics)
            self._record_episodes(agent_step, pace)
            if agent_step.ended:
                env_steps = progress.env_steps
                progress.trained = self._budget.done(progress.episodes, env_steps) >= 1
                if env_steps >= progress.next_validation or progress.trained:
                    self._selection.validate(pace.seconds)
            elif underway.steps[0] % STEPS_BETWEEN_LOOKS:
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

    def _steps(self, underway: Underway) -> Iterator[AgentStep]:
        """The steps of training, endless, from the compiled loop or from Python's."""
        if not self._compiled:
            return interact(
                self._agent,
                self._pool,
                self._start_of,
                underway,
                bootstrap_on_time_limit=self._config.learning.bootstrap_on_time_limit,
            )
        pool, config = cast(ExactEnvPool, self._pool), self._config
        if isinstance(self._agent, PQNAgent):
            pqn = CompiledPQN(self._agent, pool, self._streams, config)
            return pqn.interact(self._start_of, underway)
        dqn = CompiledLoop(cast(DQNAgent, self._agent), pool, self._streams, config)
        return dqn.interact(self._start_of, underway)

    def _record_update(self, metrics: Mapping[str, float]) -> None:
        self._history.update(
            metrics,
            updates=int(getattr(self._agent, "updates", 0)),
            env_steps=self._progress.env_steps,
            learning_rate=self._config.learning.learning_rate,
        )

    def _record_episodes(self, agent_step: AgentStep, pace: Pace) -> None:
        """Record the episodes that ended in a step, and report the state of training."""
        progress, history = self._progress, self._history
        env_steps = progress.env_steps
        for episode, outcome in zip(agent_step.ended, self._outcomes(agent_step), strict=True):
            progress.seconds = pace.seconds()
            progress.episodes += 1
            history.episode(
                episode,
                outcome,
                number=progress.episodes,
                env_steps=env_steps,
                epsilon=agent_step.epsilon,
                seconds=progress.seconds,
            )
            if self._keeps_flights:
                start = self._start_of(episode.number)
                row = TrainingFlightRow.of(progress.episodes, start, episode.actions)
                self._recorder.write(self._folder.training_flights, row)
            done, left = pace.done_and_left(progress.episodes, env_steps)
            self._on_status(
                TrainingStatus(
                    episode=progress.episodes,
                    env_steps=env_steps,
                    episode_return=episode.episode_return,
                    recent_return=history.recent_return,
                    epsilon=agent_step.epsilon,
                    loss=history.last_loss,
                    recent_time_limit_share=history.recent_time_limit_share,
                    steps_per_second=pace.steps_per_second(env_steps),
                    share_done=done,
                    seconds_left=left,
                    may_stop_early=self._config.training.stop_when_solved,
                )
            )

    def _outcomes(self, agent_step: AgentStep) -> list[Outcome]:
        result = agent_step.result
        return [
            outcome_of(
                self._config.env_id,
                result.observations[index],
                float(result.rewards[index]),
                terminated=bool(result.terminated[index]),
            )
            for index in np.flatnonzero(result.ended)
        ]

    def _start_of(self, episode: int) -> int:
        return training_start(self._config.seed, episode)

    def _first_episodes(self) -> Underway:
        """The first episode of each environment, or those unfinished at the last checkpoint."""
        saved: list[Episode] = self._progress.underway
        if not saved:
            return begin(self._pool, self._start_of, self._config.training.num_envs)
        where = self._folder.checkpoints
        return replay_episodes(saved, self._pool, self._start_of, where)

    def _save(self) -> None:
        self._progress.records = self._recorder.saved()
        checkpoint.save_checkpoint(
            self._folder.checkpoints,
            self._config.digest,
            self._agent,
            self._streams,
            self._progress,
            self._underway.episodes() if self._underway else [],
        )
