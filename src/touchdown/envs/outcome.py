"""The outcome of an episode."""

from touchdown.core.types import FloatArray, Outcome
from touchdown.lander.rules import is_lander


def outcome_of(env_id: str, observation: FloatArray, reward: float, *, terminated: bool) -> Outcome:
    """How an episode ended, from its last step.

    The lander's last reward is exactly +100 if it came to rest, and -100 if it crashed or flew out
    of bounds.
    """
    if not terminated:
        return "timed out"
    if not is_lander(env_id):
        return "terminated"
    if reward == 100:
        return "landed"
    return "out of bounds" if abs(float(observation[0])) >= 1 else "crashed"
