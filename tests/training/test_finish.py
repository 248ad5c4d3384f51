from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from finished_runs import write_validations
from saved_policies import save_model
from touchdown.agents.networks import QNetwork
from touchdown.config.presets import preset
from touchdown.config.sections import NetworkConfig
from touchdown.core import files
from touchdown.core.errors import Interrupted
from touchdown.core.helper import Helper
from touchdown.envs.flight import load_flights, save_flights
from touchdown.envs.recorder import record_flight
from touchdown.evaluation.evaluation import median_start, write_evaluations
from touchdown.evaluation.evaluator import Evaluator
from touchdown.evaluation.paths import load_paths, save_paths
from touchdown.figures import flights as figures
from touchdown.figures import style
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.lookup import load
from touchdown.render.film import write_mp4
from touchdown.runs import folder as folders
from touchdown.runs.rows import EpisodeRow
from touchdown.runs.run import CURVE, Run
from touchdown.training import finish

BASE = preset("pilot")
CONFIG = replace(
    BASE,
    network=NetworkConfig(hidden_sizes=(4,)),
    training=replace(BASE.training, test_episodes=3),
)


@pytest.fixture
def run(tmp_path):
    """A run of the lander, trained to its end: its weights are random."""
    folder = folders.create(tmp_path, CONFIG, "made-up")
    network = QNetwork(8, 4, CONFIG.network)
    params = np.random.default_rng(0).normal(size=network.num_params).astype(np.float32)
    save_model(folder.best, network, params, {"observations": 1}, CONFIG)
    return Run(folder)


