"""Whether an exported model does what the policy does, on observations that flights come by."""

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from touchdown.core.errors import UserError
from touchdown.core.seeding import TRAINING_STARTS
from touchdown.core.types import ValuePolicy
from touchdown.envs import environment
from touchdown.envs.pool import make_pool
from touchdown.lander import engine as engines
from touchdown.policies.foreign.onnx import OnnxModel

OBSERVATIONS = 10_000
ROUNDING = 1e-5
"""What sums in another order may differ by, as a share of the largest |Q|: some 100 steps of
float32, ten times what the networks of the presets were seen to differ by."""
_WORLDS = 16  # side by side: few enough that all come to their flights' ends
_RANDOM_SHARE = 0.25  # of actions, so that places are seen that the policy alone avoids


@dataclass(frozen=True, slots=True)
class Agreement:
    """What a comparison found: where it found a difference that matters, it raised instead."""

    observations: int
    """Compared."""
    tolerance: float
    """Rounding, in units of Q: no value differs by more."""
    largest_difference: float
    """Between two values, in units of Q."""
    close: int
    """Observations whose two best actions are within the tolerance of each other."""
    differing: int
    """Of these, observations where the two take another of the two."""

    def __str__(self) -> str:
        """In words, from the count of actions that agree on."""
        agreeing = self.observations - self.differing
        return (
            f"{agreeing:,} of {self.observations:,} actions agree with touchdown's "
            f"({self.differing} differ, of {self.close} whose two best values are within rounding, "
            f"{self.tolerance:.2g}, of each other)"
        )


def seen_in_flight(policy: ValuePolicy, env_id: str, seed: int = 0) -> NDArray[np.float32]:
    """Observations of the sort that occurs, from training starts.

    Args:
        policy: chooses three actions of four; the fourth is random.
        env_id: the world.
        seed: of the random actions.

    Returns:
        `OBSERVATIONS` of them, [N, D].

    Raises:
        UserError: there is no such world.
    """
    spaces = environment.spaces_of(env_id)
    rng, starts = np.random.default_rng(seed), count(TRAINING_STARTS.start)
    indices = make_pool(env_id, _WORLDS, engines.engine_in_use())
    try:
        now = np.stack([indices.reset(index, next(starts)) for index in range(_WORLDS)])
        seen: list[NDArray[np.float32]] = []
        while len(seen) * _WORLDS < OBSERVATIONS:
            seen.append(now.astype(np.float32))
            greedy = policy.act(seen[-1])
            chance = rng.integers(spaces.num_actions, size=_WORLDS)
            actions = np.where(rng.random(_WORLDS) < _RANDOM_SHARE, chance, greedy)
            steps = indices.step(np.arange(_WORLDS), actions)
            now = steps.observations.copy()
            for index in np.flatnonzero(steps.ended).tolist():
                now[index] = indices.reset(index, next(starts))
    finally:
        indices.close()
    return np.concatenate(seen)[:OBSERVATIONS]


def check(
    model: OnnxModel,
    policy: ValuePolicy,
    observations: NDArray[np.float32],
    largest_term: float = 0.0,
) -> Agreement:
    """Compare a model's `q_values` and `action` with the policy's.

    Actions must be the same wherever the two best values are further apart than rounding.

    Args:
        model: of `graph.onnx_model`.
        policy: that it was made of.
        observations: [N, D].
        largest_term: of what values are summed up from, where it may be larger than they are: the
            returns that atoms stand for.

    Raises:
        UserError: they differ by more than rounding, or the policy's values are not finite.
    """
    q_values, actions = model.run(observations, ["q_values", "action"])
    expected = policy.values(observations)
    if not np.isfinite(expected).all():
        raise UserError(
            "format 'onnx': the policy's values are not finite, so there is none to fly"
        )
    tolerance = ROUNDING * max(largest_term, float(np.abs(expected).max()))
    difference = float(np.abs(q_values - expected).max())
    close = np.ptp(np.sort(expected, axis=1)[:, -2:], axis=1) <= tolerance
    differing = actions != policy.act(observations)
    wrong = int(np.count_nonzero(differing & ~close))
    if wrong or not difference <= tolerance:
        raise UserError(
            f"format 'onnx': {wrong} of {len(observations)} actions differ from touchdown's, and "
            f"values by up to {difference:.3g}, where rounding is {tolerance:.3g}; nothing is "
            "written, for this export would fly otherwise; please report it"
        )
    return Agreement(
        observations=len(observations),
        tolerance=tolerance,
        largest_difference=difference,
        close=int(np.count_nonzero(close)),
        differing=int(np.count_nonzero(differing)),
    )
