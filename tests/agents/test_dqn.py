from collections.abc import Callable
from itertools import combinations, islice, pairwise

import numpy as np
import pytest
from numpy.random import default_rng

from stepping import act, fly, observe
from touchdown.agents.dqn import DQNAgent
from touchdown.core.types import StepResult

NewAgent = Callable[..., DQNAgent]
GREEDY = {"schedule": "constant", "epsilon_start": 0.0}


def random_observations(count: int, seed: int = 0) -> np.ndarray:
    return default_rng(seed).normal(size=(count, 5)).astype(np.float32) * 3


def feed(agent: DQNAgent, count: int, reward: float = -1.0) -> list[dict[str, float] | None]:
    """Random transitions; the agent's first observation is of a new episode."""
    rows = random_observations(count + 1, seed=agent.env_steps)
    return [
        observe(agent, o_tm1, i % 2, reward, o_t) for i, (o_tm1, o_t) in enumerate(pairwise(rows))
    ]


def online(agent: DQNAgent) -> np.ndarray:
    return np.array(agent.learner.state.online_params)


def target(agent: DQNAgent) -> np.ndarray:
    return np.array(agent.learner.state.target_params)


def greedy_action(agent: DQNAgent, observation: np.ndarray) -> int:
    values = agent.learner.model.values(agent.learner.state.online_params, observation[None])
    return int(np.argmax(np.asarray(values)[0]))


# --- what is remembered ---


def test_a_truncated_step_still_bootstraps_and_a_terminated_one_does_not(
    new_agent: NewAgent, chain
):
    agent = new_agent(
        replay={"min_size": 1_000},
        exploration={"schedule": "constant", "epsilon_start": 1.0},
        learning={"gamma": 0.7},
    )
    steps = list(islice(fly(agent, chain(limit=3)), 300))
    records = agent.replay.ring.records
    assert len(records) == len(steps) == 300
    ends = {True: 0, False: 0}
    for step, record in zip(steps, records, strict=True):
        observations, _, (terminated,), (truncated,) = step.result
        assert record["discount_t"] == np.float32(0.0 if terminated else 0.7)
        assert record["terminated"] == terminated
        assert np.array_equal(record["o_t"], observations[0])  # before the reset
        if terminated or truncated:
            ends[bool(terminated)] += 1
    assert min(ends.values()) > 10  # both kinds of end were seen


def test_a_rewarded_transition_is_remembered_tau_times_more(new_agent: NewAgent):
    agent = new_agent(replay={"min_size": 1_000, "resaves": 3, "resave_threshold": 0.5})
    feed(agent, 2, reward=0.5)  # at the threshold exactly: not rewarded
    assert len(agent.replay) == 2
    feed(agent, 1, reward=0.75)
    assert len(agent.replay) == 2 + 4
    assert agent.env_steps == 3  # copies are no env steps


# --- when it learns ---


def test_no_update_before_the_memory_holds_its_least(new_agent: NewAgent):
    agent = new_agent(replay={"min_size": 8})
    before = online(agent)
    assert feed(agent, 7) == [None] * 7
    assert np.array_equal(online(agent), before)
    (metrics,) = feed(agent, 1)
    assert metrics is not None
    assert not np.array_equal(online(agent), before)
    assert all(metrics is not None for metrics in feed(agent, 5))
    assert agent.updates == 6


def test_copies_count_towards_the_least_that_the_memory_holds(new_agent: NewAgent):
    agent = new_agent(replay={"min_size": 8, "resaves": 3})
    learned = [metrics is not None for metrics in feed(agent, 3, reward=1.0)]
    assert learned == [False, True, True]  # four copies each


def test_updates_come_once_a_period(new_agent: NewAgent):
    agent = new_agent(replay={"min_size": 5}, learning={"update_period": 4})
    learned = [metrics is not None for metrics in feed(agent, 17)]
    assert [i for i, did in enumerate(learned, start=1) if did] == [8, 12, 16]
    assert agent.updates == 3


