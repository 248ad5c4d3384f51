import sqlite3
from dataclasses import replace

import pytest

optuna = pytest.importorskip("optuna")

from touchdown.config.config import Config  # noqa: E402
from touchdown.config.presets import preset  # noqa: E402
from touchdown.core.errors import Interrupted, UserError  # noqa: E402
from touchdown.studies import search  # noqa: E402
from touchdown.studies.executors import Event  # noqa: E402
from touchdown.studies.plan import FIRST_TUNING_SEED  # noqa: E402
from touchdown.studies.search import storage_errors  # noqa: E402
from touchdown.studies.space import Choice, Range, space_of  # noqa: E402
from touchdown.studies.store import open_store  # noqa: E402

BASE = preset("vector-dqn")
SPACE = space_of(BASE)


class Pretender:
    """Does nothing, and counts what it was given: one job at a time, so a trial is seed by seed."""

    workers = 1

    def __init__(self) -> None:
        self.given: list[Config] = []

    def run(self, jobs, _store, on_event, should_stop) -> None:
        if should_stop():
            raise Interrupted
        for job in jobs:
            self.given.append(job.config)
            on_event(Event(job.digest, "started"))
            on_event(Event(job.digest, "done"))


@pytest.fixture
def store(tmp_path):
    return open_store(tmp_path / "results", make=True)


@pytest.fixture
def better_with_a_low_rate(monkeypatch):
    """A run is worth more the lower its learning rate, and nothing else matters."""

    def return_of(job, _store, **_) -> float:
        return -1e6 * job.config.learning.learning_rate

    monkeypatch.setattr(search, "_return_of", return_of)


def new_study(store, name: str = "mine"):
    return search.open_study(search.storage_url(store), name, 0)


@pytest.mark.usefixtures("better_with_a_low_rate")
def test_a_trial_has_seeds_that_no_study_reports_and_only_searched_settings_change(store):
    executor = Pretender()
    found = search.search(new_study(store), BASE, SPACE, store, executor, trials=1, seeds=3)
    assert [config.seed for config in executor.given] == [FIRST_TUNING_SEED + i for i in range(3)]
    assert all(config.training.test_episodes == 0 for config in executor.given)
    assert found.trials == 1
    assert set(found.changed) == set(space_of(BASE))
    back = replace(
        found.best,
        preset=BASE.preset,
        learning=BASE.learning,
        exploration=BASE.exploration,
        replay=BASE.replay,
    )
    assert back == BASE


@pytest.mark.usefixtures("better_with_a_low_rate")
def test_the_best_is_kept_what_mattered_is_known_and_the_hopeless_are_pruned(store):
    executor = Pretender()
    found = search.search(new_study(store), BASE, SPACE, store, executor, trials=30, seeds=3)
    assert found.trials == 30
    assert 0 < found.pruned < 25
    # the pruned ones were spared two of their three seeds
    assert len(executor.given) == 3 * 30 - 2 * found.pruned
    assert found.value == pytest.approx(-1e6 * found.best.learning.learning_rate)
    best = min(config.learning.learning_rate for config in executor.given)
    assert found.best.learning.learning_rate == best
    assert max(found.importance, key=lambda name: found.importance[name]) == (
        "learning.learning_rate"
    )
    assert sum(found.importance.values()) == pytest.approx(1)


@pytest.mark.usefixtures("better_with_a_low_rate")
def test_a_search_that_was_stopped_tries_again_what_was_under_way(store):
    left = new_study(store).ask()
    drawn = {name: of.suggest(left, name) for name, of in space_of(BASE).items()}
    executor = Pretender()
    search.search(new_study(store), BASE, SPACE, store, executor, trials=1, seeds=1)
    assert executor.given[0].learning.learning_rate == drawn["learning.learning_rate"]


@pytest.mark.usefixtures("better_with_a_low_rate")
def test_stopping_keeps_the_trials_that_were_made(store):
    executor = Pretender()
    study = new_study(store)
    with pytest.raises(Interrupted):
        search.search(
            study,
            BASE,
            SPACE,
            store,
            executor,
            trials=9,
            seeds=1,
            should_stop=lambda: len(executor.given) >= 2,
        )
    again = search.search(new_study(store), BASE, SPACE, store, Pretender(), trials=3, seeds=1)
    assert again.trials == 3


