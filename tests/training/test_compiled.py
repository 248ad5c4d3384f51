"""The compiled loop and its slow twin, Python's loop, give the same bytes."""

import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.random import default_rng

from touchdown.agents.dqn import DQNAgent
from touchdown.agents.learners._fused import Perceptron
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.pqn import PQNAgent
from touchdown.agents.registry import make_agent
from touchdown.config.config import Config
from touchdown.config.sections import (
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TrainingConfig,
)
from touchdown.core import files
from touchdown.core.errors import Interrupted
from touchdown.core.seeding import Streams, streams, training_start
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import ExactEnvPool, make_pool
from touchdown.replay.n_step import Windows
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training import _train
from touchdown.training.compiled import CompiledLoop
from touchdown.training.compiled_pqn import CompiledPQN
from touchdown.training.loop import STEPS_BETWEEN_LOOKS, AgentStep, begin, interact
from touchdown.training.trainer import Trainer


def config_of(**sections: dict[str, Any]) -> Config:
    """Small settings under which episodes end, the memory wraps around and updates take place."""
    if "rollout" in sections:
        return pqn_config_of(**sections)
    learning = {"batch_size": 8, "backend": "fused"} | sections.pop("learning", {})
    replay = {"capacity": 500, "min_size": 40} | sections.pop("replay", {})
    training = {"metrics_period": 70} | sections.pop("training", {})
    exploration = {"epsilon_decay": 0.8} | sections.pop("exploration", {})
    network = {"hidden_sizes": (12, 8)} | sections.pop("network", {})
    assert not sections
    return Config(
        seed=3,
        network=NetworkConfig(**network),
        replay=ReplayConfig(**replay),
        exploration=ExplorationConfig(**exploration),
        learning=LearningConfig(**learning),
        training=TrainingConfig(**training),
    )


def pqn_config_of(**sections: dict[str, Any]) -> Config:
    """Small settings of PQN, with updates after every few steps."""
    learning = {"backend": "fused"} | sections.pop("learning", {})
    rollout = {"rollout_steps": 5, "minibatches": 2, "epochs": 2} | sections.pop("rollout")
    training = {"metrics_period": 70} | sections.pop("training", {})
    exploration = {"epsilon_decay": 0.8} | sections.pop("exploration", {})
    network = {"hidden_sizes": (12, 8), "layer_norm": True} | sections.pop("network", {})
    assert not sections
    return Config(
        seed=3,
        algorithm="pqn",
        network=NetworkConfig(**network),
        exploration=ExplorationConfig(**exploration),
        learning=LearningConfig(**learning),
        rollout=RolloutConfig(**rollout),
        training=TrainingConfig(**training),
    )


