from collections.abc import Iterator

import gymnasium
import pytest

from stepping import Always
from touchdown.control.pid import PIDConfig, PIDPolicy
from touchdown.core.types import FloatArray, IntArray, Policy
from touchdown.evaluation.evaluator import EpisodeResult, Evaluator
from touchdown.lander import rules

CART = "CartPole-v1"
LANDER = "LunarLander-v3"
CART_STARTS = [11, 3, 400, 5, 3, 17, 2]  # not sorted, one of them twice
LANDER_STARTS = [8, 2, 5, 0]


class Lean:
    """Pushes the cart under the pole: it falls after tens of steps, as the start decides."""

    def act(self, observations: FloatArray) -> IntArray:
        return (observations[:, 2] > 0).astype(int)


class Balance:
    """Holds the pole up until the time limit."""

    def act(self, observations: FloatArray) -> IntArray:
        return (observations @ [0.1, 0.3, 1.0, 1.0] > 0).astype(int)


GAINS = PIDConfig(
    rule="signed",
    kp_vertical=-0.5,
    ki_vertical=-0.25,
    kp_angle=-0.5,
    kd_angle=-0.5,
    dead_band=0.05,
)


def test_the_exact_engine_s_rollouts_are_those_of_stock():
    policy = PIDPolicy(GAINS)
    starts = list(range(40))
    rollouts = []
    for engine in ("gymnasium", "exact"):
        evaluator = Evaluator(LANDER, 7, engine)
        rollouts.append(evaluator.rollout(policy, starts))
        evaluator.close()
    assert rollouts[0] == rollouts[1]
    assert len({result.outcome for result in rollouts[0]}) > 1


@pytest.fixture(scope="module")
def evaluators() -> Iterator[dict[str, Evaluator]]:
    made = {CART: Evaluator(CART, 3), LANDER: Evaluator(LANDER, 3)}
    yield made
    for evaluator in made.values():
        evaluator.close()


def rollout(env_id: str, num_envs: int, policy: Policy, starts: list[int]) -> list[EpisodeResult]:
    evaluator = Evaluator(env_id, num_envs)
    try:
        return evaluator.rollout(policy, starts)
    finally:
        evaluator.close()


def plain_loop(env_id: str, policy: Policy, start: int) -> EpisodeResult:
    """The slow twin: one episode in one new environment."""
    env = gymnasium.make(env_id)
    observation, _ = env.reset(seed=start)
    total, steps, fuel, ended = 0.0, 0, 0.0, False
    terminated, reward = False, 0.0
    while not ended:
        action = policy.act(observation[None]).item()
        observation, reward, terminated, truncated, _ = env.step(action)
        total, steps, ended = total + float(reward), steps + 1, terminated or truncated
        if env_id == LANDER:
            fuel += (0.0, 0.03, 0.3, 0.03)[action]
    env.close()
    if not terminated:
        outcome = "timed out"
    elif env_id != LANDER:
        outcome = "terminated"
    elif reward == 100:
        outcome = "landed"
    else:
        outcome = "out of bounds" if abs(observation[0]) >= 1 else "crashed"
    return EpisodeResult(start, total, steps, outcome, pytest.approx(fuel))


@pytest.fixture(scope="module")
def landings() -> list[EpisodeResult]:
    return [plain_loop(LANDER, PIDPolicy(GAINS), start) for start in LANDER_STARTS]


# --- equal to a plain loop, however many episodes are under way ---


@pytest.mark.parametrize("num_envs", [1, 3, 8])
def test_a_rollout_equals_a_plain_loop_however_many_environments_it_has(num_envs: int):
    expected = [plain_loop(CART, Lean(), start) for start in CART_STARTS]
    results = rollout(CART, num_envs, Lean(), CART_STARTS)
    assert results == expected
    assert len({result.steps for result in results}) > 3  # they end at different times
    assert [result.seed for result in results] == CART_STARTS
    assert {result.outcome for result in results} == {"terminated"}