def test_target_is_copied_once_a_period_and_not_between(new_agent: NewAgent):
    agent = new_agent(replay={"min_size": 1}, learning={"target_period": 4})
    held = target(agent)
    for number in range(1, 14):
        feed(agent, 1)
        if number % 4 == 0:
            assert np.array_equal(target(agent), online(agent))  # after this observation's update
            assert not np.array_equal(target(agent), held)
            held = target(agent)
        else:
            assert np.array_equal(target(agent), held)
            assert not np.array_equal(target(agent), online(agent))


def test_without_a_target_period_there_is_no_target_network(new_agent: NewAgent):
    agent = new_agent()
    feed(agent, 12)
    assert agent.learner.state.target_params is None


# --- how it acts ---


def test_epsilon_falls_once_an_episode_by_its_factor(new_agent: NewAgent):
    agent = new_agent(
        replay={"min_size": 1_000}, exploration={"epsilon_decay": 0.5, "epsilon_end": 0.2}
    )
    seen = []
    row = random_observations(1)[0]
    for _ in range(4):
        seen.append(agent.epsilon)
        feed(agent, 3)
        assert agent.epsilon == seen[-1]  # not within an episode
        observe(agent, row, 0, 0.0, row, truncated=True)
    assert seen == [1.0, 0.5, 0.25, 0.2]


def test_epsilon_falls_in_a_line_within_an_episode(new_agent: NewAgent):
    agent = new_agent(
        replay={"min_size": 1_000},
        exploration={"schedule": "linear", "epsilon_end": 0.0, "epsilon_duration": 4},
    )
    seen = [agent.epsilon]
    for _ in range(5):
        feed(agent, 1)
        seen.append(agent.epsilon)
    assert seen == [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]


def test_without_exploring_the_action_is_the_one_of_highest_value(new_agent: NewAgent):
    agent = new_agent(exploration=GREEDY)
    observations = random_observations(50)
    actions = [act(agent, observation) for observation in observations]
    assert actions == [greedy_action(agent, observation) for observation in observations]
    assert set(actions) == {0, 1}


def test_exploring_always_takes_every_action_equally_often(new_agent: NewAgent):
    agent = new_agent(exploration={"schedule": "constant", "epsilon_start": 1.0})
    observation = random_observations(1)[0]
    mean = np.mean([act(agent, observation) for _ in range(2_000)])
    assert mean == pytest.approx(0.5, abs=0.034)  # three standard deviations


def test_the_next_action_by_the_updates_values_is_the_one_computed_apart(
    new_agent: NewAgent,
):
    agent = new_agent(replay={"min_size": 1}, exploration=GREEDY, learning={"learning_rate": 0.01})
    rows, actions = random_observations(101), []
    for o_tm1, o_t in pairwise(rows):
        observe(agent, o_tm1, len(actions) % 2, 1.0, o_t)
        assert agent._actor.next_q is not None
        apart = agent.learner.model.values(agent.learner.state.online_params, o_t[None])[0]
        np.testing.assert_allclose(agent._actor.next_q[0], apart, rtol=1e-4, atol=1e-5)
        actions.append(act(agent, o_t))
        assert actions[-1] == greedy_action(agent, o_t)
    assert set(actions) == {0, 1}


@pytest.mark.parametrize("between", ["an episode's end", "updates"])
def test_the_updates_values_are_of_the_observation_that_is_acted_on_next(
    between: str, new_agent: NewAgent
):
    agent = new_agent(
        replay={"min_size": 1},
        exploration=GREEDY,
        learning={"update_period": 2, "learning_rate": 1e-9},  # the weights stay as good as fixed
    )
    candidates = random_observations(100)
    chosen = [greedy_action(agent, row) for row in candidates]
    left, right = (candidates[chosen.index(action)] for action in (0, 1))
    feed(agent, 1)
    if between == "updates":
        observe(agent, left, 0, 0.0, left)  # the second observation: an update
        assert act(agent, left) == 0
        assert observe(agent, left, 0, 0.0, right) is None
    else:
        observe(agent, left, 0, 0.0, left, terminated=True, next_observation=right)
    assert act(agent, right) == 1


