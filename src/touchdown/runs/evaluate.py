"""Flying a pilot greedily from many starts."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from touchdown.lander import env as lander
from touchdown.lander.slots import make_slots
from touchdown.runs.loop import Episode, Underway
from touchdown.types import Outcome, Pilot, Steps

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
        first = [
            Episode(index, self._slots.reset(slot, seed))
            for slot, (index, seed) in zip(range(self._count), waiting, strict=False)
        ]
        if not first:
            return []
        underway = Underway(first)
        flying = np.arange(len(first))
        while len(flying):
            actions = pilot.act(underway.observations[flying])
            steps = self._slots.step(flying, actions)
            underway.add(flying, actions, steps)
            over = np.flatnonzero(steps.ended).tolist()
            rests = np.zeros(len(flying), bool)
            for row in over:
                slot = int(flying[row])
                episode = underway.episode(slot)
                results[episode.number] = self._result(episode, starts[episode.number], steps, row)
                on_episode()
                following = next(waiting, None)
                if following is None:
                    rests[row] = True
                else:
                    underway.begin(slot, following[0], self._slots.reset(slot, following[1]))
            if over:
                flying = flying[~rests]
        return [results[index] for index in range(len(starts))]

    def _result(self, episode: Episode, seed: int, steps: Steps, row: int) -> EpisodeResult:
        """Of an episode that has just ended, with the step of all that fly in which it did."""
        outcome = lander.outcome_of(
            self._env_id,
            episode.observation,
            float(steps.rewards[row]),
            terminated=bool(steps.terminated[row]),
        )
        fuel = 0.0
        if lander.is_lander(self._env_id):
            fuel = lander.fuel_of(np.asarray(episode.actions))
        return EpisodeResult(seed, episode.episode_return, len(episode.actions), outcome, fuel)