SETTINGS: dict[str, dict[str, dict[str, Any]]] = {
    "plain": {},
    "three environments": {"training": {"num_envs": 3}},
    "forty environments": {"training": {"num_envs": 40}, "learning": {"update_period": 16}},
    "re-saves": {"replay": {"resaves": 2, "resave_threshold": 0.5}},
    "copies of the target": {"learning": {"target_period": 30, "double": True}},
    "soft updates": {"learning": {"polyak": 0.01, "max_grad_norm": 1.0, "reward_scale": 0.1}},
    "many updates": {"learning": {"update_period": 4, "gradient_steps": 3, "loss": "huber"}},
    "many updates of three": {
        "learning": {"update_period": 4, "gradient_steps": 3, "target_period": 7},
        "training": {"num_envs": 3, "metrics_period": 5},
    },
    "three steps": {"learning": {"n_step": 3}, "replay": {"resaves": 1}},
    "five steps of three": {"learning": {"n_step": 5}, "training": {"num_envs": 3}},
    "constant ε": {"exploration": {"schedule": "constant", "epsilon_start": 0.3}},
    "only random actions": {"exploration": {"schedule": "constant", "epsilon_start": 1.0}},
    "only greedy actions": {"exploration": {"schedule": "constant", "epsilon_start": 0.0}},
    "linear ε": {"exploration": {"schedule": "linear", "epsilon_duration": 400}},
    "falling learning rate": {"learning": {"learning_rate_duration": 300}},
    "rising learning rate": {
        "learning": {"learning_rate_duration": 300, "learning_rate_end": 0.01}
    },
    "weights that are no numbers": {"learning": {"learning_rate": 1e30}},
    "priorities": {"replay": {"prioritized": True, "beta_duration": 60}},
    "priorities of three, re-saves": {
        "replay": {"prioritized": True, "capacity": 77, "resaves": 2, "alpha": 1.0},
        "learning": {"update_period": 4, "gradient_steps": 3},
        "training": {"num_envs": 3},
    },
    "quantiles": {
        "network": {"quantiles": 5},
        "learning": {"loss": "huber", "double": True, "target_period": 30},
    },
    "quantiles of three": {
        "network": {"quantiles": 8, "dueling": True},
        "learning": {"loss": "huber", "target_period": 30},
        "training": {"num_envs": 3},
    },
    "atoms": {"network": {"atoms": 7}, "learning": {"n_step": 3, "target_period": 30}},
    "atoms of forty": {
        "network": {"atoms": 5, "v_min": -3.0, "v_max": 3.0},
        "learning": {"update_period": 16},
        "training": {"num_envs": 40},
    },
    "averaged weights": {"learning": {"averaging": 0.01, "gradient_steps": 2}},
    "mirror images": {"replay": {"mirrored": True}},
    "mirror images of re-saves, three steps of three": {
        "replay": {"mirrored": True, "resaves": 2, "resave_threshold": 0.5, "capacity": 97},
        "learning": {"n_step": 3},
        "training": {"num_envs": 3},
    },
    "mirror images with priorities": {
        "replay": {"mirrored": True, "prioritized": True, "resaves": 1, "capacity": 97},
    },
    "dueling, layer norm": {"network": {"dueling": True, "layer_norm": True}},
    "noisy weights": {"network": {"noisy": True}},
    "noisy weights and no other exploration": {
        "network": {"noisy": True, "dueling": True},
        "exploration": {"schedule": "constant", "epsilon_start": 0.0},
        "learning": {"double": True, "target_period": 30, "update_period": 4, "gradient_steps": 3},
    },
    "noisy atoms of three": {
        "network": {"noisy": True, "atoms": 7},
        "learning": {"n_step": 3, "target_period": 30},
        "replay": {"prioritized": True},
        "training": {"num_envs": 3},
    },
    "SARSA": {"learning": {"target": "sarsa"}},
    "SARSA of three, three steps, re-saves": {
        "learning": {"target": "sarsa", "n_step": 3, "target_period": 30},
        "replay": {"resaves": 2, "resave_threshold": 0.5, "prioritized": True, "capacity": 97},
        "training": {"num_envs": 3},
    },
    "SARSA with noise and mirror images": {
        "network": {"noisy": True},
        "learning": {"target": "sarsa", "n_step": 2},
        "replay": {"mirrored": True},
    },
    "PQN": {"rollout": {}},
    "PQN of three, scaled rewards": {
        "rollout": {"trace_decay": 0.5},
        "learning": {"reward_scale": 0.1, "max_grad_norm": 1.0, "loss": "huber"},
        "training": {"num_envs": 3, "metrics_period": 5},
    },
    "PQN of forty, steps left over": {
        "rollout": {"rollout_steps": 3, "minibatches": 7, "epochs": 3},
        "learning": {"learning_rate_duration": 300},
        "network": {"dueling": True},
        "training": {"num_envs": 40},
    },
    "PQN of seven, mirror images, averaged weights": {
        "rollout": {"mirror_half": True, "rollout_steps": 4},
        "learning": {"averaging": 0.01},
        "training": {"num_envs": 7},
    },
    "PQN with weights that are no numbers": {"rollout": {}, "learning": {"learning_rate": 1e30}},
}


