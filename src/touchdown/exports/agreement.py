"""Checks that an exported model acts like its policy, on observations from flights."""

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from touchdown.core.errors import UserError, one_line
from touchdown.core.starts import TRAINING_STARTS
from touchdown.core.types import ValuePolicy
from touchdown.envs import environment
from touchdown.envs.pool import make_pool
from touchdown.lander import engine as engines
from touchdown.policies.foreign.onnx_session import Session

OBSERVATIONS = 10_000
ROUNDING = 1e-5
"""Largest difference that counts as rounding, as a fraction of the largest |Q|: about 100 float32
steps, ten times the differences measured for the networks of the presets."""
_NUM_ENVS = 16  # few enough that episodes end in all of them
_RANDOM_SHARE = 0.25  # of the actions, to visit states that the policy avoids


@dataclass(frozen=True, slots=True)
class Agreement:
    """The result of a comparison that found no difference beyond rounding."""

    observations: int
    """Observations compared."""
    tolerance: float
    """Largest difference that counts as rounding, in units of Q."""
    largest_difference: float
    """Largest difference between two values, in units of Q."""
    close: int
    """Observations whose two best actions have values within the tolerance of each other."""
    differing: int
    """Number of those observations where model and policy take different actions."""

    def __str__(self) -> str:
        """A sentence that starts with the number of actions that agree."""
        agreeing = self.observations - self.differing
        rest = "; in the rest, the two best values are equal up to rounding"
        return (
            f"{agreeing:,} of {self.observations:,} actions agree with touchdown's"
            f"{rest if self.differing else ''}"
        )


def seen_in_flight(policy: ValuePolicy, env_id: str, seed: int = 0) -> NDArray[np.float32]:
    """Observations from flights from training starts.

    Args:
        policy: chooses three of every four actions; the fourth is random.
        env_id: the environment.
        seed: seed of the random actions.

    Returns:
        `OBSERVATIONS` observations, [N, D].

    Raises:
        UserError: there is no such environment.
    """
    spaces = environment.spaces_of(env_id)
    rng, starts = np.random.default_rng(seed), count(TRAINING_STARTS.start)
    pool = make_pool(env_id, _NUM_ENVS, engines.engine_in_use())
    try:
        current = np.stack([pool.reset(index, next(starts)) for index in range(_NUM_ENVS)])
        seen: list[NDArray[np.float32]] = []
        while len(seen) * _NUM_ENVS < OBSERVATIONS:
            seen.append(current.astype(np.float32))
            greedy = policy.act(seen[-1])
            random = rng.integers(spaces.num_actions, size=_NUM_ENVS)
            actions = np.where(rng.random(_NUM_ENVS) < _RANDOM_SHARE, random, greedy)
            steps = pool.step(np.arange(_NUM_ENVS), actions)
            current = steps.observations.copy()
            for index in np.flatnonzero(steps.ended).tolist():
                current[index] = pool.reset(index, next(starts))
    finally:
        pool.close()
    return np.concatenate(seen)[:OBSERVATIONS]


def check(
    model: Session,
    policy: ValuePolicy,
    observations: NDArray[np.float32],
    largest_term: float = 0.0,
) -> Agreement:
    """Compare the `q_values` and `action` of a model with those of its policy.

    Actions must be equal wherever the two best values differ by more than rounding.

    Args:
        model: a model from `graph.onnx_model`.
        policy: the policy that the model was exported from.
        observations: [N, D].
        largest_term: largest term in the sums that give the values, if it may exceed the values:
            with atoms, the largest return of the support.

    Raises:
        UserError: they differ by more than rounding, or the policy's values are not finite.
    """
    try:
        q_values, actions = model.run(observations, ["q_values", "action"])
    except ValueError as error:
        raise UserError(f"format 'onnx': {one_line(error)}") from None
    expected = policy.values(observations)
    if not np.isfinite(expected).all():
        raise UserError(
            "format 'onnx': the policy's values are not finite, so it cannot be exported"
        )
    tolerance = ROUNDING * max(largest_term, float(np.abs(expected).max()))
    difference = float(np.abs(q_values - expected).max())
    close = np.ptp(np.sort(expected, axis=1)[:, -2:], axis=1) <= tolerance
    differing = actions != policy.act(observations)
    wrong = int(np.count_nonzero(differing & ~close))
    if wrong or not difference <= tolerance:
        raise UserError(
            f"format 'onnx': {wrong} of {len(observations)} actions differ from touchdown's, and "
            f"values differ by up to {difference:.3g}, must be at most {tolerance:.3g}; nothing is "
            "written, because this export would act differently; please report it"
        )
    return Agreement(
        observations=len(observations),
        tolerance=tolerance,
        largest_difference=difference,
        close=int(np.count_nonzero(close)),
        differing=int(np.count_nonzero(differing)),
    )
