import json
import re
import runpy
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from markdown import markdown as to_html
from PIL import Image

import touchdown
from saved_policies import save_model
from shown import Shown
from touchdown.agents.initial import initial_params
from touchdown.agents.models import network_to_act
from touchdown.agents.qtable import QTable
from touchdown.agents.states import OneHot
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.core import files, installation
from touchdown.core.terminal import printable, printable_line
from touchdown.envs import environment
from touchdown.evaluation import evaluation as evaluations
from touchdown.exports import agreement
from touchdown.exports.export import CARD
from touchdown.policies import lookup
from touchdown.policies import weights as policy_weights
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.foreign.onnx_session import Session
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run


def made(
    runs_dir: Path, preset: str = "pilot", *, env_id: str | None = None, evaluated: bool = True
) -> Run:
    """A run as training leaves it, but with untrained weights."""
    config = presets.preset(preset)
    config = replace(config, env_id=env_id or config.env_id)
    if config.algorithm == "dqn":
        config = replace(config, network=replace(config.network, hidden_sizes=(8,)))
    folder = folders.create(runs_dir, config)
    model, params = fresh(config)
    facts = WeightsFacts(env_steps=12_345, validation_return=1.5)
    save_model(folder.best, model, params, facts, config)
    run = Run(folder)
    if evaluated:
        flown = evaluations.evaluate_policy(run.policy, range(3))
        evaluations.write_evaluations(folder.evaluation, [flown], facts)
    return run


def fresh(config: Config):
    if config.algorithm == "tabular":
        table = QTable(OneHot(16), 4, config.table)
        return table, np.random.default_rng(0).normal(size=64)
    spaces = environment.spaces_of(config.env_id)
    network = network_to_act(config.network, spaces)
    return network, initial_params(network.layout, 3)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    return made(tmp_path_factory.mktemp("runs"))


@pytest.fixture(scope="module")
def exported(run, tmp_path_factory):
    return touchdown.export(run, out=tmp_path_factory.mktemp("out") / "here" / "mine")


def header(card: str) -> dict:
    return yaml.safe_load(card.split("---\n")[1])


def test_an_export_holds_the_model_its_card_and_an_example(exported):
    assert [path.name for path in exported.files] == ["pilot-0.onnx", "fly_onnx.py", "README.md"]
    assert sorted(exported.files) == sorted(exported.folder.iterdir())
    assert exported.agreement.observations == 10_000
    assert exported.agreement.differing <= exported.agreement.close < 1_000


def test_the_model_flies_as_the_run_does(run, exported):
    model = exported.files[0]
    ours = touchdown.evaluate(run, episodes=4)
    theirs = touchdown.evaluate(model, episodes=4)
    assert theirs.episodes == ours.episodes
    assert (theirs.name, theirs.env_id) == ("pilot-0", "LunarLander-v3")
    flight = touchdown.fly(model, seed=2)
    assert flight.episode_return == pytest.approx(ours.episodes[2].episode_return)


def test_the_metadata_of_the_model_name_its_run(run, exported):
    metadata = Session(exported.files[0].read_bytes()).metadata
    assert json.loads(metadata.pop("network"))["hidden_sizes"] == [8]
    assert metadata == {
        "env_id": "LunarLander-v3",
        "run": "pilot-0",
        "preset": "pilot",
        "seed": "0",
        "config_digest": run.config.digest,
        "touchdown": touchdown.__version__,
    }


def test_the_example_flies_it_without_touchdown(run, exported):
    code = (
        "import sys, runpy\n"
        "sys.modules['touchdown'] = None\n"  # importing it fails
        f"sys.argv = [{str(exported.folder / 'fly_onnx.py')!r}, '--episodes', '3']\n"
        "runpy.run_path(sys.argv[0], run_name='__main__')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    flown = touchdown.evaluate(run, episodes=3).episodes
    assert done.stdout.splitlines() == [
        f"start {episode.seed}: return {episode.episode_return:.1f}" for episode in flown
    ]


def test_the_example_of_a_variant_flies_stock_with_its_settings(tmp_path):
    run = made(tmp_path / "runs", env_id="touchdown/LunarLanderWindy-v3")
    exported = touchdown.export(run, out=tmp_path / "out")
    card = (exported.folder / CARD).read_text()
    assert "Trained and tested with `enable_wind=True` and otherwise Gymnasium's defaults" in card
    flown = touchdown.evaluate(exported.files[0], episodes=1)
    assert flown.env_id == run.config.env_id
    example = [sys.executable, "-I", str(exported.folder / "fly_onnx.py"), "--episodes", "1"]
    done = subprocess.run(example, capture_output=True, text=True, check=True)
    assert done.stdout == f"start 0: return {flown.episodes[0].episode_return:.1f}\n"


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [(["--help"], 0, "usage: fly_onnx.py"), (["no.onnx"], 2, "model no.onnx: no such file")],
)
def test_the_example_has_a_help_and_refuses_in_one_line(
    exported, monkeypatch, capsys, arguments, code, said
):
    monkeypatch.setattr(sys, "argv", ["fly_onnx.py", *arguments])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(exported.folder / "fly_onnx.py"), run_name="__main__")
    assert ended.value.code == code
    printed = capsys.readouterr()
    assert said in (printed.err if code else printed.out)