class Twin(NamedTuple):
    """A loop and everything that it changes."""

    agent: DQNAgent | PQNAgent
    pool: ExactEnvPool
    streams: Streams
    underway: Underway
    steps: Iterator[AgentStep]


def twin(config: Config, *, compiled: bool) -> Twin:
    generators = streams(config.seed)
    pool = make_pool(config.env_id, config.training.num_envs, "exact")
    agent = make_agent(config, pool.spaces, generators)
    assert isinstance(agent, DQNAgent | PQNAgent)
    assert isinstance(pool, ExactEnvPool)

    def start_of(episode: int) -> int:
        return training_start(config.seed, episode)

    underway = begin(pool, start_of, config.training.num_envs)
    if not compiled:
        steps = interact(
            agent,
            pool,
            start_of,
            underway,
            bootstrap_on_time_limit=config.learning.bootstrap_on_time_limit,
        )
    elif isinstance(agent, PQNAgent):
        steps = CompiledPQN(agent, pool, generators, config).interact(start_of, underway)
    else:
        steps = CompiledLoop(agent, pool, generators, config).interact(start_of, underway)
    return Twin(agent, pool, generators, underway, steps)


def told(step: AgentStep) -> dict[str, Any]:
    """What a step tells, as bytes where it has arrays."""
    return {
        "actions": step.actions.tobytes(),
        "result": [part.tobytes() for part in step.result],
        "epsilon": step.epsilon,
        "ended": [(e.number, e.actions, e.episode_return) for e in step.ended],
        "metrics": repr(step.metrics),  # NaN is not equal to itself
    }


def bytes_of(each: Twin) -> dict[str, Any]:
    """Everything that a checkpoint has of a twin, and its environments."""
    parts: dict[str, Any] = {}
    for name, value in each.agent.state().items():
        if isinstance(value, dict):
            parts |= {f"{name}/{key}": array.tobytes() for key, array in value.items()}
        else:
            parts[name] = value
    parts["generators"] = [rng.bit_generator.state for rng in each.streams]
    parts["underway"] = [
        (e.number, e.observation.tobytes(), e.actions, e.episode_return)
        for e in each.underway.episodes()
    ]
    envs = range(len(each.pool.actions))
    parts["pool"] = [
        *(each.pool.batch.snapshot(index) for index in envs),
        each.pool.steps.tobytes(),
    ]
    return parts


@pytest.mark.parametrize("name", SETTINGS)
def test_both_loops_give_the_same_bytes_at_every_step_that_the_compiled_one_yields(name):
    check_twins(config_of(**SETTINGS[name]))


def test_both_loops_give_the_same_bytes_in_a_variant_of_the_lander():
    check_twins(replace(config_of(), env_id="touchdown/LunarLanderWindy-v3"))


def check_twins(config: Config) -> None:
    """Compare both loops for some episodes, at every step that the compiled one yields."""
    fast, slow = (twin(config, compiled=compiled) for compiled in (True, False))
    count, ended, measured = 0, 0, 0
    while count < 1_000 // config.training.num_envs + 300:
        step = next(fast.steps)
        skipped = [next(slow.steps) for _ in range(step.num_steps)]
        assert all(not each.ended and each.metrics is None for each in skipped[:-1])
        assert told(step) == told(skipped[-1])
        assert bytes_of(fast) == bytes_of(slow)
        count += step.num_steps
        ended += len(step.ended)
        measured += step.metrics is not None
    assert ended >= 5
    assert measured >= 1
    assert fast.agent.updates > 20


def test_the_compiled_loop_yields_after_at_most_fifty_steps_of_the_first_environment():
    config = config_of(training={"num_envs": 3, "metrics_period": 10**6})
    each = twin(config, compiled=True)
    for _ in range(40):
        before = int(each.underway.steps[0])
        step = next(each.steps)
        after = int(each.underway.steps[0])
        assert step.num_steps <= STEPS_BETWEEN_LOOKS
        assert step.ended or after % STEPS_BETWEEN_LOOKS == 0
        assert step.num_steps == after - before or after == 0


