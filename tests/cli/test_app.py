import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import touchdown
from touchdown.cli import app
from touchdown.config import presets
from touchdown.config.toml import to_toml
from touchdown.core import files
from touchdown.core.errors import UserError

SHORT = [
    "--env-id=CartPole-v1",
    "--hidden-sizes=8",
    "--min-size=20",
    "--validation-period=100",
    "--validation-episodes=2",
    "--final-validation-episodes=2",
    "--test-episodes=3",
]


def run(*args: str, cwd: Path | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, as a person starts it."""
    return subprocess.run(
        [sys.executable, "-m", "touchdown", *args],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=os.environ | env,
        timeout=300,
        check=False,
    )


def complaint(*args: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line of a refused command."""
    with pytest.raises(SystemExit) as stop:
        app.main(args)
    assert stop.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.splitlines()
    assert len(lines) == 1, said.err
    assert lines[0].startswith("touchdown: ")
    return lines[0].removeprefix("touchdown: ")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of runs with one finished run in it, `cart`."""
    runs = tmp_path_factory.mktemp("cli") / "runs"
    done = run("train", "dqn", *SHORT, "--episodes=8", "--name=cart", f"--runs-dir={runs}")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "CartPole-v1: 3 greedy flights from starts 0-2" in done.stdout
    return runs


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (
            ["nope"],
            "verb 'nope': unknown; choose one of train, evaluate, fly, tune, study, compare",
        ),
        (["train", "plot"], "preset 'plot': unknown; choose one of dqn, target-dqn"),
        (["train", "--gamma=0.9", "dqn"], "preset 'dqn': must be given once, right after `train`"),
        (["train", "--gama=0.9"], "--gama: unknown option; did you mean --gamma?"),
        (["runs", "--jsn"], "--jsn: unknown option; did you mean --json?"),
        (["train", "--gamma=1.5"], "gamma = 1.5: must be from 0 to 1"),
        (["train", "--gamma=-0.1"], "gamma = -0.1: must be from 0 to 1"),
        (["train", "--gamma=nan"], "gamma = nan: must be a finite number"),
        (["train", "--gamma=fast"], "--gamma: could not convert string to float: 'fast'"),
        (
            ["train", "--hidden-sizes", "64", "0"],
            "hidden_sizes = (64, 0): must be from 1 to 100000 nodes",
        ),
        (["train", "--capacity=1000000000000000"], "must be from 1 to 1000000000 transitions"),
        (["train", "--hidden-sizes", "100000000000"], "must be from 1 to 100000 nodes"),
        (["train", "--learning-rate-duration=100000000000"], "must be from 0 to 2147483647"),
        (["train", "--resaves=1000000000000"], "must be from 0 to 1000000"),
        (["train", "--config=a.toml", "--config", "b.toml"], "--config: given 2 times"),
        (["train", "--capacity=0"], "capacity = 0: must be from 1 to 1000000000 transitions"),
        (["train", "--capacity=10"], "min_size = 1000: must be at most capacity = 10"),
        (["train", "--batch-size=-1"], "batch_size = -1: must be from 1 to"),
        (["train", "--seed=-1"], "seed = -1: must be from 0 to 4294967295"),
        (["train", "--optimizer=adagard"], "invalid choice 'adagard' for argument '--optimizer'"),
        (["train", "--config=no.toml"], "no.toml: cannot be read: No such file or directory"),
        (["train", "--env-id=Nope-v1"], "env_id 'Nope-v1': cannot be made: "),
        (["train", "--env-id=Pendulum-v1"], "its action space is Box"),
        (["train", "--env-id=Blackjack-v1"], "its observation space is Tuple"),
        (["train", "tabular-q", "--env-id=Blackjack-v1"], "its observation space is Tuple"),
        (["train", "tabular-q", "--bins", "4"], "bins = (4,): must stay () in a world of 16"),
        (["train", "tabular-q", "--bins", "x"], "--bins: Could not find valid parse"),
        (["train", "tabular-q", "--env-id=CartPole-v1"], "bins = (): must be 4 numbers"),
        (
            ["train", "tabular-q", "--env-id=CartPole-v1", "--bins", "4", "4", "4", "4"],
            "bins_low = (): must be 4 numbers, as this world's own bounds are not all finite",
        ),
        (
            ["train", "tabular-q", "--env-id=MountainCar-v0", "--bins=4", "--bins-low", "-1", "0"],
            "bins_low = (-1.0, 0.0): must be () or as many as bins = (4,)",
        ),
        (["train", "tabular-q", "--bins", "0", "4"], "bins = (0, 4): must be at least 1 each"),
        (["train", "tabular-q", "--hidden-sizes=8"], "must stay (100, 100, 100) with algorithm"),
        (["train", "tabular-q", "--initial-value=inf"], "initial_value = inf: must be a finite"),
        (["train", "tabular-lander", "--env-id=CartPole-v1"], "must be 4 numbers"),
        (["train", "value-iteration", "--env-id=CartPole-v1"], "its model is not known"),
        (["train", "--num-envs=0"], "num_envs = 0: must be from 1 to 10000"),
        (["train", "--gradient-steps=0"], "gradient_steps = 0: must be 1 to 1000 updates"),
        (["train", "pqn", "--trace-decay=2"], "trace_decay = 2.0: must be from 0 to 1"),
        (["train", "--trace-decay=0.5"], "must stay 0.65 with algorithm = 'dqn'"),
        (["train", "pilot", "--algorithm=pqn"], "with algorithm = 'pqn', which makes no use of it"),
        (["train", "pqn", "--minibatches=1000"], "num_envs * rollout_steps = 256"),
        (["train", "--target=expected-sarsa"], "must be q-learning or sarsa"),
        (["train", "double-dqn", "--target=sarsa"], "double = True: must be False beside target"),
        (["train", "--resume=nix"], "run 'nix': no such folder in 'runs'"),
        (["train", "dqn", "--resume=nix"], "resume 'nix': goes on with the run's own settings"),
        (["train", "--name=a/b"], "name 'a/b': must be a plain folder name"),
        (["train", "--name=n[red]m"], "name 'n[red]m': must be a plain folder name"),
        (["train", "--name=pid"], "name 'pid': means another policy to evaluate and fly"),
        (["train", "--name=x.toml"], "name 'x.toml': means another policy"),
        (["train", "--validation-episodes=1000000"], "must be at most 1000000"),
        (["train", "--test-episodes=2000000"], "test_episodes = 2000000: must be at most 1000000"),
        (["--verison"], "Unrecognized options: --verison"),
        (["tune", "pid", "--out=."], "out '.': must be a file, such as pid.toml"),
        (["train", "--device=gpu"], "device 'gpu': JAX finds none here"),
        (["evaluate", "nix"], "run 'nix': no such folder in 'runs'; `touchdown runs` lists them"),
        (["evaluate", "pid", "--episodes=0"], "episodes = 0: must be at least 1"),
        (["evaluate", "pid", "--seed=-3"], "seed = -3: must be from 0 to"),
        (["evaluate", "gone.safetensors"], "gone.safetensors: cannot be read: No such file"),
        (["fly", "pid", "--out=x.avi"], ".gif or .mp4"),
        (["fly", "pid", "--out=no/such/x.gif"], "no/such/x.gif"),
        (["tune", "pid", "--tolerence=2"], "--tolerence: unknown option; did you mean --toler"),
        (["tune", "pid", "--tolerance=2"], "tolerance = 2.0: must be between 0 and 1"),
        (["tune", "pid", "--starts=0"], "starts = 0: must be at least 1"),
        (["tune", "pid", "--out=no/such/pid.toml"], "out 'no/such/pid.toml': its folder does not"),
        (["evaluate", "gone.onnx"], "gone.onnx: cannot be read: No such file"),
        (["fly", "gone.zip"], "gone.zip: cannot be read: No such file"),
        (["export", "nix"], "run 'nix': no such folder in 'runs'"),
        (["export", "nix", "--format=tflite"], "invalid choice 'tflite' for argument '--format'"),
        (["runs", "--runs-dir=nix"], "runs_dir 'nix': no such folder"),
        (["show", "nix"], "run 'nix': no such folder"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(args, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert said in complaint(*args, capsys=capsys)
    assert not list(tmp_path.iterdir())  # nothing was made, nothing was harmed


def test_every_verb_explains_itself_and_names_units_and_defaults(capsys):
    for verb in app.VERBS:
        with pytest.raises(SystemExit) as stop:
            app.main([verb, "--help"])
        assert stop.value.code == 0
        assert f"usage: touchdown {verb}" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        app.main(["train", "paper-best", "--help"])
    shown = capsys.readouterr().out
    assert "--resaves INT" in shown
    assert "default: 10)" in shown
    for name in presets.PRESETS:
        assert name in shown


def test_help_and_import_take_no_heavy_library():
    code = (
        "import sys, touchdown, touchdown.cli.app\n"
        "try: touchdown.cli.app.main(['train', '--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'jax', 'gymnasium', 'matplotlib', 'scipy', 'optax', 'tensorboardX', 'PIL'}\n"
        "assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_flags_override_the_file_and_the_file_overrides_the_preset(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("seed = 3\n[learning]\ngamma = 0.9\nbatch_size = 16\n")
    verb = app.parse(["train", "paper-best", f"--config={file}", "--batch-size", "32"])
    assert isinstance(verb, app.Train)
    config = verb.settings()
    assert (config.seed, config.learning.gamma, config.learning.batch_size) == (3, 0.9, 32)
    assert config.replay == presets.preset("paper-best").replay


def test_a_preset_named_in_a_file_is_where_its_settings_start(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('preset = "dqn"\n')
    verb = app.parse(["train", f"--config={file}"])
    assert isinstance(verb, app.Train)
    assert verb.settings() == presets.preset("dqn")


def test_a_preset_that_is_no_name_cannot_lead_out_of_the_runs_folder(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text('preset = "../escaped"\n')
    said = complaint("train", f"--config={file}", capsys=capsys)
    assert "preset = '../escaped': must be letters, digits" in said


def test_the_version_is_told(capsys):
    app.main(["--version"])
    assert capsys.readouterr().out == f"touchdown {touchdown.__version__}\n"


def test_a_terminal_without_utf_8_still_gets_its_table(tmp_path):
    done = run("evaluate", "random", "--episodes=1", cwd=tmp_path, PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "return, mean" in done.stdout


def test_an_effective_config_fed_back_is_the_same_config(tmp_path):
    config = presets.preset("paper-best")
    file = tmp_path / "config.toml"
    file.write_text(to_toml(config))
    verb = app.parse(["train", "--config", str(file)])
    assert isinstance(verb, app.Train)
    assert verb.settings() == config


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gamma = 0.9\n", "unknown field 'gamma'; known: preset, seed, env_id, algorithm"),
        ("[learning]\ngama = 0.9\n", "[learning]: unknown field 'gama'; known: gamma"),
        ("[learning]\ngamma = 'x'\n", "[learning]: gamma = 'x': must be a number"),
        ("[learning]\ngamma = 2\n", "[learning]: gamma = 2.0: must be from 0 to 1"),
        ("learning = 3\n", "learning = 3: must be a table [learning]"),
        ("[learning\n", "not TOML"),
        ("format_version = 9\n", "format_version = 9: this touchdown reads 1"),
    ],
)
def test_a_bad_config_file_is_refused_in_one_line(tmp_path, text, said, capsys):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    assert said in complaint("train", f"--config={file}", capsys=capsys)


def test_a_run_ends_with_its_records_results_and_pictures(finished):
    names = {path.name for path in (finished / "cart").iterdir()}
    assert {
        "config.toml",
        "provenance.json",
        "episodes.jsonl",
        "updates.jsonl",
        "validations.jsonl",
        "evaluation.json",
        "checkpoints",
        "learning-curve.png",
        "landing.gif",
        "landing.mp4",
    } <= names
    assert not [name for name in names if ".tmp" in name]


def test_runs_and_show_speak_json(finished, capsys):
    app.main(["runs", "--json", f"--runs-dir={finished}"])
    listed = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in listed] == ["cart"]
    assert listed[0]["status"] == "finished"
    assert listed[0]["episodes"] == 8
    app.main(["show", "cart", "--json", f"--runs-dir={finished}"])
    shown = json.loads(capsys.readouterr().out)
    assert shown["config"]["env_id"] == "CartPole-v1"
    assert all(Path(path).is_file() for path in shown["pictures"])
    app.main(["show", "cart", f"--runs-dir={finished}"])
    text = capsys.readouterr().out
    assert 'env_id = "CartPole-v1"' in text
    assert "learning-curve.png" in text


def test_evaluate_flies_the_starts_asked_for(finished, capsys):
    where = f"--runs-dir={finished}"
    app.main(["evaluate", "cart", "--episodes=3", "--json", where])
    ours = json.loads(capsys.readouterr().out)
    stored = json.loads((finished / "cart" / "evaluation.json").read_text())["pilots"][0]
    assert ours["episodes"] == stored["episodes"]  # the run's own test, flown again
    app.main(["evaluate", "cart", "--episodes=2", "--seed=7", "--json", where])
    assert [e["seed"] for e in json.loads(capsys.readouterr().out)["episodes"]] == [7, 8]
    weights = finished / "cart" / "checkpoints" / "best.safetensors"
    app.main(["evaluate", str(weights), "--episodes=3", "--json"])
    assert json.loads(capsys.readouterr().out)["episodes"] == stored["episodes"]


def test_a_run_is_exported_and_what_came_of_it_flown(finished, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    app.main(["export", "cart", f"--runs-dir={finished}"])
    said = capsys.readouterr().out.splitlines()
    assert re.match(r"[\d,]+ of 10,000 actions agree with touchdown's", said[0])
    names = ["cart.onnx", "fly_onnx.py", "README.md"]
    assert said[1:] == [f"  cart-onnx/{name}" for name in names]
    app.main(["evaluate", "cart-onnx/cart.onnx", "--episodes=3", "--json"])
    stored = json.loads((finished / "cart" / "evaluation.json").read_text())["pilots"][0]
    assert json.loads(capsys.readouterr().out)["episodes"] == stored["episodes"]
    again = complaint("export", "cart", f"--runs-dir={finished}", capsys=capsys)
    assert again == "out 'cart-onnx': is there already; choose another folder"


def test_a_name_taken_or_a_finished_run_loses_nothing(finished, capsys):
    before = {p: p.read_bytes() for p in (finished / "cart").rglob("*") if p.is_file()}
    said = complaint("train", *SHORT, "--name=cart", f"--runs-dir={finished}", capsys=capsys)
    assert "--resume cart" in said
    assert before == {p: p.read_bytes() for p in (finished / "cart").rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("file", "content", "verb", "said"),
    [
        ("config.toml", "[half", "show", "not TOML"),
        ("evaluation.json", '{"format_version": 1, "pil', "show", "not JSON, perhaps cut off"),
        ("evaluation.json", '{"format_version": 7}', "show", "format_version = 7"),
        ("checkpoints/best.safetensors", "half", "evaluate", "not a whole safetensors file"),
        ("episodes.jsonl", "broken\n{}\n", "show", "line 1 is not a JSON object"),
        ("episodes.jsonl", "{}\n{}\n", "show", "line 1: episode: missing"),
    ],
)
def test_half_written_run_files_are_named(finished, tmp_path, file, content, verb, said, capsys):
    shutil.copytree(finished, tmp_path / "runs")
    (tmp_path / "runs" / "cart" / file).write_text(content)
    where = f"--runs-dir={tmp_path / 'runs'}"
    assert said in complaint(verb, "cart", where, capsys=capsys)


def test_a_folder_without_a_config_is_no_run(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    said = complaint("show", "empty", f"--runs-dir={tmp_path}", capsys=capsys)
    assert "holds no config.toml, so it is not a run" in said


def test_a_runs_folder_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "runs").write_text("mine")
    said = complaint("train", f"--runs-dir={tmp_path / 'runs'}", capsys=capsys)
    assert "cannot be written" in said
    assert (tmp_path / "runs").read_text() == "mine"


def test_a_full_disk_is_one_line_and_exit_code_2(tmp_path, monkeypatch, capsys):
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", str(tmp_path / "runs/full/episodes.jsonl"))

    monkeypatch.setattr("touchdown.training.loggers.Recorder.write", full)
    where = [f"--runs-dir={tmp_path / 'runs'}", "--name=full"]
    said = complaint("train", "dqn", *SHORT, "--episodes=2", *where, capsys=capsys)
    assert "episodes.jsonl: cannot be written: No space left on device" in said
    assert said.endswith(f"touchdown train --resume full --runs-dir {tmp_path / 'runs'}")


def test_a_real_full_disk_keeps_what_was_saved(tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full here")
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m touchdown evaluate random --episodes 1 > /dev/full"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_says_how_to_go_on_and_does(tmp_path, number):
    runs = tmp_path / "runs"
    args = ["train", "dqn", *SHORT, "--episodes=60", "--name=stop", f"--runs-dir={runs}"]
    child = subprocess.Popen(
        [sys.executable, "-m", "touchdown", *args], stderr=subprocess.PIPE, text=True
    )
    episodes = runs / "stop" / "episodes.jsonl"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and child.poll() is None:
        if episodes.is_file() and episodes.read_bytes().count(b"\n") >= 3:
            break
        time.sleep(0.01)
    child.send_signal(number)
    _, said = child.communicate(timeout=120)
    assert child.returncode == 130
    assert said.splitlines()[-1] == (
        f"touchdown: stopped and saved; go on with: touchdown train --resume stop --runs-dir {runs}"
    )
    done = run("train", "--resume", "stop", f"--runs-dir={runs}")
    assert done.returncode == 0, done.stderr
    assert [row["episode"] for row in files.read_jsonl(episodes)] == list(range(1, 61))


def test_an_unknown_verb_raises_before_anything_is_loaded():
    with pytest.raises(UserError, match="verb 'land'"):
        app.parse(["land"])