# --- one seed, two seeds ---


def flown(agent: DQNAgent, chain) -> list[tuple[float, bytes]]:
    steps = islice(fly(agent, chain()), 200)
    return [(step.result.rewards[0], step.result.observations.tobytes()) for step in steps]


def test_two_agents_of_one_seed_are_identical_and_two_seeds_differ(new_agent: NewAgent, chain):
    settings = {"replay": {"resaves": 1}, "learning": {"target_period": 7}}
    one, same, other = (new_agent(seed, **settings) for seed in (3, 3, 4))
    assert np.array_equal(online(one), online(same))
    assert not np.isin(online(one), online(other)).any()  # the first weights follow from the seed
    flights = [flown(agent, chain) for agent in (one, same, other)]
    assert flights[0] == flights[1]
    assert flights[0] != flights[2]
    assert one.updates > 150
    assert np.array_equal(online(one), online(same))
    assert np.array_equal(target(one), target(same))
    assert np.array_equal(one.replay.ring.records, same.replay.ring.records)
    assert not np.isclose(online(one), online(other)).all()


# --- noisy weights ---


def noisy(new_agent: NewAgent, seed: int = 0, **settings) -> DQNAgent:
    settings = {"exploration": GREEDY, "replay": {"min_size": 30}} | settings
    return new_agent(seed, network={"noisy": True}, **settings)


def test_noise_explores_where_chance_does_not(new_agent: NewAgent):
    agent = noisy(new_agent, replay={"min_size": 1_000})
    observation = random_observations(1)[0]
    actions = []
    for _ in range(60):
        actions.append(act(agent, observation))
        assert act(agent, observation) == actions[-1]  # one sample an observation
        observe(agent, observation, 0, 0.0, observation)
    assert set(actions) == {0, 1}


def test_the_values_of_the_next_actions_are_drawn_anew_with_each_update(new_agent: NewAgent):
    agent = noisy(new_agent, learning={"learning_rate": 1e-9})  # the weights stay as good as fixed
    feed(agent, 40)
    observation, seen = random_observations(1)[0], []
    for _ in range(10):
        observe(agent, observation, 0, 0.0, observation)
        seen.append(np.asarray(agent._actor.next_q))
    assert len(np.unique(np.array(seen).round(4), axis=0)) == 10


def test_a_noisy_policy_acts_by_the_mean_weights(new_agent: NewAgent):
    agent = noisy(new_agent)
    feed(agent, 40)
    rows = random_observations(40)
    expected = [greedy_action(agent, row) for row in rows]
    policy = agent.policy(agent.weights())
    assert [policy.act(rows).tolist() for _ in range(2)] == [expected] * 2


def test_noise_follows_from_the_seed_as_all_else_does(new_agent: NewAgent, chain):
    agents = [noisy(new_agent, seed) for seed in (3, 3, 4)]
    flights = [flown(agent, chain) for agent in agents]
    one, same, other = agents
    assert flights[0] == flights[1]
    assert np.array_equal(online(one), online(same))
    assert not np.isclose(online(one), online(other)).all()


@pytest.mark.parametrize("update_period", [1, 3])
def test_a_noisy_agent_restored_by_its_counters_goes_on_as_if_nothing_had_happened(
    update_period: int, new_agent: NewAgent
):
    settings = {"learning": {"update_period": update_period, "target_period": 7}}
    agent, resumed = (noisy(new_agent, **settings) for _ in range(2))
    feed(agent, 60)
    resumed.restore(agent.state())
    resumed._rng.bit_generator.state = agent._rng.bit_generator.state
    rows = random_observations(31, seed=5)
    for o_tm1, o_t in pairwise(rows):
        actions = [act(it, o_tm1) for it in (agent, resumed)]
        assert actions[0] == actions[1]
        for it in (agent, resumed):
            observe(it, o_tm1, actions[0], 1.0, o_t)
    assert np.array_equal(online(agent), online(resumed))


