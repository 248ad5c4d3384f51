"""Stable-Baselines3's DQN with RL Zoo's settings for the lander."""

from typing import Any

import gymnasium
from stable_baselines3 import DQN
from stable_baselines3.common.callbacks import BaseCallback

from contenders.watch import ENV_ID, Watch
from touchdown.core.seeding import training_start
from touchdown.core.types import FloatArray, IntArray

ENV_STEPS = 100_000
# `LunarLander-v3` in RL Zoo's hyperparams/dqn.yml (rl-zoo3 2.9.2), marked as tuned
ZOO: dict[str, Any] = {
    "learning_rate": 6.3e-4,
    "batch_size": 128,
    "buffer_size": 50_000,
    "learning_starts": 0,
    "gamma": 0.99,
    "target_update_interval": 250,
    "train_freq": 4,
    "gradient_steps": -1,  # one per environment step
    "exploration_fraction": 0.12,
    "exploration_final_eps": 0.1,
    "policy_kwargs": {"net_arch": [256, 256]},
}


class Greedy:
    """The greedy policy of a model in its current state.

    Args:
        model: a Stable-Baselines3 model, or one with its interface.
    """

    def __init__(self, model: Any) -> None:
        self._model = model

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, 8] to [N]."""
        return self._model.predict(observations, deterministic=True)[0]


class _Steps(BaseCallback):
    """Notifies the watch of every step."""

    def __init__(self, watch: Watch, policy: Greedy) -> None:
        super().__init__()
        self._watch = watch
        self._policy = policy

    def _on_step(self) -> bool:
        self._watch.step(self.num_timesteps, self._policy)
        return True


def learn(algorithm: Any, greedy: type[Greedy], seed: int, env_steps: int, watch: Watch) -> None:
    """Train an algorithm that has Stable-Baselines3's interface.

    Args:
        algorithm: class of the algorithm.
        greedy: makes the policy of a model.
        seed: training seed.
        env_steps: environment steps of training.
        watch: evaluates it during training.
    """
    model = algorithm(
        "MlpPolicy",
        gymnasium.make(ENV_ID),
        **ZOO,
        # outside the seeds of validation and test starts
        seed=training_start(seed, 0),
        device="cpu",
    )
    policy = greedy(model)
    model.learn(env_steps, callback=_Steps(watch, policy))
    watch.end(model.num_timesteps, policy)


def train(seed: int, env_steps: int, watch: Watch) -> None:
    """Train once."""
    learn(DQN, Greedy, seed, env_steps, watch)
