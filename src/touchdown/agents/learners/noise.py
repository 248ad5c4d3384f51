"""The random keys of noisy weights: functions of the run's seed, a purpose and a count."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import PRNGKeyArray

# Purposes. The numbers are large because JAX folds in small ones when it splits a key, and the
# initial weights' keys are split off the same seed.
UPDATES, NEXT_VALUES, ACTING = 1_000_001, 1_000_002, 1_000_003


class NoiseSource(NamedTuple):
    """Determines samples of noisy weights.

    Plain numbers, as making a key outside of a compiled function is slow. Both are part of
    checkpoints, so a restored agent draws the same noise as an uninterrupted one.
    """

    seed: np.uint32
    number: int | jax.Array
    """How many updates, or environment steps, came before."""

    def key(self, purpose: int) -> PRNGKeyArray:
        """The key of one sample (inside a compiled function)."""
        of_purpose = jax.random.fold_in(jax.random.key(self.seed), purpose)
        return jax.random.fold_in(of_purpose, self.number)


class UpdateKeys(NamedTuple):
    """Keys of the samples of noisy weights in one update; None where weights are not noisy."""

    tm1: PRNGKeyArray | None
    """Of the online network, for Q(s,a)."""
    t: PRNGKeyArray | None
    """Of the network that bootstraps."""
    selection: PRNGKeyArray | None
    """Of the online network, where it selects the next action."""


def update_keys(key: PRNGKeyArray | None) -> UpdateKeys:
    """Three keys from one (inside a compiled function)."""
    return UpdateKeys(*((None,) * 3 if key is None else jax.random.split(key, 3)))