@pytest.mark.parametrize("epsilon", [0.0, 1.0])
@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("target", ["q-learning", "sarsa"])
@pytest.mark.parametrize("n_step", [1, 3])
@pytest.mark.parametrize("bootstraps", [True, False])
def test_an_episode_that_times_out_bootstraps_in_both_loops_if_asked(
    bootstraps, n_step, target, noisy, epsilon
):
    config = config_of(
        network={"noisy": noisy},
        exploration={"schedule": "constant", "epsilon_start": epsilon},
        learning={
            "update_period": 10**6,
            "n_step": n_step,
            "target": target,
            "bootstrap_on_time_limit": bootstraps,
        },
    )
    twins = [twin(config, compiled=compiled) for compiled in (True, False)]
    for each in twins:
        each.pool.steps[0] = each.underway.steps[0] = 999  # a long flight is not needed
        step = next(each.steps)
        assert step.result.truncated.tolist() == [True]
        assert step.result.terminated.tolist() == [False]
        (record,) = each.agent.replay.ring.records
        assert record["discount_t"] == (np.float32(0.99) if bootstraps else 0)
        assert record["terminated"] == (not bootstraps)
    assert bytes_of(twins[0]) == bytes_of(twins[1])


@pytest.mark.parametrize("bootstraps", [True, False])
def test_a_rollout_has_the_end_by_the_time_limit_in_both_loops(bootstraps):
    config = config_of(rollout={}, learning={"bootstrap_on_time_limit": bootstraps})
    twins = [twin(config, compiled=compiled) for compiled in (True, False)]
    for each in twins:
        assert isinstance(each.agent, PQNAgent)
        each.pool.steps[0] = each.underway.steps[0] = 999
        assert next(each.steps).result.truncated.tolist() == [True]
        assert each.agent.rollout.terminated[0] == (not bootstraps)
        assert each.agent.rollout.truncated[0] == bootstraps
    assert bytes_of(twins[0]) == bytes_of(twins[1])


def test_either_loop_continues_what_the_other_began():
    config = config_of(**SETTINGS["copies of the target"])
    whole = twin(config, compiled=False)
    mixed = twin(config, compiled=True)
    count = 0
    for _ in range(6):
        count += next(mixed.steps).num_steps
    steps = interact(mixed.agent, mixed.pool, lambda n: training_start(3, n), mixed.underway)
    for _ in range(77):
        next(steps)
    loop = CompiledLoop(mixed.agent, mixed.pool, mixed.streams, config)
    steps = loop.interact(lambda n: training_start(3, n), mixed.underway)
    count += 77 + sum(next(steps).num_steps for _ in range(6))
    for _ in range(count):
        next(whole.steps)
    assert bytes_of(whole) == bytes_of(mixed)


# --- runs ---


def small_run(**sections: dict[str, Any]) -> Config:
    training = {
        "episodes": 12,
        "validation_period": 300,
        "validation_episodes": 2,
        "candidate_checkpoints": 2,
        "final_validation_episodes": 3,
        "test_episodes": 2,
        "checkpoint_seconds": 0.0,
    } | sections.pop("training", {})
    return config_of(**sections, training=training)


def train(folder: RunFolder, *, may_compile: bool, should_stop=lambda: False) -> None:
    trainer = Trainer(folder, should_stop=should_stop, may_compile=may_compile)
    try:
        trainer.run()
    finally:
        trainer.close()


def after(count: int):
    """A `should_stop` that says yes once, the `count`-th time it is asked."""
    asked = iter(range(1, 1_000_000))
    return lambda: next(asked) == count


def contents(folder: RunFolder) -> dict[str, Any]:
    """What a run wrote, without the wall clock."""
    rows = files.read_jsonl(folder.episodes)
    return {
        "episodes": [{k: v for k, v in row.items() if k != "seconds"} for row in rows],
        "updates": folder.updates.read_bytes(),
        "validations": folder.validations.read_bytes(),
        "best": {name: each.tobytes() for name, each in files.read_tensors(folder.best)[0].items()},
    }