# --- the policy ---


def test_a_policy_takes_the_action_of_highest_value(new_agent: NewAgent):
    agent = new_agent()
    observations = random_observations(40)
    expected = [greedy_action(agent, observation) for observation in observations]
    assert agent.policy(agent.weights()).act(observations).tolist() == expected


def test_a_policy_stays_as_it_was_when_its_agent_goes_on_learning(new_agent: NewAgent):
    agent = new_agent(learning={"learning_rate": 0.01})
    feed(agent, 10)
    policy, observations = agent.policy(agent.weights()), random_observations(500, seed=9)
    before = policy.act(observations)
    feed(agent, 200, reward=5.0)
    assert np.array_equal(policy.act(observations), before)
    assert not np.array_equal(agent.policy(agent.weights()).act(observations), before)


def test_the_average_of_the_weights_is_the_recursive_mean_of_those_after_each_step_with_updates(
    new_agent: NewAgent,
):
    agent = new_agent(learning={"averaging": 0.25, "update_period": 3, "gradient_steps": 2})
    average, before = online(agent), 0
    for _ in range(60):
        feed(agent, 1)
        if agent.updates > before:
            average += np.float32(0.25) * (online(agent) - average)
            before = agent.updates
    assert before >= 20
    assert np.array_equal(agent.average, average)
    layers = agent.learner.model.layers(average)
    assert all(np.array_equal(value, layers[name]) for name, value in agent.weights().items())


def test_averaging_changes_neither_actions_nor_updates(new_agent: NewAgent):
    agents = [new_agent(learning={"averaging": rate}) for rate in (0.0, 0.1)]
    for agent in agents:
        feed(agent, 60)
    assert np.array_equal(online(agents[0]), online(agents[1]))
    observations = random_observations(40, seed=7)
    actions = [agent.act(observations).tolist() for agent in agents]
    assert actions[0] == actions[1]


def test_an_average_of_another_size_in_a_checkpoint_is_refused(new_agent: NewAgent):
    agent = new_agent(learning={"averaging": 0.1})
    state = agent.state()
    state["average"]["params"] = np.zeros(3, np.float32)
    with pytest.raises(ValueError, match=r"average is float32\(3,\), must be float32"):
        agent.restore(state)


# --- parts that combine ---

PARTS = {
    "double": {"learning": {"target_period": 7, "double": True}},
    "soft updates": {"learning": {"polyak": 0.1}},
    "averaged": {"learning": {"averaging": 0.1}},
    "three steps": {"learning": {"n_step": 3}},
    "prioritized": {"replay": {"prioritized": True, "beta_duration": 20}},
    "re-saved": {"replay": {"resaves": 2}},
    "dueling": {"network": {"dueling": True}},
    "quantiles": {"network": {"quantiles": 5}, "learning": {"loss": "huber"}},
    "atoms": {"network": {"atoms": 21}},
    "normalised": {"network": {"layer_norm": True}},
    "noisy": {"network": {"noisy": True}},
}


def together(*names: str) -> dict[str, dict]:
    """The settings of several parts, as `new_agent` takes them."""
    settings: dict[str, dict] = {}
    for name in names:
        for section, values in PARTS[name].items():
            settings[section] = settings.get(section, {}) | values
    return settings


@pytest.mark.parametrize("pair", list(combinations(PARTS, 2)), ids=" and ".join)
def test_two_parts_learn_together_or_are_refused_with_the_reason(
    pair: tuple[str, str], new_agent: NewAgent
):
    if set(pair) == {"double", "soft updates"}:  # two targets at once
        with pytest.raises(ValueError, match="either copied or softly updated, not both"):
            new_agent(**together(*pair))
        return
    if set(pair) == {"quantiles", "atoms"}:  # two descriptions of one return
        with pytest.raises(ValueError, match="use one or the other"):
            new_agent(**together(*pair))
        return
    agent = new_agent(**together(*pair))
    before = online(agent)
    feed(agent, 60)
    assert agent.updates > 0
    assert np.isfinite(online(agent)).all()
    assert not np.array_equal(before, online(agent))


