"""The verb `play`: the policies on the page, its file, and the browser."""

import json
import os
import re
import shutil
import webbrowser
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import touchdown
from command_line import complaint
from touchdown.agents.qtable import QTable
from touchdown.agents.states import states_of
from touchdown.cli import app
from touchdown.config.sections import TableConfig
from touchdown.control.pid import PIDPolicy
from touchdown.envs import environment
from touchdown.policies.baselines import RandomPolicy, read_pid, shipped_pid
from touchdown.policies.named import NamedPolicy
from touchdown.policies.weights import load_weights


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


def part_of(page: Path, element: str):
    found = re.search(rf'id="{element}">(.*?)</script>', page.read_text("utf-8"))
    assert found
    return json.loads(found[1])


def policies_of(page: Path) -> dict[str, dict]:
    return {each["name"]: each for each in part_of(page, "data")["policies"]}


def weights_of(page: Path, name: str) -> NamedPolicy:
    content = part_of(page, "binaries")[policies_of(page)[name]["file"]]
    path = page.parent / f"{name}.safetensors"
    path.write_bytes(b64decode(content))
    return load_weights(path)


def write_gains(path: Path, kp_vertical: float):
    gains = {"ki_vertical": -2, "kp_angle": 0.25, "kd_angle": 3, "dead_band": 0.1}
    lines = [f"{name} = {value}\n" for name, value in {"kp_vertical": kp_vertical, **gains}.items()]
    path.write_text("rule = 'absolute'\n" + "".join(lines))


def test_a_page_offers_the_shipped_policies_and_controllers_after_those_named(run):
    page = touchdown.play(run, "random", seed=3)
    assert page == Path("playground.html")
    assert list(policies_of(page)) == ["pilot-0", "random", "ace", "pid", "heuristic"]
    assert part_of(page, "data")["seed"] == 3
    assert set(part_of(page, "binaries")) == {
        *("lander.wasm", "pilot-0.safetensors", "ace.safetensors")
    }


def test_the_weights_on_a_page_are_those_of_the_run_however_it_is_given(run):
    seen = np.random.default_rng(0).normal(size=(20, 8)).astype(np.float32)
    expected = run.policy.policy.values(seen)
    for number, given in enumerate((run, run.policy, run.folder.best, str(run.path))):
        page = touchdown.play(given, out=f"{number}.html")
        found = weights_of(page, next(iter(policies_of(page))))
        assert_array_equal(found.policy.values(seen), expected)
        assert found.env_id == "LunarLander-v3"
        assert found.reward_scale == run.config.learning.reward_scale


def test_a_run_with_a_name_that_is_no_text_is_on_the_page_under_a_printable_one(run, tmp_path):
    name = os.fsdecode(b"\xff</script>\x1b[31m").replace("/", "")
    shutil.copytree(run.path, tmp_path / "runs" / name)
    shown, *_ = policies_of(touchdown.play(name))
    shown.encode()
    assert shown.endswith("<script>␛[31m")


def test_gains_on_a_page_are_those_of_the_file():
    write_gains(Path("mine.toml"), kp_vertical=1.5)
    offered = policies_of(touchdown.play("mine.toml"))
    assert offered["mine"]["gains"] == {
        name: getattr(read_pid(Path("mine.toml")), name) for name in offered["mine"]["gains"]
    }
    assert offered["mine"]["gains"]["kp_vertical"] == 1.5
    assert offered["pid"]["gains"]["kp_vertical"] == shipped_pid().kp_vertical


def test_a_policy_of_ones_own_takes_the_place_of_a_shipped_one_with_its_name():
    mine = NamedPolicy("ace", PIDPolicy(shipped_pid("absolute")), "LunarLander-v3")
    offered = policies_of(touchdown.play(mine))
    assert list(offered) == ["ace", "pid", "heuristic"]
    assert offered["ace"]["kind"] == "pid"


def test_policies_of_one_name_are_numbered_and_the_same_one_is_offered_once():
    for kind, gain in [("a", 1.5), ("b", 2.5)]:
        Path(kind).mkdir()
        write_gains(Path(kind, "best.toml"), kp_vertical=gain)
    offered = policies_of(touchdown.play("a/best.toml", "b/best.toml", "a/best.toml"))
    assert list(offered) == ["best", "best-2", "ace", "pid", "heuristic"]
    assert [offered[name]["gains"]["kp_vertical"] for name in ("best", "best-2")] == [1.5, 2.5]


def test_policies_that_a_browser_cannot_fly_are_refused_in_one_line():
    bins = TableConfig(bins=(2,) * 8)
    table = QTable(states_of(bins, environment.spaces_of("LunarLander-v3")), 4, bins)
    cases = [
        ("ppo.zip", "policy 'ppo.zip': a .zip file cannot fly in a browser; must be a run"),
        ("model.onnx", "policy 'model.onnx': a .onnx file cannot fly in a browser"),
        ("nobody", "policy 'nobody': unknown"),
        (3, "policy '3': unknown"),
        (NamedPolicy("cart", RandomPolicy(2), "CartPole-v1"), "policy 'cart': acts in CartPole-v1"),
        (NamedPolicy("you", RandomPolicy(4), "LunarLander-v3"), "policy 'you': the page gives"),
        (
            NamedPolicy("table", table.policy(np.zeros(table.shape).ravel()), "LunarLander-v3"),
            "policy 'table': cannot fly in a browser; must be a network",
        ),
    ]
    for policy, said in cases:
        with pytest.raises(touchdown.UserError) as error:
            touchdown.play(policy)
        assert str(error.value).startswith(said)
        assert "\n" not in str(error.value)
    assert not Path("playground.html").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out=play.gif"], "out 'play.gif': must end in .html or .htm"),
        (["--out=no/play.html"], "out 'no/play.html': its folder does not exist"),
        (["--seed=-1"], "seed = -1: must be from 0 to 2147483647"),
        (["heuristik"], "policy 'heuristik': unknown; did you mean heuristic?"),
    ],
)
def test_a_wrong_word_is_refused_before_anything_is_written(words, said, capsys, tmp_path):
    assert complaint("play", *words, capsys=capsys) == said
    assert list(tmp_path.iterdir()) == []


def test_only_an_earlier_playground_is_replaced_without_force(capsys):
    touchdown.play(seed=1)
    touchdown.play(seed=2)
    assert part_of(Path("playground.html"), "data")["seed"] == 2
    Path("playground.html").write_text("mine")
    assert "exists already" in complaint("play", capsys=capsys)
    touchdown.play(out="other.html")
    assert "exists already" in complaint("play", "--out=other.html", capsys=capsys)
    assert Path("playground.html").read_text() == "mine"
    touchdown.play(force=True)
    assert Path("playground.html").read_text() != "mine"


def test_the_browser_opens_the_page_where_there_is_a_display(monkeypatch, capsys, tmp_path):
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr("touchdown.core.browser.has_display", lambda: False)
    app.main(["play"])
    assert capsys.readouterr().out == "  playground.html\n"
    monkeypatch.setattr("touchdown.core.browser.has_display", lambda: True)
    app.main(["play", "--no-browser"])
    assert opened == []
    app.main(["play", "--seed=9"])
    assert opened == [(tmp_path / "playground.html").as_uri()]
