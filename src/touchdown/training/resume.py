"""Bringing the episodes that were under way at a checkpoint back to where they were."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from touchdown.core.errors import UserError
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import EnvPool


def replay_episodes(
    saved: Sequence[Episode],
    pool: EnvPool,
    start_of: Callable[[int], int],
    where: Path,
) -> Underway:
    """Fly each saved episode again by the actions it took: the environment is deterministic.

    Args:
        saved: the episode in each environment, as the checkpoint has it.
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        where: the checkpoints lie, named in errors.

    Raises:
        UserError: an episode does not come to the same observation.
    """
    return Underway(
        [
            _replayed(index, episode, pool, start_of(episode.number), where)
            for index, episode in enumerate(saved)
        ]
    )


def _replayed(index: int, saved: Episode, pool: EnvPool, seed: int, where: Path) -> Episode:
    episode = Episode(saved.number, pool.reset(index, seed))
    for action in saved.actions:
        result = pool.step(np.array([index]), np.array([action]))
        if result.ended[0]:
            break
        episode.observation = result.observations[0]
        episode.actions.append(action)
        episode.episode_return += float(result.rewards[0])
    same = np.asarray(episode.observation, np.float32).tobytes() == saved.observation.tobytes()
    if saved.actions and not same:
        raise UserError(
            f"{where}: saved in mid-episode, and flying it again does not come to the same place: "
            "another machine or version, or an environment that is not deterministic"
        )
    return episode
