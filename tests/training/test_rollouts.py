from typing import Any

import numpy as np
import pytest

from touchdown.agents.initial import initial_params
from touchdown.agents.learners.fused_network import FusedNetwork
from touchdown.config.sections import NetworkConfig
from touchdown.core.errors import UserError
from touchdown.core.types import Policy
from touchdown.envs.episodes import Episode, Underway
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.evaluation.evaluator import Evaluator
from touchdown.policies import lookup
from touchdown.training.rollouts import CompiledSteps

_train = pytest.importorskip("touchdown.training._train")
Perceptron = pytest.importorskip("touchdown.agents.learners._fused").Perceptron

LANDER = "LunarLander-v3"
NETWORKS = {
    "plain": NetworkConfig(hidden_sizes=(33, 17)),
    "normalised and dueling": NetworkConfig(hidden_sizes=(16,), layer_norm=True, dueling=True),
    "quantiles": NetworkConfig(hidden_sizes=(9,), quantiles=5),
    "atoms": NetworkConfig(hidden_sizes=(9,), atoms=11),
    "noisy": NetworkConfig(hidden_sizes=(9,), noisy=True, layer_norm=True),
}


class Counted(CompiledSteps):
    """Counts the calls that took steps."""

    calls = 0

    def __call__(self, *arguments: Any) -> Any:
        result = super().__call__(*arguments)
        self.calls += result is not None
        return result


def fresh(config: NetworkConfig) -> Policy:
    network = FusedNetwork(8, 4, config)
    return network.policy(initial_params(network.layout, 5))


def rollout(policy: Policy, steps: CompiledSteps | None, num_envs: int = 7) -> list[Any]:
    evaluator = Evaluator(LANDER, num_envs, "exact", steps)
    return evaluator.rollout(policy, range(20))


@pytest.mark.parametrize("num_envs", [1, 7, 30])
@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS)
def test_compiled_rollouts_are_those_of_the_python_loop(config, num_envs):
    policy, compiled = fresh(config), Counted()
    assert rollout(policy, compiled, num_envs) == rollout(policy, None)
    assert compiled.calls


def test_a_trained_policy_takes_many_steps_in_a_call():
    policy, compiled = lookup.load("ace").policy, Counted()
    found = rollout(policy, compiled)
    assert found == rollout(policy, None)
    # far fewer calls than steps
    assert sum(result.steps for result in found) > 10 * compiled.calls > 0


def test_a_policy_without_a_fused_network_flies_in_single_steps():
    policy, compiled = lookup.load("pid").policy, Counted()
    assert rollout(policy, compiled) == rollout(policy, None)
    assert not compiled.calls


def test_values_that_are_not_finite_are_refused_as_in_single_steps():
    network = FusedNetwork(8, 4, NETWORKS["plain"])
    params = initial_params(network.layout, 0)
    params[-1] = np.nan
    with pytest.raises(UserError, match="the policy's values are not finite for the observation"):
        rollout(network.policy(params), CompiledSteps())


class Arguments:
    """Arguments of `Rollout.advance` for two environments."""

    def __init__(self) -> None:
        pool = make_pool(LANDER, 2, "exact")
        assert isinstance(pool, ExactEnvPool)
        underway = Underway([Episode(i, pool.reset(i, i)) for i in range(2)])
        self.pool = [pool.actions, pool.observations, pool.rewards, pool.terminated, pool.steps]
        self.episodes = [
            *(underway.observations, underway.returns),
            *(underway.steps, underway.actions),
        ]
        self.max_steps = 3
        self.tasks = np.ones(2, np.uint8)
        self.params = np.zeros(8 * 4 + 4, np.float32)
        self.batch = pool.batch

    def advance(self) -> int:
        rollout = _train.Rollout(self.batch, Perceptron(8, (), 4).network, 1_000)
        pool, episodes = _train.PoolArrays(*self.pool), _train.EpisodeArrays(*self.episodes)
        return rollout.advance(self.max_steps, self.params, self.tasks, pool, episodes)


def test_only_environments_with_the_task_to_step_move():
    arguments = Arguments()
    arguments.tasks[0] = 0
    before = arguments.episodes[0].copy()
    assert arguments.advance() == 3
    steps = arguments.episodes[2].tolist()
    assert steps == [0, 3]
    assert (arguments.episodes[0][0] == before[0]).all()
    assert (arguments.episodes[0][1] != before[1]).any()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"params": np.zeros(3, np.float32)}, "params has 3 entries, must have 36"),
        ({"tasks": np.ones(3, np.uint8)}, "tasks has 3 rows, must have 2"),
        ({"tasks": np.full(2, 2, np.uint8)}, r"tasks\[0\] = 2: must be 0 \(nothing\) or 1"),
        ({"max_steps": -1}, "max_steps = -1: must be at least 0"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_before_anything_moves(change, said):
    arguments = Arguments()
    for name, value in change.items():
        setattr(arguments, name, value)
    before = arguments.episodes[0].copy()
    with pytest.raises(ValueError, match=said):
        arguments.advance()
    assert (arguments.episodes[0] == before).all()


def test_an_environment_without_an_episode_cannot_step():
    arguments = Arguments()
    arguments.episodes = [array[:1] for array in arguments.episodes]
    with pytest.raises(ValueError, match="environment 1 has no episode"):
        arguments.advance()
    arguments.tasks[1] = 0
    assert arguments.advance() == 3


def test_a_finished_episode_is_not_stepped_on():
    arguments = Arguments()
    arguments.pool[4][:] = arguments.episodes[2][:] = 1_000
    with pytest.raises(ValueError, match="environment 0 is after 1000 steps"):
        arguments.advance()
