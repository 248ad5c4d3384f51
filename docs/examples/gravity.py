"""The lander with weaker gravity, registered under an id of its own."""

from typing import Any

import gymnasium
from gymnasium.envs.registration import register

register(
    "LunarGravity-v0",
    entry_point="gravity:make_lander",
    max_episode_steps=1_000,
    reward_threshold=200.0,
)


def make_lander(gravity: float = -4.0, render_mode: str | None = None) -> gymnasium.Env[Any, Any]:
    """Gymnasium's lander with another gravity.

    Args:
        gravity: from -12 to 0; the stock lander has -10.
        render_mode: Gymnasium's.
    """
    return gymnasium.make("LunarLander-v3", gravity=gravity, render_mode=render_mode)