def test_the_card_has_the_results_for_people_and_for_machines(run, exported):
    card = (exported.folder / "README.md").read_text("utf-8")
    summary = run.evaluation.summary
    top = header(card)
    assert top["library_name"] == "touchdown"
    assert {"LunarLander-v3", "deep-reinforcement-learning", "reinforcement-learning"} <= set(
        top["tags"]
    )
    (entry,) = top["model-index"]
    (result,) = entry["results"]
    assert entry["name"] == "pilot-0"
    assert result["task"]["type"] == "reinforcement-learning"
    assert result["dataset"] == {"name": "LunarLander-v3", "type": "LunarLander-v3"}
    metrics = {metric["type"]: metric["value"] for metric in result["metrics"]}
    assert metrics == {
        "mean_reward": f"{summary.mean_return:.1f} +/- {summary.sd_return:.1f}",
        "n_eval_episodes": 3,
    }
    assert f"| return, mean ± sd | {summary.mean_return:.1f} ± {summary.sd_return:.0f} |" in card
    assert f"| crashed | {summary.outcomes.get('crashed', 0):.0%} |" in card
    assert "| share ≥ 200 | 0% |" in card
    assert "3 greedy episodes on stock Gymnasium, from environment seeds 0 to 2" in card
    assert str(exported.agreement) in card
    assert "hidden_sizes = [\n    8,\n]" in card
    assert f"config digest: {run.config.digest}" in card
    assert "after 12,345 environment steps" in card
    assert f"trained with: touchdown {touchdown.__version__}, gymnasium " in card


def test_the_card_says_what_a_user_must_know_and_shows_a_film(tmp_path):
    run = made(tmp_path)
    Image.new("RGB", (6, 4)).save(run.path / "flight.gif")
    export = touchdown.export(run, "safetensors", out=tmp_path / "out")
    assert [path.name for path in export.files] == ["pilot-0.safetensors", "flight.gif", CARD]
    card = (export.folder / CARD).read_text("utf-8")
    assert "![A test episode of pilot-0](flight.gif)" in card
    headings = [line[3:] for line in card.splitlines() if line.startswith("## ")]
    assert headings == [
        "Results", "Observations and actions", "Limits", "Use", "Settings", "Provenance", "Licence"
    ]  # fmt: skip
    assert "None is stated: whoever publishes this policy chooses one" in card
    assert "license" not in header(card)
    assert "performance with wind" in card


def test_the_names_on_a_card_are_text(tmp_path):
    name = (
        "<script>alert(1)\n```\n---\n# [x](javascript:2) | `a` $x_{$ \"'&lt; {{ 7 }} \x1b \udcff ;"
    )
    run = made(tmp_path)
    run.folder.provenance.write_text(files.to_json({"git_commit": printable(name)}))
    run = Run(RunFolder(run.path.rename(tmp_path / name)))
    export = touchdown.export(run, "safetensors", out=tmp_path / "out")
    card = (export.folder / CARD).read_text("utf-8")
    (entry,) = header(card)["model-index"]
    assert entry["name"] == printable(name)
    read = Shown(to_html(card.split("---\n", 2)[2], extensions=["tables", "fenced_code", "toc"]))
    seen = " ".join(printable_line(name).split())
    assert f"run: {seen}\n" in read.text
    assert f"source: {seen}\n" in read.text
    assert seen in " ".join(read.text.split("Results")[0].split())
    assert f"{seen}.safetensors is a safetensors file" in read.text
    assert [read.tags.count(tag) for tag in ("h1", "h2", "script", "a")] == [1, 7, 0, 0]
    commands = re.search(r"touchdown evaluate (.*?)\ntouchdown fly", read.text, re.DOTALL)
    assert shlex.split(commands[1]) == [printable(f"{name}.safetensors")]


def test_a_run_without_test_flights_has_a_card_that_says_so(tmp_path):
    run = made(tmp_path, evaluated=False)
    export = touchdown.export(run, "safetensors", out=tmp_path / "out")
    card = (export.folder / "README.md").read_text("utf-8")
    assert "model-index" not in header(card)
    assert "This policy was exported before its test episodes" in card