def test_transitions_under_way_when_an_episode_is_cut_off_are_remembered(new_agent: NewAgent):
    agent = new_agent(learning={"n_step": 4, "gamma": 0.5})
    feed(agent, 5)
    assert len(agent.replay) == 2
    observe(agent, *random_observations(1), 0, -1.0, *random_observations(1), truncated=True)
    discounts = agent.replay.ring.records["discount_t"].tolist()
    assert discounts == [0.5**4] * 3 + [0.5**3, 0.5**2, 0.5]


@pytest.mark.parametrize("part", PARTS)
def test_every_part_learns_the_way_along_a_chain(part: str, new_agent: NewAgent, chain):
    settings = together(part)
    settings["learning"] = {"gamma": 0.7, "learning_rate": 5e-3} | settings.get("learning", {})
    settings["exploration"] = {"schedule": "constant", "epsilon_start": 1.0}
    agent = new_agent(**settings)
    list(islice(fly(agent, chain(limit=20)), 1_500))
    for place in range(4):
        assert greedy_action(agent, np.eye(5, dtype=np.float32)[place]) == 1


# --- the value of what it does ---


def test_deep_sarsa_learns_the_values_of_its_own_exploring_policy(new_agent: NewAgent, chain):
    agent = new_agent(
        exploration={"schedule": "constant", "epsilon_start": 0.5},
        learning={
            "target": "sarsa",
            "gamma": 0.5,
            "learning_rate": 0.01,
            "learning_rate_end": 1e-4,
            "learning_rate_duration": 3_500,
        },
    )
    for _ in islice(fly(agent, chain()), 4_000):
        pass
    learned = agent.learner.values(np.eye(5, dtype=np.float32), 0)
    # of 8 halved a step, a policy that turns back now and then gets less: Q* has 0.5 and 4 here
    np.testing.assert_allclose(learned, chain.values_of_acting(0.5, 0.5), atol=0.15)
    assert learned[3, 1] < 3.7


def test_sarsas_transitions_know_the_action_that_came_after(new_agent: NewAgent, chain):
    agent = new_agent(
        replay={"min_size": 1_000},
        exploration={"schedule": "constant", "epsilon_start": 1.0},
        learning={"target": "sarsa"},
    )
    steps = list(islice(fly(agent, chain(limit=4)), 200))
    records = agent.replay.ring.records
    assert 199 <= len(agent.replay) <= 200  # the last one may be waiting
    after_cut = []
    for step, following, record in zip(steps, steps[1:], records, strict=False):
        assert np.array_equal(record["o_t"], step.result.observations[0])
        if step.result.truncated[0]:
            after_cut.append(int(record["a_t"]))  # an action of its own, not the next episode's
        elif not step.result.terminated[0]:
            assert record["a_t"] == following.actions[0]
    assert set(after_cut) == {0, 1}


# --- many environments, several updates ---


def observe_together(agent: DQNAgent, times: int, num_envs: int) -> list[bool]:
    """Steps of several environments; whether each gave metrics."""
    measured = []
    for _ in range(times):
        rows = random_observations(2 * num_envs, seed=agent.env_steps).reshape(2, num_envs, 5)
        no = np.zeros(num_envs, bool)
        steps = StepResult(rows[1], -np.ones(num_envs), no, no)
        metrics = agent.observe(rows[0], np.arange(num_envs) % 2, steps, rows[1])
        measured.append(metrics is not None)
    return measured


