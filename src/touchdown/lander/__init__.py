"""The lunar lander on the exact engine, behind Gymnasium's interfaces.

Importing this package registers `touchdown/LunarLander-v3` and
`touchdown/LunarLanderContinuous-v3` with Gymnasium. Both run on the exact engine.
"""

import gymnasium

from touchdown.lander.factory import make, make_vec
from touchdown.lander.rules import MAX_EPISODE_STEPS, SOLVED_RETURN

__all__ = ["make", "make_vec"]

for _name, _settings in {
    "LunarLander-v3": {},
    "LunarLanderContinuous-v3": {"continuous": True},
}.items():
    gymnasium.register(
        id=f"touchdown/{_name}",
        entry_point="touchdown.lander.single:LanderEnv",
        vector_entry_point="touchdown.lander.vector:LanderVectorEnv",
        max_episode_steps=MAX_EPISODE_STEPS,
        reward_threshold=SOLVED_RETURN,
        kwargs=_settings,
    )