@pytest.mark.parametrize("num_envs", [1, 3, 8])
def test_a_rollout_of_the_lander_equals_a_plain_loop_however_many_environments_it_has(
    num_envs: int, landings: list[EpisodeResult]
):
    results = rollout(LANDER, num_envs, PIDPolicy(GAINS), LANDER_STARTS)
    assert results == landings
    assert len({result.steps for result in results}) == len(LANDER_STARTS)
    assert all(result.fuel > 0 for result in results)


def test_an_evaluator_rolls_out_again_as_if_it_were_new(evaluators: dict[str, Evaluator]):
    first = evaluators[CART].rollout(Lean(), CART_STARTS)
    assert evaluators[CART].rollout(Lean(), CART_STARTS) == first
    assert evaluators[CART].rollout(Lean(), CART_STARTS[::-1]) == first[::-1]


# --- how an episode ended ---


def test_a_pole_that_is_held_up_times_out(evaluators: dict[str, Evaluator]):
    (result,) = evaluators[CART].rollout(Balance(), [1])
    assert (result.outcome, result.steps, result.episode_return) == ("timed out", 500, 500.0)
    assert result.fuel == 0  # the cart's actions burn nothing


@pytest.mark.parametrize(
    ("action", "cost_a_step"),
    [
        (rules.IDLE, 0.0),
        (rules.LEFT_ENGINE, 0.03),
        (rules.MAIN_ENGINE, 0.3),
        (rules.RIGHT_ENGINE, 0.03),
    ],
)
def test_fuel_is_what_the_engines_cost_a_step(
    action: int, cost_a_step: float, evaluators: dict[str, Evaluator]
):
    results = evaluators[LANDER].rollout(Always(action), [0, 1])
    for result in results:
        assert result.fuel == pytest.approx(cost_a_step * result.steps)
        assert result.steps > 40
        assert result.outcome in ("crashed", "out of bounds")


def test_falling_without_engines_is_a_crash_and_full_thrust_leaves_the_viewport(
    evaluators: dict[str, Evaluator],
):
    (fallen,) = evaluators[LANDER].rollout(Always(rules.IDLE), [3])
    assert fallen == plain_loop(LANDER, Always(rules.IDLE), 3)
    assert fallen.outcome == "crashed"
    burnt = evaluators[LANDER].rollout(Always(rules.MAIN_ENGINE), [0, 1, 2, 3])
    assert "out of bounds" in {result.outcome for result in burnt}


# --- listening ---


def test_each_episode_is_announced_once(evaluators: dict[str, Evaluator]):
    announced = []
    evaluators[CART].rollout(Lean(), CART_STARTS, lambda: announced.append(1))
    assert len(announced) == len(CART_STARTS)


def test_a_rollout_from_no_starts_asks_no_policy(evaluators: dict[str, Evaluator]):
    class Never:
        def act(self, observations: FloatArray) -> IntArray:
            raise AssertionError(f"asked about {len(observations)}")

    assert evaluators[CART].rollout(Never(), []) == []


def test_the_policy_sees_only_the_episodes_still_under_way(evaluators: dict[str, Evaluator]):
    class Count(Lean):
        def __init__(self) -> None:
            self.seen: list[int] = []

        def act(self, observations: FloatArray) -> IntArray:
            self.seen.append(len(observations))
            return super().act(observations)

    policy = Count()
    results = evaluators[CART].rollout(policy, CART_STARTS)
    assert policy.seen[0] == 3
    assert policy.seen[-1] == 1
    assert policy.seen == sorted(policy.seen, reverse=True)
    assert sum(policy.seen) == sum(result.steps for result in results)


def test_a_result_is_json_field_by_field():
    assert EpisodeResult(7, -3.5, 80, "crashed", 1.2).to_json() == {
        "seed": 7,
        "episode_return": -3.5,
        "steps": 80,
        "outcome": "crashed",
        "fuel": 1.2,
    }
