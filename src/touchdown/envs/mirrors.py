"""The mirror symmetry that an environment declares."""

from typing import Any

from touchdown.core.errors import UserError
from touchdown.core.types import Mirror
from touchdown.lander import rules

# of Gymnasium's environments, which cannot declare it themselves
_KNOWN = {
    **dict.fromkeys(rules.LANDER_IDS, rules.MIRROR),
    # positions, angles and velocities change sign
    "CartPole-v1": Mirror((0, 1, 2, 3), (-1.0, -1.0, -1.0, -1.0), (1, 0)),
    # the sines of both angles and their velocities change sign
    "Acrobot-v1": Mirror((0, 1, 2, 3, 4, 5), (1.0, -1.0, 1.0, -1.0, -1.0, -1.0), (2, 1, 0)),
}


def mirror_of(env: Any, env_id: str, observation_size: int, num_actions: int) -> Mirror | None:
    """The symmetry of an environment, from its attribute `mirror` or known by its id; else None.

    Args:
        env: a Gymnasium environment; its attribute is a `Mirror`, or three such sequences.
        env_id: its id.
        observation_size: D.
        num_actions: A.

    Raises:
        UserError: the attribute is no symmetry of these spaces.
    """
    declared = getattr(env.unwrapped, "mirror", None)
    if declared is None:
        return _KNOWN.get(env_id)
    try:
        order, signs, actions = declared
        mirror = Mirror(
            tuple(int(number) for number in order),
            tuple(float(sign) for sign in signs),
            tuple(int(action) for action in actions),
        )
    except (TypeError, ValueError):
        mirror = None
    if mirror is None or not _is_symmetry(mirror, observation_size, num_actions):
        raise UserError(
            f"env_id {env_id!r}: its mirror is {declared!r}, must be the order and signs of "
            f"{observation_size} numbers and the order of {num_actions} actions, whose image of an "
            "image is the transition itself"
        )
    return mirror


def _is_symmetry(mirror: Mirror, observation_size: int, num_actions: int) -> bool:
    order, signs, actions = mirror
    return (
        sorted(order) == list(range(observation_size))
        and sorted(actions) == list(range(num_actions))
        and len(signs) == observation_size
        and all(abs(sign) == 1 for sign in signs)
        and all(order[order[i]] == i and signs[order[i]] == signs[i] for i in order)
        and all(actions[actions[a]] == a for a in actions)
    )