@pytest.mark.parametrize(
    "sections",
    [
        {"replay": {"resaves": 1}},
        {"replay": {"resaves": 1}, "training": {"num_envs": 3}},
        {
            "replay": {"resaves": 1, "mirrored": True},
            "learning": {"averaging": 0.01},
            "training": {"num_envs": 3},
        },
        {"network": {"noisy": True}, "learning": {"update_period": 4}},
        {"learning": {"target": "sarsa", "n_step": 3}, "training": {"num_envs": 3}},
        {"rollout": {}, "training": {"num_envs": 3}},
    ],
)
def test_a_run_writes_the_same_with_either_loop_even_if_it_is_stopped_and_resumed(
    tmp_path, sections
):
    config = small_run(**{name: dict(values) for name, values in sections.items()})
    runs = {name: folders.create(tmp_path, config, name) for name in ("slow", "fast", "stopped")}
    train(runs["slow"], may_compile=False)
    train(runs["fast"], may_compile=True)
    for may_compile in (True, False, True, True):
        with pytest.raises(Interrupted):
            train(runs["stopped"], may_compile=may_compile, should_stop=after(4))
    train(runs["stopped"], may_compile=True)
    assert contents(runs["fast"]) == contents(runs["slow"])
    assert contents(runs["stopped"]) == contents(runs["slow"])


def test_both_loops_look_whether_to_stop_at_the_same_steps(tmp_path):
    stopped = []
    for may_compile in (True, False):
        folder = folders.create(tmp_path, small_run(), f"run-{may_compile}")
        with pytest.raises(Interrupted):
            train(folder, may_compile=may_compile, should_stop=after(7))
        state = json.loads(max(folder.path.rglob("state.json")).read_text())
        stopped.append({k: state[k] for k in ("observations", "agent", "streams", "underway")})
    assert stopped[0] == stopped[1]


# --- the module ---


@pytest.mark.parametrize("high", [1, 2, 3, 4, 7, 64, 1_000, 100_000, 2**31 + 1, 2**32 - 1])
def test_integers_are_drawn_as_numpy_draws_them(high):
    ours, numpys = default_rng(high), default_rng(high)
    for count in (3, 1, 64):  # an odd number leaves half a word for the next draw
        drawn = np.empty(count, np.int64)
        _train.integers(ours.bit_generator, high, drawn)
        assert drawn.tolist() == numpys.integers(0, high, count).tolist()
        assert ours.bit_generator.state == numpys.bit_generator.state


def test_uniform_numbers_are_drawn_as_numpy_draws_them():
    ours, numpys = default_rng(5), default_rng(5)
    drawn = np.empty(33)
    _train.random(ours.bit_generator, drawn)
    assert drawn.tolist() == numpys.random(33).tolist()
    assert ours.bit_generator.state == numpys.bit_generator.state


@pytest.mark.parametrize("count", [0, 1, 2, 3, 5, 64, 65, 2_048])
def test_permutations_are_drawn_as_numpy_draws_them(count):
    ours, numpys = default_rng(count), default_rng(count)
    for _ in range(3):
        drawn = np.empty(count, np.int64)
        _train.permutation(ours.bit_generator, drawn)
        assert drawn.tolist() == numpys.permutation(count).tolist()
        assert ours.bit_generator.state == numpys.bit_generator.state


