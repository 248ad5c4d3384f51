"""Whether an exported model does what the pilot does, on observations that flights come by."""

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from touchdown.errors import UserError
from touchdown.foreign.onnx_pilot import OnnxModel
from touchdown.lander import env as lander
from touchdown.lander.slots import make_slots
from touchdown.seeding import TRAINING_STARTS
from touchdown.types import ValuePilot

OBSERVATIONS = 10_000
ROUNDING = 1e-5
"""What sums in another order may differ by, as a share of the largest |Q|: some 100 steps of
float32, ten times what the networks of the presets were seen to differ by."""
_WORLDS = 16  # side by side: few enough that all come to their flights' ends
_RANDOM_SHARE = 0.25  # of actions, so that places are seen that the pilot alone avoids


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


def seen_in_flight(pilot: ValuePilot, env_id: str, seed: int = 0) -> NDArray[np.float32]:
    """Observations of the sort that occurs, from training starts.

    Args:
        pilot: chooses three actions of four; the fourth is random.
        env_id: the world.
        seed: of the random actions.

    Returns:
        `OBSERVATIONS` of them, [N, D].

    Raises:
        UserError: there is no such world.
    """
    world = lander.make(env_id)
    world.env.close()
    rng, starts = np.random.default_rng(seed), count(TRAINING_STARTS.start)
    slots = make_slots(env_id, _WORLDS, lander.engine_in_use())
    try:
        now = np.stack([slots.reset(slot, next(starts)) for slot in range(_WORLDS)])
        seen: list[NDArray[np.float32]] = []
        while len(seen) * _WORLDS < OBSERVATIONS:
            seen.append(now.astype(np.float32))
            greedy = pilot.act(seen[-1])
            chance = rng.integers(world.spaces.num_actions, size=_WORLDS)
            actions = np.where(rng.random(_WORLDS) < _RANDOM_SHARE, chance, greedy)
            steps = slots.step(np.arange(_WORLDS), actions)
            now = steps.observations.copy()
            for slot in np.flatnonzero(steps.ended).tolist():
                now[slot] = slots.reset(slot, next(starts))
    finally:
        slots.close()
    return np.concatenate(seen)[:OBSERVATIONS]


def check(
    model: OnnxModel,
    pilot: ValuePilot,
    observations: NDArray[np.float32],
    largest_term: float = 0.0,
) -> Agreement:
    """Compare a model's `q_values` and `action` with the pilot's.

    Actions must be the same wherever the two best values are further apart than rounding.

    Args:
        model: of `graph.onnx_model`.
        pilot: that it was made of.
        observations: [N, D].
        largest_term: of what values are summed up from, where it may be larger than they are: the
            returns that atoms stand for.

    Raises:
        UserError: they differ by more than rounding, or the pilot's values are not finite.
    """
    q_values, actions = model.run(observations, ["q_values", "action"])
    expected = pilot.values(observations)
    if not np.isfinite(expected).all():
        raise UserError("format 'onnx': the pilot's values are not finite, so there is none to fly")
    tolerance = ROUNDING * max(largest_term, float(np.abs(expected).max()))
    difference = float(np.abs(q_values - expected).max())
    close = np.ptp(np.sort(expected, axis=1)[:, -2:], axis=1) <= tolerance
    differing = actions != pilot.act(observations)
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