def test_a_run_that_failed_is_worth_what_nobody_wants(store):
    class Failing(Pretender):
        def run(self, jobs, _store, on_event, _should_stop) -> None:
            for job in jobs:
                on_event(Event(job.digest, "failed", text="it diverged"))

    found = search.search(new_study(store), BASE, SPACE, store, Failing(), trials=1, seeds=1)
    assert found.value == -1_000


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("sqlite:////no/such/place.db", "cannot be used: unable to open database file"),
        ("sqlite://", "must name a file"),
        ("sqlite:///%3Amemory%3A", "must name a file"),
        ("", "cannot be used: must be a URL"),
        ("nosuch://h/x", "cannot be used: "),
    ],
)
def test_a_storage_that_cannot_be_opened_is_named(url, said):
    with pytest.raises(UserError, match=f"^storage = '{url}': {said}"):
        search.open_study(url, "mine", 0)


def test_a_file_that_is_no_storage_is_refused_and_left_as_it_is(store):
    file = store.path / "search.sqlite3"
    file.write_bytes(b"SQLite format 3\0" + b"x" * 200)
    before = file.read_bytes()
    with pytest.raises(UserError, match=r"search\.sqlite3': cannot be used: file is not a"):
        new_study(store)
    assert file.read_bytes() == before


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("postgresql://me:s3cret@nowhere/x", "postgresql://me:***@nowhere/x"),
        ("postgresql://me@nowhere/x?password=s3cret", "postgresql://me@nowhere/x"),
        ("postgresql://me:s3cret@nowhere:abc/x", "postgresql:…"),
        ("postgresql://me:s3cret/x", "postgresql:…"),  # read as a port
        ("postgresql:/me:s3cret@nowhere/x", "postgresql:…"),
        ("s3cret@nowhere", "…"),
    ],
)
def test_a_storages_password_is_not_shown(url, shown):
    with pytest.raises(UserError) as refused:
        search.open_study(url, "mine", 0)
    assert str(refused.value).startswith(f"storage = {shown!r}: cannot be used: ")
    assert "s3cret" not in str(refused.value)


@pytest.mark.parametrize("option", ["timeout=abc", "check_same_thread=maybe"])
def test_a_storages_option_that_its_driver_cannot_read_is_one_line(option, tmp_path):
    with pytest.raises(UserError, match=r"x\.db': cannot be used: \S"):
        search.open_study(f"sqlite:///{tmp_path}/x.db?{option}", "mine", 0)


def test_a_missing_package_of_a_search_is_not_taken_for_its_storage_s():
    with pytest.raises(ImportError, match="theirs"), storage_errors("sqlite:///x"):
        raise ImportError("theirs")


def test_a_storage_that_another_process_keeps_locked_is_one_line(store, monkeypatch):
    new_study(store)
    monkeypatch.setattr(search, "_PATIENCE", 0.1)
    url = search.storage_url(store)
    study = new_study(store)
    other = sqlite3.connect(store.path / "search.sqlite3")
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(UserError, match="cannot be used: database is locked"), storage_errors(url):
        search.search(study, BASE, SPACE, store, Pretender(), trials=1, seeds=1)
    other.close()


def test_what_lies_just_below_one_is_searched_by_its_distance_from_it():
    trial = optuna.trial.FixedTrial({"gamma": 0.01, "nodes": 30, "batch": 64})
    assert Range(1e-3, 0.1, log=True, from_one=True).suggest(trial, "gamma") == 0.99
    assert Range(10, 100, whole=True).suggest(trial, "nodes") == 30
    assert Choice((32, 64)).suggest(trial, "batch") == 64


def test_the_space_is_of_what_the_agent_has():
    assert "replay.resaves" in space_of(preset("paper-best"))
    assert "replay.resaves" not in space_of(preset("target-dqn"))
    assert "rollout.epochs" in space_of(preset("swift"))
    with pytest.raises(UserError, match="algorithm = 'tabular'"):
        space_of(preset("tabular-q"))
