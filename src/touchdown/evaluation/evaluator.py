"""Greedy rollouts of a policy from many starts."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol

import numpy as np

from touchdown.core.records import Count
from touchdown.core.types import (
    FloatArray,
    IntArray,
    Outcome,
    Policy,
    StepResult,
    actions_of,
)
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.outcome import outcome_of
from touchdown.envs.pool import EnvPool, make_pool
from touchdown.lander import engine as engines
from touchdown.lander import rules

Observer = Callable[[IntArray, FloatArray], object]
"""Called with each observation of a rollout, from the reset to the last step: the positions in
`starts` of the episodes that have one, [K], and their observations, [K, D]."""

NUM_ENVS = 32
"""Environments in a pool, enough to amortise the cost of calling a network."""


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """One episode of an evaluation."""

    seed: Count
    episode_return: float
    steps: Count
    outcome: Outcome
    fuel: float
    """Return points spent on engines; 0 in environments other than the lander."""

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return asdict(self)


class Steps(Protocol):
    """Takes many steps of a pool at once, for the policies that it can."""

    def __call__(
        self, policy: Policy, pool: EnvPool, underway: Underway, flying: IntArray
    ) -> StepResult | None:
        """Step the environments `flying` until an episode ends in one of them, or earlier.

        Returns:
            The last step, after which the pool and `underway` are what single steps would have left
            behind; None, and nothing done, if the policy is for single steps.
        """
        ...


class Evaluator:
    """A pool of environments for rollouts from given starts.

    Args:
        env_id: Gymnasium id.
        num_envs: environments stepped together; results do not depend on it.
        engine: engine that simulates the lander; results are the same to the last bit.
        steps: takes many steps at once where nobody observes them; None takes single ones.

    Raises:
        UserError: there is no such environment, or it cannot be made.
    """

    def __init__(
        self,
        env_id: str,
        num_envs: int = NUM_ENVS,
        engine: engines.Engine = "gymnasium",
        steps: Steps | None = None,
    ) -> None:
        self._steps = steps
        self._env_id = env_id
        self._num_envs = num_envs
        self._pool = make_pool(env_id, num_envs, engine)

    def close(self) -> None:
        """Close the environments."""
        self._pool.close()

    def rollout(
        self,
        policy: Policy,
        starts: Sequence[int],
        on_episode: Callable[[], object] = lambda: None,
        observer: Observer | None = None,
    ) -> list[EpisodeResult]:
        """One episode from each start, results in the order of the starts.

        Args:
            policy: chooses the actions, each from its own observation, start and step only.
            starts: environment seeds.
            on_episode: called after each episode.
            observer: called with the first observation of each episode, then after each step.
        """
        results: dict[int, EpisodeResult] = {}
        seeds = np.array(starts)
        waiting = iter(enumerate(starts))
        first = [
            Episode(index, self._pool.reset(index, seed))
            for index, (index, seed) in zip(range(self._num_envs), waiting, strict=False)
        ]
        if not first:
            return []
        underway = Underway(first)
        if observer is not None:
            observer(underway.numbers, underway.observations)
        flying = np.arange(len(first))
        while len(flying):
            result = None
            if self._steps is not None and observer is None:
                result = self._steps(policy, self._pool, underway, flying)
            if result is None:
                result = self._step(policy, seeds, underway, flying)
            if observer is not None:
                observer(underway.numbers[flying], result.observations)
            over = np.flatnonzero(result.ended).tolist()
            done = np.zeros(len(flying), bool)
            for row in over:
                index = int(flying[row])
                episode = underway.episode(index)
                results[episode.number] = self._result(episode, starts[episode.number], result, row)
                on_episode()
                following = next(waiting, None)
                if following is None:
                    done[row] = True
                else:
                    observation = self._pool.reset(index, following[1])
                    underway.begin(index, following[0], observation)
                    if observer is not None:
                        observer(np.array([following[0]]), observation[None])
            if over:
                flying = flying[~done]
        return [results[index] for index in range(len(starts))]

    def _step(
        self, policy: Policy, seeds: IntArray, underway: Underway, flying: IntArray
    ) -> StepResult:
        """One step of the environments `flying`."""
        actions = actions_of(
            policy,
            underway.observations[flying],
            seeds[underway.numbers[flying]],
            underway.steps[flying],
        )
        result = self._pool.step(flying, actions)
        underway.add(flying, actions, result)
        return result

    def _result(self, episode: Episode, seed: int, last: StepResult, row: int) -> EpisodeResult:
        """The result of an episode that ended in row `row` of the last step."""
        ended_as = outcome_of(
            self._env_id,
            episode.observation,
            float(last.rewards[row]),
            terminated=bool(last.terminated[row]),
        )
        fuel = 0.0
        if rules.is_lander(self._env_id):
            fuel = rules.fuel_of(np.asarray(episode.actions))
        return EpisodeResult(seed, episode.episode_return, len(episode.actions), ended_as, fuel)
