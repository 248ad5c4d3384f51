"""SBX's DQN (Stable-Baselines3 in JAX) with RL Zoo's settings for the lander."""

import numpy as np
from sbx import DQN

from contenders import sb3
from contenders.watch import Watch
from touchdown.core.types import FloatArray, IntArray

ENV_STEPS = sb3.ENV_STEPS

_ROWS = 100


class _Padded(sb3.Greedy):
    """Always requests the same number of actions, because JAX compiles again for each number."""

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, 8] to [N]."""
        missing = max(0, _ROWS - len(observations))
        padded = np.pad(observations, ((0, missing), (0, 0)))
        return super().act(padded)[: len(observations)]


def train(seed: int, env_steps: int, watch: Watch) -> None:
    """Train once."""
    sb3.learn(DQN, _Padded, seed, env_steps, watch)
