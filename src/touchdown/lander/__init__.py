"""The world: stock Gymnasium and the exact engine, flights recorded from them, and their pictures.

Importing it registers `touchdown/LunarLander-v3` and `touchdown/LunarLanderContinuous-v3` with
Gymnasium: the exact engine's.
"""

import gymnasium

from touchdown.lander.factory import make, make_vec

__all__ = ["make", "make_vec"]

for _name, _settings in {
    "LunarLander-v3": {},
    "LunarLanderContinuous-v3": {"continuous": True},
}.items():
    gymnasium.register(
        id=f"touchdown/{_name}",
        entry_point="touchdown.lander.single:LanderEnv",
        vector_entry_point="touchdown.lander.vector:LanderVectorEnv",
        max_episode_steps=1_000,
        reward_threshold=200,
        kwargs=_settings,
    )