class Arguments:
    """Arguments of `Loop.advance` for two environments, valid until one is replaced."""

    def __init__(self) -> None:
        self.config = config_of(training={"num_envs": 2}, learning={"target_period": 30})
        self.twin = twin(self.config, compiled=False)
        learner = self.twin.agent.learner
        assert isinstance(learner, FusedLearner)
        pool, underway = self.twin.pool, self.twin.underway
        self.counts = _train.Counts()
        self.counts.epsilon = 1.0
        self.pool = [pool.actions, pool.observations, pool.rewards, pool.terminated, pool.steps]
        self.episodes = [
            *(underway.observations, underway.returns),
            *(underway.steps, underway.actions),
        ]
        self.windows = list(Windows.empty(2, 1, 8))
        ring = self.twin.agent.replay.ring
        self.records = ring.storage.view(np.float32).reshape(ring.capacity, -1)
        self.priorities: np.ndarray | None = None
        state: Any = learner.state
        average = np.zeros(248, np.float32)
        self.learner = [state.online_params, state.target_params, state.mu, state.nu, average]
        self.q = np.zeros((2, 4), np.float32)

    def loop(self, mirror: Any = None, **settings: Any) -> _train.Loop:
        given = _train.Settings()
        given.max_episode_steps, given.target_period, given.averaging = 1_000, 30, 0.5
        for name, value in settings.items():
            setattr(given, name, value)
        rngs = [each.bit_generator for each in self.twin.streams]
        return _train.Loop(
            self.twin.pool.batch,
            *rngs,
            given,
            Perceptron(8, (12, 8), 4).network,
            mirror,
        )

    def advance(self, loop: _train.Loop, max_steps: int = 1) -> object:
        return loop.advance(
            max_steps,
            self.counts,
            _train.PoolArrays(*self.pool),
            _train.EpisodeArrays(*self.episodes),
            _train.WindowArrays(*self.windows),
            self.records,
            self.priorities,
            _train.LearnerArrays(*self.learner),
            self.q,
        )


@pytest.mark.parametrize(
    ("part", "index", "wrong", "complaint"),
    [
        ("pool", 0, np.zeros(3, np.int64), "actions has 3 rows, must have 2"),
        ("pool", 4, np.array([5, 0]), "environment 0 is after 5 steps, its episode after 0: must"),
        ("episodes", 1, np.zeros(1), "returns has 1 entries, must have 2"),
        ("episodes", 3, np.zeros((2, 7), np.int32), "room for the actions of an episode = 7"),
        ("windows", 2, np.zeros((2, 2)), "r_t of a window has 2 entries, must have 1"),
        ("windows", 3, np.array([0, 1]), "the window of environment 1 holds 1 steps: must be from"),
        ("learner", 0, np.zeros(9, np.float32), "online has 9 entries, must have 248"),
        ("learner", 1, None, "target = None: must be given"),
        ("learner", 3, np.zeros(9, np.float32), "nu has 9 entries, must have 248"),
        ("learner", 4, np.zeros(9, np.float32), "average has 9 entries, must have 248"),
        ("learner", 4, None, "average = None: must be given"),
    ],
)
def test_a_wrong_array_is_refused_before_anything_is_written(part, index, wrong, complaint):
    arguments = Arguments()
    getattr(arguments, part)[index] = wrong
    before = bytes_of(arguments.twin)
    with pytest.raises(ValueError, match=complaint):
        arguments.advance(arguments.loop())
    assert bytes_of(arguments.twin) == before


@pytest.mark.parametrize(
    ("network", "complaint"),
    [
        ({"num_observations": 7}, "an observation of the network has 7 entries, must have 8"),
        ({"num_actions": 3}, "a row of the network's values has 3 entries, must have 4"),
    ],
)
def test_a_network_that_the_loop_does_not_support_is_refused(network, complaint):
    shape = {"num_observations": 8, "hidden_sizes": (), "num_actions": 4} | network
    each = Arguments().twin
    rngs = [rng.bit_generator for rng in each.streams]
    with pytest.raises(ValueError, match=complaint):
        _train.Loop(each.pool.batch, *rngs, _train.Settings(), Perceptron(**shape).network)


