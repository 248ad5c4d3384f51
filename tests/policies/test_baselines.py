import gymnasium
import numpy as np
import pytest
from gymnasium.envs.box2d.lunar_lander import heuristic

import touchdown
from touchdown.policies import baselines


def test_the_shipped_gains_are_those_of_the_better_rule():
    assert baselines.shipped_pid() in (
        baselines.shipped_pid("signed"),
        baselines.shipped_pid("absolute"),
    )
    assert baselines.shipped_pid("absolute").rule == "absolute"
    assert baselines.shipped_pid("signed").rule == "signed"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('rule = "up"\n', "rule = 'up': must be one of absolute, signed"),
        ("dead_band = -1\n", "dead_band = -1"),
        ("kp = 1\n", "unknown field 'kp'; must be one of rule, kp_vertical"),
        ("kp_vertical = 'big'\n", "kp_vertical = 'big': must be a number"),
        ('rule = "signed"\n', "kp_vertical, ki_vertical, kp_angle, kd_angle, dead_band: missing"),
    ],
)
def test_bad_gains_are_refused(tmp_path, text, said):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(touchdown.UserError, match=r"bad\.toml") as refused:
        baselines.read_pid(path)
    assert said in str(refused.value)


def test_the_random_policy_acts_the_same_from_a_start_whatever_other_starts_are_flown():
    three = touchdown.evaluate("random", episodes=3, env_id="CartPole-v1").episodes
    assert (
        three[2:] == touchdown.evaluate("random", episodes=1, seed=2, env_id="CartPole-v1").episodes
    )
    flight = touchdown.fly("random", seed=2, env_id="CartPole-v1")
    assert flight.steps == three[2].steps


def test_the_random_policy_takes_every_action_equally_often():
    # in a single state, as in a table's environment
    seen, seeds, steps = np.zeros((4_000, 8), np.float32), np.arange(4_000) % 40, np.arange(4_000)
    for actions in (
        baselines.RandomPolicy(4).act_at(seen, seeds, steps // 40),
        baselines.RandomPolicy(4).act(seen),
    ):
        counts = np.bincount(actions, minlength=4)
        assert counts == pytest.approx(1_000, abs=100)  # 3.7 standard deviations


def test_random_actions_repeat_for_one_seed_and_differ_between_seeds():
    policy, seen, steps = baselines.RandomPolicy(4), np.zeros((100, 1)), np.arange(100)
    first = policy.act_at(seen, np.full(100, 7), steps).tolist()
    assert baselines.RandomPolicy(4).act_at(seen, np.full(100, 7), steps).tolist() == first
    assert policy.act_at(seen, np.full(100, 8), steps).tolist() != first


def test_the_heuristic_flies_as_it_does_in_gymnasium():
    env = gymnasium.make("LunarLander-v3")
    observation, _ = env.reset(seed=5)
    total, ended = 0.0, False
    while not ended:
        observation, reward, terminated, truncated, _ = env.step(
            heuristic(env.unwrapped, observation)
        )
        total += float(reward)
        ended = terminated or truncated
    env.close()
    flown = touchdown.evaluate("heuristic", episodes=1, seed=5).episodes[0]
    assert flown.episode_return == pytest.approx(total, abs=1e-9)