def test_exported_safetensors_equal_the_weights_of_the_run(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    export = touchdown.export(run.name, "safetensors", runs_dir=run.path.parent)
    assert export.folder == Path("pilot-0-safetensors")
    assert [path.name for path in export.files] == ["pilot-0.safetensors", "README.md"]
    assert export.files[0].read_bytes() == run.folder.best.read_bytes()
    assert export.agreement is None
    card = export.files[1].read_text("utf-8")
    assert header(card)["model-index"][0]["name"] == "pilot-0"
    assert "touchdown fly pilot-0.safetensors" in card


def test_a_table_is_exported_too(tmp_path, monkeypatch):
    monkeypatch.setattr(agreement, "OBSERVATIONS", 500)
    run = made(tmp_path / "runs", "tabular-q")
    export = touchdown.export(run, out=tmp_path / "out")
    assert export.agreement.differing == 0
    assert touchdown.evaluate(export.files[0], episodes=3).episodes == run.evaluation.episodes


def test_a_shipped_policy_is_exported_with_test_flights_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(agreement, "OBSERVATIONS", 500)
    config = presets.preset("ace")
    short = replace(config, training=replace(config.training, test_episodes=3))
    monkeypatch.setattr(presets, "preset", lambda _name: short)
    export = touchdown.export("ace")
    assert export.folder == Path("ace-onnx")
    assert export.agreement.differing <= export.agreement.close
    card = export.files[-1].read_text("utf-8")
    facts = header(card)["model-index"][0]["results"][0]["metrics"]
    assert facts[1]["value"] == 3
    assert header(card)["license"] == "mit"
    with Image.open(export.folder / "flight.gif") as film:
        assert film.n_frames > 30
    assert "trained with:" not in card
    assert touchdown.evaluate(export.files[0], episodes=3).summary.mean_return == pytest.approx(
        touchdown.evaluate("ace", episodes=3).summary.mean_return
    )


def test_a_shipped_policy_has_the_network_of_its_preset():
    shipped = [path for path in lookup.SHIPPED.iterdir() if path.suffix == ".safetensors"]
    assert shipped
    for weights in shipped:
        found = policy_weights.read_weights(weights)
        assert found.model.config == presets.preset(weights.stem).network


def test_a_run_takes_precedence_over_a_shipped_policy_of_the_same_name(tmp_path):
    run = made(tmp_path / "runs", "pilot")
    run.path.rename(tmp_path / "runs" / "ace")
    export = touchdown.export("ace", "safetensors", runs_dir=tmp_path / "runs", out=tmp_path / "a")
    assert "preset `pilot`" in (export.folder / "README.md").read_text("utf-8")


def test_an_existing_file_or_folder_is_not_overwritten(run, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years of work")
    (tmp_path / "file").write_text("mine")
    for out in (tmp_path / "mine", tmp_path / "file", tmp_path):
        with pytest.raises(touchdown.UserError, match="exists already; choose another, or replace"):
            touchdown.export(run, out=out)
    with pytest.raises(touchdown.UserError, match="cannot be written"):
        touchdown.export(run, "safetensors", out=tmp_path / "file" / "inside")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["file", "mine", "thesis.txt"]


def test_a_model_that_acts_differently_is_not_written(run, tmp_path, monkeypatch):
    monkeypatch.setattr(agreement, "OBSERVATIONS", 100)
    monkeypatch.setattr("touchdown.exports.graph._activated", lambda _graph, x, _name: x)
    with pytest.raises(touchdown.UserError, match=r"of 100 actions differ.*nothing is written"):
        touchdown.export(run, out=tmp_path / "out")
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_nothing_behind(run, tmp_path, monkeypatch):
    def full(*_args) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(touchdown.UserError, match="cannot be written: No space left on device"):
        touchdown.export(run, "safetensors", out=tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("missing", ["onnx", "onnxruntime"])
def test_without_the_extra_it_says_what_to_install(run, tmp_path, monkeypatch, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(touchdown.UserError) as said:
        touchdown.export(run, out=tmp_path / "out")
    assert str(said.value) == (
        f"format 'onnx': needs {missing}, which is not installed; choose --format safetensors, "
        f"or install it: {installation.command_for('onnx')}"
    )
    assert not list(tmp_path.iterdir())
    touchdown.export(run, "safetensors", out=tmp_path / "out")  # needs neither


def test_a_run_without_weights_and_an_unknown_format_are_refused(run, tmp_path):
    folder = folders.create(tmp_path, presets.preset("pilot"))
    with pytest.raises(touchdown.UserError, match="has no weights before its first validation"):
        touchdown.export(Run(folder), out=tmp_path / "out")
    with pytest.raises(touchdown.UserError, match="format 'tflite': must be one of onnx, safet"):
        touchdown.export(run, "tflite", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_run_with_a_broken_record_is_refused(tmp_path):
    run = made(tmp_path / "runs", evaluated=False)
    run.folder.provenance.write_text("{")
    with pytest.raises(touchdown.UserError, match=r"provenance\.json: not JSON"):
        touchdown.export(run, "safetensors", out=tmp_path / "out")
    run.folder.provenance.write_text(files.to_json({"versions": 3}))
    with pytest.raises(touchdown.UserError, match=r"versions = 3: must be an object"):
        touchdown.export(run, "safetensors", out=tmp_path / "out")
    run.folder.provenance.write_text("{}")
    touchdown.export(run, "safetensors", out=tmp_path / "out")
    assert "trained with:" not in (tmp_path / "out" / "README.md").read_text("utf-8")
