"""The arrays of Python's objects, as the compiled loops take them."""

from typing import TYPE_CHECKING

from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool

if TYPE_CHECKING:
    from touchdown.training import _train


def pool_arrays(pool: ExactEnvPool) -> "_train.PoolArrays":
    """The arrays of the environments' latest step, which the loops write to."""
    from touchdown.training import _train  # noqa: PLC0415 - if it was built

    return _train.PoolArrays(
        pool.actions, pool.observations, pool.rewards, pool.terminated, pool.steps
    )


def episode_arrays(underway: Underway) -> "_train.EpisodeArrays":
    """The arrays of the current episodes, which the loops write to."""
    from touchdown.training import _train  # noqa: PLC0415 - if it was built

    return _train.EpisodeArrays(
        underway.observations, underway.returns, underway.steps, underway.actions
    )
