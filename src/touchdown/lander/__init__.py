"""The lunar lander on the exact engine, behind Gymnasium's interfaces.

Importing this package registers `touchdown/LunarLander-v3`, `touchdown/LunarLanderContinuous-v3`
and the variants in `rules.VARIANTS` with Gymnasium. All run on the exact engine.
"""

import gymnasium

from touchdown.lander.factory import make, make_vec
from touchdown.lander.rules import EXACT_ID, MAX_EPISODE_STEPS, SOLVED_RETURN, VARIANTS

__all__ = ["make", "make_vec"]

for _id, _settings in {
    EXACT_ID: {},
    "touchdown/LunarLanderContinuous-v3": {"continuous": True},
    **VARIANTS,
}.items():
    gymnasium.register(
        id=_id,
        entry_point="touchdown.lander.single:LanderEnv",
        vector_entry_point="touchdown.lander.vector:LanderVectorEnv",
        max_episode_steps=MAX_EPISODE_STEPS,
        reward_threshold=SOLVED_RETURN,
        kwargs=dict(_settings),
    )
