"""Variants of the lander: other gravity, and wind."""

import gymnasium
import numpy as np
import pytest

from touchdown.envs import environment
from touchdown.envs.pool import make_pool
from touchdown.evaluation.evaluator import Evaluator
from touchdown.lander import rules
from touchdown.lander.single import LanderEnv
from touchdown.policies import lookup


@pytest.mark.parametrize("env_id", rules.VARIANTS)
def test_a_variant_is_stock_with_its_settings_to_the_last_bit(env_id):
    settings = rules.settings_of(env_id)
    stock = gymnasium.make(rules.LANDER_ID, **settings)
    exact = environment.make_env(env_id, engine="exact").env
    ours = environment.make_env(env_id, engine="gymnasium").env
    registered = gymnasium.make(env_id)
    assert isinstance(exact.unwrapped, LanderEnv)
    assert not isinstance(ours.unwrapped, LanderEnv)
    pool = make_pool(env_id, 1, "exact")
    only = np.array([0])
    for seed in range(2):
        rng = np.random.default_rng(seed)
        observed = [env.reset(seed=seed)[0].tolist() for env in (stock, exact, ours, registered)]
        observed.append(pool.reset(0, seed).tolist())
        assert observed == observed[:1] * 5
        ended = False
        while not ended:
            action = int(rng.integers(4))
            steps = [env.step(action)[:3] for env in (stock, exact, ours, registered)]
            of_pool = pool.step(only, np.array([action]))
            steps.append((of_pool.observations[0], of_pool.rewards[0], bool(of_pool.terminated[0])))
            told = [(seen.tolist(), reward, over) for seen, reward, over in steps]
            assert told == told[:1] * 5
            ended = told[0][2]


def test_a_lander_falls_more_slowly_on_mars():
    heights = {}
    for env_id in (
        rules.LANDER_ID,
        "touchdown/LunarLanderMars-v3",
        "touchdown/LunarLanderHeavy-v3",
    ):
        env = environment.make_env(env_id, engine="exact").env
        env.reset(seed=3)
        heights[env_id] = [env.step(0)[0][1] for _ in range(40)][-1]
    assert sorted(heights, key=lambda of: heights[of]) == [
        "touchdown/LunarLanderHeavy-v3",
        rules.LANDER_ID,
        "touchdown/LunarLanderMars-v3",
    ]


def test_a_controller_of_the_lander_flies_in_the_variant_that_is_asked_for():
    env_id = "touchdown/LunarLanderWindy-v3"
    for name in ("pid", "heuristic"):
        assert lookup.load(name, env_id).env_id == env_id
        assert lookup.load(name, "CartPole-v1").env_id == rules.LANDER_ID


def test_flights_of_a_variant_end_as_those_of_the_lander_and_cost_fuel():
    policy = lookup.load("pid").policy
    for env_id in (rules.LANDER_ID, "touchdown/LunarLanderMars-v3"):
        evaluator = Evaluator(env_id, engine="exact")
        (flight,) = evaluator.rollout(policy, [5])
        evaluator.close()
        assert flight.outcome == "landed"
        assert flight.fuel > 0
