import json
from dataclasses import replace

import pytest

from touchdown.evaluation import kept
from touchdown.evaluation.evaluation import evaluate_policy
from touchdown.policies.lookup import load

STARTS = range(3)
LANDER = "LunarLander-v3"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "touchdown"


@pytest.fixture(scope="module")
def flown():
    return evaluate_policy(load("pid"), STARTS)


def test_a_baselines_episodes_are_read_as_they_were_kept(flown):
    assert kept.read("pid", LANDER, STARTS) is None
    kept.keep(flown, STARTS)
    assert kept.read("pid", LANDER, STARTS) == flown


def test_other_starts_policies_and_environments_are_not_found(flown):
    kept.keep(flown, STARTS)
    assert kept.read("pid", LANDER, range(4)) is None
    assert kept.read("random", LANDER, STARTS) is None
    assert kept.read("pid", "CartPole-v1", STARTS) is None


def test_other_code_or_other_libraries_compute_them_again(flown, monkeypatch):
    kept.keep(flown, STARTS)
    monkeypatch.setattr(kept, "_code", lambda: "other")
    assert kept.read("pid", LANDER, STARTS) is None


def test_the_digest_of_the_code_has_its_sources_and_libraries(monkeypatch):
    before = kept._code.__wrapped__()
    assert before == kept._code.__wrapped__()
    monkeypatch.setattr(kept, "_LIBRARIES", ("numpy",))
    assert kept._code.__wrapped__() != before
    monkeypatch.setattr(kept, "_SOURCES", ("policies",))
    assert len({before, kept._code.__wrapped__()}) == 2


@pytest.mark.parametrize("damage", [b"", b"{", b'{"evaluation": 1}'])
def test_a_damaged_file_counts_as_missing(flown, folder, damage):
    kept.keep(flown, STARTS)
    (path,) = folder.rglob("*.json")
    path.write_bytes(damage)
    assert kept.read("pid", LANDER, STARTS) is None


def test_a_file_about_something_else_counts_as_missing(flown, folder):
    kept.keep(flown, STARTS)
    (path,) = folder.rglob("*.json")
    content = json.loads(path.read_bytes())
    content["evaluation"]["name"] = "heuristic"
    path.write_text(json.dumps(content))
    assert kept.read("pid", LANDER, STARTS) is None


def test_the_episodes_of_environments_that_are_not_ours_are_not_kept(flown, folder):
    kept.keep(replace(flown, env_id="CartPole-v1"), STARTS)
    assert not list(folder.rglob("*.json"))


def test_without_a_cache_folder_nothing_is_kept_and_nothing_fails(flown, tmp_path, monkeypatch):
    taken = tmp_path / "file"
    taken.touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(taken))
    kept.keep(flown, STARTS)
    assert kept.read("pid", LANDER, STARTS) is None
