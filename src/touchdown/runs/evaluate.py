"""Flying a pilot greedily from many starts."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.lander import env as lander
from touchdown.lander.slots import make_slots
from touchdown.types import FloatArray, Outcome, Pilot

SLOTS = 32  # environments flown side by side: enough to share the cost of a network's call


@dataclass(frozen=True, slots=True)
class EpisodeResult:
    """One episode of an evaluation."""

    seed: int
    episode_return: float
    steps: int
    outcome: Outcome
    fuel: float
    """Return points spent on engines; 0 in worlds that are not the lander's."""

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return asdict(self)


class Fleet:
    """Worlds kept ready to fly many starts.

    Args:
        env_id: Gymnasium's id.
        slots: worlds flown side by side; no result depends on it.
        engine: what flies the lander; results are the same to the last bit.
    """

    def __init__(
        self, env_id: str, slots: int = SLOTS, engine: lander.Engine = "gymnasium"
    ) -> None:
        self._env_id = env_id
        self._count = slots
        self._slots = make_slots(env_id, slots, engine)

    def close(self) -> None:
        """Give the worlds back."""
        self._slots.close()

    def fly(
        self,
        pilot: Pilot,
        starts: Sequence[int],
        on_episode: Callable[[], object] = lambda: None,
    ) -> list[EpisodeResult]:
        """One episode from each start, results in the order of the starts.

        Args:
            pilot: chooses the actions; it must not depend on who else flies beside.
            starts: environment seeds.
            on_episode: called after each episode.
        """
        results: dict[int, EpisodeResult] = {}
        waiting = iter(enumerate(starts))
        flying: list[_Episode] = []
        for slot, (index, seed) in zip(range(self._count), waiting, strict=False):
            flying.append(_Episode(slot, index, seed, self._slots.reset(slot, seed)))
        while flying:
            actions = pilot.act(np.stack([episode.observation for episode in flying]))
            steps = self._slots.step([episode.slot for episode in flying], actions)
            still: list[_Episode] = []
            for episode, action, observation, reward, terminated, truncated in zip(
                flying, actions.tolist(), steps.observations, *map(_listed, steps[1:]), strict=True
            ):
                episode.add(action, observation, reward)
                if not (terminated or truncated):
                    still.append(episode)
                    continue
                results[episode.index] = episode.result(self._env_id, terminated=terminated)
                on_episode()
                for index, seed in waiting:
                    first = self._slots.reset(episode.slot, seed)
                    still.append(_Episode(episode.slot, index, seed, first))
                    break
            flying = still
        return [results[index] for index in range(len(starts))]


def _listed(values: NDArray[Any]) -> list[Any]:
    return values.tolist()


class _Episode:
    """One episode under way, in one slot of a fleet."""

    def __init__(self, slot: int, index: int, seed: int, observation: FloatArray) -> None:
        self.slot = slot
        self.index = index
        self.observation = observation
        self._seed = seed
        self._actions: list[int] = []
        self._return = 0.0
        self._last_reward = 0.0

    def add(self, action: int, observation: FloatArray, reward: float) -> None:
        """One step."""
        self.observation = observation
        self._actions.append(action)
        self._return += reward
        self._last_reward = reward

    def result(self, env_id: str, *, terminated: bool) -> EpisodeResult:
        """The episode, which has just ended."""
        outcome = lander.outcome_of(
            env_id, self.observation, self._last_reward, terminated=terminated
        )
        fuel = lander.fuel_of(np.asarray(self._actions)) if lander.is_lander(env_id) else 0.0
        return EpisodeResult(self._seed, self._return, len(self._actions), outcome, fuel)
