"""A small environment whose optimal policy is known."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from touchdown.core.types import FloatArray


class Chain(gymnasium.Env[Any, Any]):
    """Five states in a row, observed one-hot; action 1 goes right, action 0 left.

    Going right from the last state terminates the episode with a reward of 8. Going left in the
    first state stays there, with a reward of 0.1 as a decoy. The optimal action is 1 in every state
    for a discount from 0.4 to 0.98. An episode starts in the state of the seed modulo five.

    Args:
        limit: steps after which an episode is truncated.
    """

    STATES, GOAL, BAIT = 5, 8.0, 0.1

    def __init__(self, limit: int = 20) -> None:
        self.observation_space = spaces.Box(0.0, 1.0, (self.STATES,), np.float32)
        self.action_space = spaces.Discrete(2)
        self.limit = limit

    @classmethod
    def model(cls, state: int, action: int) -> tuple[float, int | None]:
        """The reward and the next state; None after termination."""
        if action == 1:
            return (0.0, state + 1) if state + 1 < cls.STATES else (cls.GOAL, None)
        return (0.0, state - 1) if state else (cls.BAIT, 0)

    @classmethod
    def see(cls, state: int) -> FloatArray:
        """The observation in a state, [5]."""
        return np.eye(cls.STATES, dtype=np.float32)[state]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start an episode in the state of the seed modulo five."""
        super().reset(seed=seed)
        del options
        first = int(self.np_random.integers(self.STATES)) if seed is None else seed
        self.state, self.steps = first % self.STATES, 0
        return self.see(self.state), {}

    def step(self, action: int) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Go left (0) or right (1)."""
        reward, state = self.model(self.state, action)
        self.steps += 1
        terminated = state is None
        self.state = self.state if state is None else state
        truncated = not terminated and self.steps >= self.limit
        return self.see(self.state), reward, terminated, truncated, {}
