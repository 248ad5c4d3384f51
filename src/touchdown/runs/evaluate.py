"""Flying a pilot greedily from many starts."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from touchdown.lander import env as lander
from touchdown.types import Outcome, Pilot

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
    """Environments kept ready to fly many starts.

    Args:
        env_id: Gymnasium's id.
        slots: environments flown side by side; no result depends on it.
    """

    def __init__(self, env_id: str, slots: int = SLOTS) -> None:
        self._env_id = env_id
        self._worlds = [lander.make(env_id) for _ in range(slots)]

    def close(self) -> None:
        """Give the environments back."""
        for world in self._worlds:
            world.env.close()

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
        flying: list[_Slot] = []
        for world in self._worlds:
            slot = _Slot(world.env)
            if slot.begin(waiting):
                flying.append(slot)
        while flying:
            actions = pilot.act(np.stack([slot.observation for slot in flying]))
            landed_any = False
            for slot, action in zip(flying, actions.tolist(), strict=True):
                if slot.step(action):
                    results[slot.index] = slot.result(self._env_id)
                    on_episode()
                    slot.busy = slot.begin(waiting)
                    landed_any |= not slot.busy
            if landed_any:
                flying = [slot for slot in flying if slot.busy]
        return [results[index] for index in range(len(starts))]


class _Slot:
    """One environment of a fleet and the episode that it flies."""

    def __init__(self, env: lander.Env) -> None:
        self._env = env
        self.busy = True

    def begin(self, waiting: Iterator[tuple[int, int]]) -> bool:
        """Reset to the next start; False when none is left."""
        for self.index, self._seed in waiting:
            self.observation, _ = self._env.reset(seed=self._seed)
            self._actions: list[int] = []
            self._return = 0.0
            return True
        return False

    def step(self, action: int) -> bool:
        """One step; True when the episode has ended."""
        self.observation, reward, terminated, truncated, _ = self._env.step(action)
        self._actions.append(action)
        self._return += float(reward)
        self._last_reward, self._terminated = float(reward), bool(terminated)
        return bool(terminated or truncated)

    def result(self, env_id: str) -> EpisodeResult:
        """The episode that has just ended."""
        outcome = lander.outcome_of(
            env_id, self.observation, self._last_reward, terminated=self._terminated
        )
        fuel = lander.fuel_of(np.asarray(self._actions)) if lander.is_lander(env_id) else 0.0
        return EpisodeResult(self._seed, self._return, len(self._actions), outcome, fuel)