@pytest.fixture
def rollouts(monkeypatch, tmp_path):
    """How many starts each rollout flies; nothing was kept by an earlier one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    flown = []
    original = Evaluator.rollout

    def counted(self, policy, starts, *rest, **named):
        flown.append(len(starts))
        return original(self, policy, starts, *rest, **named)

    monkeypatch.setattr(Evaluator, "rollout", counted)
    return flown


def test_the_test_starts_are_flown_once_and_the_paths_are_recorded_on_the_way(run, rollouts):
    phases = []
    tested = finish.fly_test(run, keep_paths=True, on_phase=lambda *phase: phases.append(phase))
    assert rollouts == [3]
    assert phases == [("testing on 3 starts, policies: 1", 3)]
    policy = run.policy
    paths = load_paths(run.folder.paths)
    assert list(paths) == [episode.seed for episode in tested[0].episodes]
    for start, path in paths.items():
        flight = record_flight(policy.policy, policy.env_id, start, "x")
        assert_array_equal(path, flight.observations[:, :2])
    assert finish.fly_test(run, keep_paths=True) == tested
    assert rollouts == [3]


def test_baselines_and_the_last_weights_are_flown_beside_the_chosen_checkpoint(run, rollouts):
    last = load("random")
    tested = finish.fly_test(run, baselines=("pid", "random"), last=last)
    assert rollouts == [3] * 4
    assert [evaluation.name for evaluation in tested] == ["made-up", "pid", "random"]
    assert (run.path / finish.LAST).is_file()
    assert not run.folder.paths.exists()
    run.folder.evaluation.unlink()
    again = finish.fly_test(run, baselines=("pid", "random"))
    assert rollouts == [3] * 5  # the baselines were kept
    assert again == tested


def test_a_helper_flies_the_last_starts_and_films_the_same(run, rollouts):
    alone = finish.fly_test(run)
    run.folder.evaluation.unlink()
    write_validations(run.path, ((0, 0.0), (1_000, 250.0)))
    row = EpisodeRow(
        episode=1, env_steps=1_000, episode_return=9.0, steps=1_000, outcome="crashed", epsilon=0.1,
        seconds=1.0,
    )  # fmt: skip
    run.folder.episodes.write_bytes(files.to_json_line(row))
    episodes: list[None] = []
    with closing(Helper()) as helper:
        together = finish.fly_test(run, helper=helper, on_episode=lambda: episodes.append(None))
        assert rollouts == [3, 1]  # two of the starts were flown elsewhere
        assert len(episodes) == 3
        assert together == alone
        recorded = finish.record_flights(run, together[0], 2)
        of = {"flights": str(run.folder.flights)}
        film, figure = run.path / "theirs.mp4", run.path / "theirs.png"
        chores = "touchdown.training.chores"
        helper.result(helper.start(f"{chores}:film", **of, out=str(film)))
        helper.result(helper.start(f"{chores}:figure", **of, out=str(figure), title="Both"))
        helper.result(helper.start(f"{chores}:curve", run=str(run.path), title="Its curve"))
    write_mp4(recorded.median, run.path / "ours.mp4")
    assert film.read_bytes() == (run.path / "ours.mp4").read_bytes()
    figures.save_flights(run.path / "ours.png", recorded.beside, "Both")
    assert figure.read_bytes() == (run.path / "ours.png").read_bytes()
    curve = (run.path / CURVE).read_bytes()
    finish.save_curve(run, "Its curve")
    assert curve == (run.path / CURVE).read_bytes()


def test_what_a_helper_fails_to_fly_is_flown_here(run, rollouts):
    alone = finish.fly_test(run)
    run.folder.evaluation.unlink()
    helper = Helper()
    helper.close()
    assert finish.fly_test(run, helper=helper) == alone
    assert rollouts == [3, 1, 2]


def test_paths_that_an_earlier_version_did_not_keep_are_added(run, rollouts):
    finish.fly_test(run)
    before = run.folder.evaluation.read_bytes()
    finish.fly_test(run, keep_paths=True)
    assert rollouts == [3, 3]
    assert len(load_paths(run.folder.paths)) == 3
    assert run.folder.evaluation.read_bytes() == before


def test_a_test_that_is_stopped_leaves_nothing_half_written(run):
    def stop():
        raise Interrupted

    with pytest.raises(Interrupted):
        finish.fly_test(run, keep_paths=True, on_episode=stop)
    assert not run.folder.paths.exists()
    assert not run.folder.evaluation.exists()


def test_the_flight_of_the_median_return_is_recorded_first(run):
    (tested,) = finish.fly_test(run)
    recorded = finish.record_flights(run, tested, num_beside=2)
    first, *beside = load_flights(run.folder.flights)
    assert first.seed == recorded.median.seed == median_start(tested)
    assert first.episode_return == sorted(e.episode_return for e in tested.episodes)[1]
    assert [flight.policy for flight in beside] == ["made-up"] * 2 + ["pid"] * 2


def test_the_pid_flies_beside_an_agent_in_the_agents_variant(tmp_path):
    windy = "touchdown/LunarLanderWindy-v3"
    config = replace(CONFIG, env_id=windy)
    folder = folders.create(tmp_path, config, "windy")
    network = QNetwork(8, 4, config.network)
    save_model(folder.best, network, np.zeros(network.num_params, np.float32), {}, config)
    run = Run(folder)
    (tested,) = finish.fly_test(run)
    finish.record_flights(run, tested, num_beside=1)
    assert {flight.env_id for flight in load_flights(folder.flights)} == {windy}


def test_without_a_test_nothing_is_flown(tmp_path):
    untested = replace(CONFIG, training=replace(CONFIG.training, test_episodes=0))
    assert finish.fly_test(Run(folders.create(tmp_path, untested, "untested"))) == []


def test_an_evaluators_observer_sees_every_observation_of_every_episode():
    pid = load("pid")
    seen = {}

    def observe(places, observations):
        for place, observation in zip(places, observations, strict=True):
            seen.setdefault(int(place), []).append(observation.copy())

    starts = [5, 6, 7]
    with closing(Evaluator(pid.env_id, 2)) as evaluator:
        results = evaluator.rollout(pid.policy, starts, observer=observe)
    for place, result in enumerate(results):
        assert len(seen[place]) == result.steps + 1
        flight = record_flight(pid.policy, pid.env_id, starts[place], "x")
        assert_array_equal(seen[place], flight.observations)


@pytest.mark.parametrize(
    "write",
    [
        lambda path: save_flights(path, []),
        lambda path: save_paths(path, {}),
        lambda path: write_evaluations(path, [], WeightsFacts()),
        lambda path: style.save(style.new_figure(1, 1), path, follow=False),
    ],
)
def test_a_runs_own_files_replace_links(tmp_path, write):
    (tmp_path / "thesis").write_text("mine")
    (tmp_path / "own.png").symlink_to("thesis")
    write(tmp_path / "own.png")
    assert (tmp_path / "thesis").read_text() == "mine"
    assert not (tmp_path / "own.png").is_symlink()
