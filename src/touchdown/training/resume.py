"""Restores the unfinished episodes of a checkpoint."""

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
    """Repeat the recorded actions of each saved episode; environments are deterministic.

    Args:
        saved: the unfinished episode of each environment in the checkpoint.
        pool: the environments.
        start_of: the environment seed of an episode, by its number.
        where: folder of the checkpoints, named in error messages.

    Raises:
        UserError: an episode does not end at the same observation.
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
            f"{where}: the unfinished episode cannot be repeated exactly: another machine or "
            "version, or an environment that is not deterministic"
        )
    return episode
