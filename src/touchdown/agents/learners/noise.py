"""Random keys of noisy weights, determined by the run's seed, a purpose and a count.

csrc/fused/noise.cpp draws the same numbers for the fused kernel.
"""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import PRNGKeyArray


class NoiseSource(NamedTuple):
    """Determines samples of noisy weights.

    These are plain numbers, because creating a key outside a compiled function is slow. Both are
    part of checkpoints, so a restored agent draws the same noise as an uninterrupted one.
    """

    seed: np.uint32
    number: int | jax.Array
    """Number of previous updates or environment steps."""

    def key(self, purpose: int) -> PRNGKeyArray:
        """The key of one sample (inside a compiled function)."""
        of_purpose = jax.random.fold_in(jax.random.key(self.seed), purpose)
        return jax.random.fold_in(of_purpose, self.number)


class UpdateKeys(NamedTuple):
    """Keys of the samples of noisy weights in one update; None where weights are not noisy."""

    tm1: PRNGKeyArray | None
    """For Q(s,a) of the online network."""
    t: PRNGKeyArray | None
    """For the network that bootstraps."""
    selection: PRNGKeyArray | None
    """For the online network when it selects the next action."""


def update_keys(key: PRNGKeyArray | None) -> UpdateKeys:
    """Three keys from one (inside a compiled function)."""
    return UpdateKeys(*((None,) * 3 if key is None else jax.random.split(key, 3)))