def test_wrong_records_counts_and_settings_are_refused():
    arguments = Arguments()
    loop = arguments.loop()
    with pytest.raises(ValueError, match="max_steps = -1: must be at least 0"):
        arguments.advance(loop, -1)
    arguments.counts.added = -1
    with pytest.raises(ValueError, match="added = -1: must be at least 0"):
        arguments.advance(loop)
    arguments.counts.added = 0
    arguments.records = np.zeros((10, 20), np.float32)
    with pytest.raises(ValueError, match="a transition has 20 entries, must have 21"):
        arguments.advance(loop)
    arguments.records = np.zeros((0, 21), np.float32)
    with pytest.raises(ValueError, match="records has 0 rows, must have from 1"):
        arguments.advance(loop)
    arguments.records = np.zeros((10, 21), np.float32)
    prioritized = arguments.loop(prioritized=True)
    with pytest.raises(ValueError, match="priorities = None: must be given"):
        arguments.advance(prioritized)
    arguments.priorities = np.zeros(20)
    with pytest.raises(ValueError, match="priorities has 20 entries, must have 32"):
        arguments.advance(prioritized)
    with pytest.raises(ValueError, match="beta_duration = 0: must be at least 1"):
        arguments.loop(beta_duration=0)
    with pytest.raises(ValueError, match="batch_size = 0: must be at least 1"):
        arguments.loop(batch_size=0)
    with pytest.raises(ValueError, match="batch_size = 1048577: must be at most 1048576"):
        arguments.loop(batch_size=2**20 + 1)
    with pytest.raises(ValueError, match="schedule = 'cosine': must be constant, linear or"):
        arguments.loop(schedule="cosine")
    arguments.learner[2] = np.zeros(248)  # float64
    with pytest.raises(TypeError):
        arguments.advance(loop)


def test_a_stored_action_that_the_network_does_not_have_is_refused():
    arguments = Arguments()
    fields = arguments.twin.agent.replay.ring.storage
    fields["a_tm1"] = 4
    arguments.counts.added = len(fields)
    with pytest.raises(ValueError, match="action 4: must be from 0 to 3"):
        arguments.advance(arguments.loop(batch_size=64))


def test_a_priority_without_a_transition_is_refused():
    arguments = Arguments()
    arguments.counts.added = 100
    arguments.priorities = np.zeros(1024)
    arguments.priorities[[1, 3, 7, 15, 31, 63, 127, 255, 511, 1023]] = 1.0
    with pytest.raises(ValueError, match="a priority without a stored transition"):
        arguments.advance(arguments.loop(prioritized=True, batch_size=64))


def test_a_waiting_action_that_the_environment_does_not_have_is_refused():
    arguments = Arguments()
    arguments.windows = list(Windows.empty(2, 2, 8))
    arguments.windows[1][1, 0] = 4
    arguments.windows[3][1] = 1
    with pytest.raises(ValueError, match="window of environment 1 holds action 4: must be from 0"):
        arguments.advance(arguments.loop(n_step=2))


@pytest.mark.parametrize(
    ("mirror", "complaint"),
    [
        (([0, 1], [1.0] * 8, [0, 1, 2, 3]), "order of the mirror has 2 entries, must have 8"),
        ((range(8), [1.0] * 7, [0, 1, 2, 3]), "signs of the mirror has 7 entries, must have 8"),
        ((range(8), [1.0] * 8, [0, 1, 2, 4]), "actions of the mirror must have each number from 0"),
        (([0] * 8, [1.0] * 8, [0, 1, 2, 3]), "order of the mirror must have each number from 0"),
    ],
)
def test_a_mirror_that_is_no_symmetry_of_the_lander_is_refused(mirror, complaint):
    with pytest.raises(ValueError, match=complaint):
        Arguments().loop(mirror=mirror)


def test_a_second_thread_is_refused():
    arguments = Arguments()
    loop = arguments.loop(batch_size=64, gradient_steps=1_000)
    arguments.counts.added = 500
    refused: list[str] = []

    worker = threading.Thread(target=arguments.advance, args=(loop, 20))
    worker.start()
    while not refused and worker.is_alive():
        try:
            arguments.advance(loop, 0)  # it does nothing when it is not refused
        except RuntimeError as error:
            refused.append(str(error))
    worker.join()
    assert refused == ["another thread is stepping these landers"]
