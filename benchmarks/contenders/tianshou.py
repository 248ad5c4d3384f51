"""Tianshou's DQN with the settings of its example for the lander."""

import math

import gymnasium
import numpy as np
import torch
from tianshou.algorithm import DQN
from tianshou.algorithm.modelfree.dqn import DiscreteQLearningPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Batch, Collector, VectorReplayBuffer
from tianshou.env import DummyVectorEnv
from tianshou.trainer import OffPolicyTrainerParams
from tianshou.utils.net.common import Net

from contenders.watch import ENV_ID, Watch
from touchdown.core.seeding import training_start
from touchdown.core.types import FloatArray, IntArray

# examples/box2d/lunarlander_dqn.py of Tianshou, "found by Optuna"; it trains all ten epochs,
# while the example stops at the first of its own tests that counts as solved
ENV_STEPS = 800_000
_EPOCH = 80_000
_NUM_ENVS = 16
_BATCH = 128
_WARM_UP = _BATCH * _NUM_ENVS
_HIDDEN = [128, 128]
_EPSILON_TRAIN, _EPSILON_TEST, _EPSILON_DECAY = 0.73, 0.01, 5e-6


class _Greedy:
    """The greedy policy in its current state."""

    def __init__(self, policy: DiscreteQLearningPolicy) -> None:
        self._policy = policy

    def act(self, observations: FloatArray) -> IntArray:
        """An action for each observation: [N, 8] to [N]."""
        with torch.no_grad():
            return self._policy(Batch(obs=observations, info=Batch())).act


def train(seed: int, env_steps: int, watch: Watch) -> None:
    """Train once."""
    first = training_start(seed, 0)  # outside the seeds of validation and test starts
    np.random.seed(first)  # noqa: NPY002 - the generator that Tianshou explores with
    torch.manual_seed(first)
    envs = DummyVectorEnv([lambda: gymnasium.make(ENV_ID) for _ in range(_NUM_ENVS)])
    envs.seed(first)
    (action_space, *_) = envs.action_space
    policy = DiscreteQLearningPolicy(
        model=Net(
            state_shape=8,
            action_shape=4,
            hidden_sizes=_HIDDEN,
            dueling_param=({"hidden_sizes": _HIDDEN}, {"hidden_sizes": _HIDDEN}),
        ),
        action_space=action_space,
        eps_training=_EPSILON_TRAIN,
        eps_inference=_EPSILON_TEST,
    )
    algorithm = DQN(
        policy=policy,
        optim=AdamOptimizerFactory(lr=0.013),
        gamma=0.99,
        n_step_return_horizon=4,
        target_update_freq=500,  # updates
    )
    collector = Collector(
        algorithm, envs, VectorReplayBuffer(100_000, _NUM_ENVS), exploration_noise=True
    )
    collector.reset()
    collector.collect(n_step=_WARM_UP)
    greedy = _Greedy(policy)

    def step(_epoch: int, flown: int) -> None:
        epsilon = _EPSILON_TRAIN * (1 - _EPSILON_DECAY) ** flown
        policy.set_eps_training(max(epsilon, _EPSILON_TEST))
        watch.step(_WARM_UP + flown, greedy)

    algorithm.run_training(
        OffPolicyTrainerParams(
            training_collector=collector,
            max_epochs=math.ceil(env_steps / _EPOCH),
            epoch_num_steps=min(_EPOCH, env_steps),
            collection_step_num_env_steps=_NUM_ENVS,
            update_step_num_gradient_steps_per_sample=1 / _NUM_ENVS,
            batch_size=_BATCH,
            training_fn=step,
            verbose=False,
            show_progress=False,
        )
    )
    # the trainer restarted its count at zero
    watch.end(_WARM_UP + collector.collect_step, greedy)