@pytest.mark.parametrize(
    ("learning", "updates"),
    [
        ({}, [4, 8, 12, 16]),
        ({"update_period": 2}, [2, 4, 6, 8]),
        ({"update_period": 2, "gradient_steps": 3}, [6, 12, 18, 24]),
        ({"update_period": 8}, [0, 1, 1, 2]),
        ({"update_period": 3}, [1, 2, 4, 5]),  # 4, 8, 12 and 16 thirds
    ],
    ids=str,
)
def test_updates_of_a_step_of_four_environments_are_the_periods_that_it_crosses(
    learning: dict, updates: list[int], new_agent: NewAgent
):
    agent = new_agent(replay={"min_size": 4}, learning=learning, training={"num_envs": 4})
    done = []
    for _ in range(4):
        observe_together(agent, 1, 4)
        done.append(agent.updates)
    assert done == updates
    assert agent.env_steps == 16


def test_the_target_is_copied_where_a_step_crosses_its_period(new_agent: NewAgent):
    agent = new_agent(
        replay={"min_size": 4}, learning={"target_period": 10}, training={"num_envs": 4}
    )
    copied = []
    for _ in range(6):  # 4, 8, 12, 16, 20, 24
        observe_together(agent, 1, 4)
        copied.append(np.array_equal(target(agent), online(agent)))
    assert copied == [False, False, True, False, True, False]


def test_metrics_come_once_a_period_however_many_updates_a_step_makes(new_agent: NewAgent):
    agent = new_agent(
        replay={"min_size": 4},
        learning={"update_period": 1},
        training={"num_envs": 4, "metrics_period": 6},
    )
    # after 4, 8, 12, 16, 20 and 24 updates
    assert observe_together(agent, 6, 4) == [False, True, True, False, True, True]


def test_several_updates_in_one_call_are_the_same_as_one_after_the_other(new_agent: NewAgent):
    """Both draw the same minibatches: nothing is remembered in between."""
    at_once, one_by_one = (
        new_agent(replay={"min_size": 4}, learning={"gradient_steps": k}) for k in (3, 1)
    )
    rows = random_observations(2)
    for agent in (at_once, one_by_one):
        for _ in range(3):
            observe(agent, rows[0], 0, 1.0, rows[1])
    observe(at_once, rows[0], 0, 1.0, rows[1])
    observe(one_by_one, rows[0], 0, 1.0, rows[1])
    for _ in range(2):
        one_by_one._update(1, rows[1:])
    assert at_once.updates == one_by_one.updates == 3
    np.testing.assert_allclose(online(at_once), online(one_by_one), rtol=1e-5, atol=1e-7)


def test_environments_together_store_what_each_would_alone(new_agent: NewAgent, chain):
    """Returns of three steps are summed in each environment by itself."""
    settings = {
        "replay": {"min_size": 1_000},
        "exploration": {"schedule": "constant", "epsilon_start": 0.0},
        "learning": {"n_step": 3, "gamma": 0.5},
    }
    starts = (0, 2, 4)
    together = new_agent(**settings, training={"num_envs": 3})
    for _ in islice(fly(together, *(chain(limit=6) for _ in starts), start_of=int), 6):
        pass
    remembered = {
        record.tobytes() for record in together.replay.ring.records[: len(together.replay)]
    }
    alone = new_agent(**settings)
    for _ in islice(fly(alone, chain(limit=6), start_of=lambda _: 1), 6):
        pass
    expected = {record.tobytes() for record in alone.replay.ring.records[: len(alone.replay)]}
    assert len(expected) > 3
    assert expected <= remembered


def test_an_agent_of_either_backend_takes_the_same_greedy_actions(new_agent):
    observations = default_rng(0).normal(size=(64, 5))
    greedy = {"schedule": "constant", "epsilon_start": 0.0}
    actions = [
        new_agent(learning={"backend": backend}, exploration=greedy).act(
            observations.astype(np.float32)
        )
        for backend in ("jax", "fused")
    ]
    assert actions[0].tolist() == actions[1].tolist()
