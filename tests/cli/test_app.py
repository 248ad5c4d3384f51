import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import touchdown
from command_line import SHORT, complaint, run
from touchdown.cli import app


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (
            ["nope"],
            "command 'nope': unknown; `touchdown --help` lists them",
        ),
        (["train", "plot"], "preset 'plot': unknown; did you mean pilot?"),
        (["train", "PPO"], "preset 'PPO': touchdown trains by Q-learning only, and `touchdown"),
        (["train", "--hidden-sizes", ""], "--hidden-sizes: '': must be a whole number"),
        (["train", "--hidden-sizes", "64,,64"], "--hidden-sizes: '': must be a whole number"),
        (["train", "--gamma=0.9", "dqn"], "preset 'dqn': must be given once, right after `train`"),
        (["train", "--gama=0.9"], "--gama: unknown option; did you mean --gamma?"),
        (["train", "--max-env-step=9"], "unknown option; did you mean --max-env-steps?"),
        (["tune", "agent", "pilot", "--env-step=9"], "did you mean --env-steps?"),
        (["tune", "agent", "pilot", "--observation=9"], "did you mean --env-steps?"),
        (["tune", "agent", "pilot", "--zzz"], "`touchdown tune agent --help` lists them"),
        (["tune", "agnet"], "tune 'agnet': unknown; must be one of pid, agent; did you mean agent"),
        (["pilot"], "command 'pilot': unknown; did you mean `touchdown train pilot`?"),
        (["eval", "pid"], "command 'eval': unknown; did you mean `touchdown evaluate`?"),
        (["train", "--preset", "pilot"], "--preset: a preset is a word of its own, such as `train"),
        (["train", "pilot", "--lr", "0.1"], "--lr: unknown option; did you mean --learning-rate?"),
        (["train", "--total_timesteps=9"], "did you mean --max-env-steps?"),
        (["tune", "agent", "pilot", "--timesteps=9"], "did you mean --env-steps?"),
        (["fly", "ace", "--episodes", "3"], "--episodes: unknown option; it is an option of"),
        (["train", "swift", "--double"], "double = True: must stay False with algorithm = 'pqn'"),
        (["train", "swift", "--quantiles=9"], "quantiles = 9: must stay 0 with algorithm = 'pqn'"),
        (["train", "--double=true"], "--double: takes no value; write --double or --no-double"),
        (["train", "--double", "true"], "--double true: takes no value; write --double or --no-"),
        (["train", "--seed", "1", "--seed", "2"], "--seed: given 2 times; must be given once"),
        (["train", "--hidden-sizes"], "--hidden-sizes: needs a value: --hidden-sizes INT ..."),
        (["train", "--name", "--gamma"], "--name: needs a value: --name NAME"),
        (["train", "--capacity=1.5"], "--capacity: '1.5': must be a whole number, such as 100000"),
        (["train", "--capacity=inf"], "--capacity: 'inf': must be a whole number"),
        (["train", "--", "pilot"], "--: unknown option; `touchdown train --help` lists them"),
        (["evaluate"], "evaluate: needs POLICY; `touchdown evaluate --help` describes it"),
        (["evaluate", "pid", "ace"], "'ace': unexpected word; `touchdown evaluate --help` shows"),
        (["study", "run", "paper", "--seeds=x"], "--seeds: 'x': must be a whole number"),
        (["presets", "swft"], "preset 'swft': unknown; did you mean swift?"),
        (["runs", "--jsn"], "--jsn: unknown option; did you mean --json?"),
        (["train", "--gamma=1.5"], "gamma = 1.5: must be from 0 to 1"),
        (["train", "--gamma=-0.1"], "gamma = -0.1: must be from 0 to 1"),
        (["train", "--gamma=nan"], "gamma = nan: must be a finite number"),
        (["train", "--gamma=fast"], "--gamma: 'fast': must be a number, such as 0.001"),
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
        (["train", "--optimizer=adagard"], "--optimizer: 'adagard': must be one of adam, adamw"),
        (["train", "--config=no.toml"], "no.toml: cannot be read: No such file or directory"),
        (["train", "--env-id=Nope-v1"], "env_id 'Nope-v1': unknown; "),
        (["train", "--env-id=Pendulum-v1"], "its action space is Box"),
        (["train", "--env-id=Blackjack-v1"], "its observation space is Tuple"),
        (["train", "tabular-q", "--env-id=Blackjack-v1"], "its observation space is Tuple"),
        (["train", "tabular-q", "--bins", "4"], "bins = (4,): must be () for an environment of 16"),
        (["train", "tabular-q", "--bins", "x"], "--bins: 'x': must be a whole number"),
        (["train", "tabular-q", "--env-id=CartPole-v1"], "bins = (): must be 4 numbers"),
        (
            ["train", "tabular-q", "--env-id=CartPole-v1", "--bins", "4", "4", "4", "4"],
            "bins_low = (): must be 4 numbers, as the environment's own bounds are not all finite",
        ),
        (
            ["train", "tabular-q", "--env-id=MountainCar-v0", "--bins=4", "--bins-low", "-1", "0"],
            "bins_low = (-1.0, 0.0): must be () or as long as bins = (4,)",
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
        (["train", "pilot", "--algorithm=pqn"], "with algorithm = 'pqn', which does not use it"),
        (["train", "pqn", "--minibatches=1000"], "num_envs * rollout_steps = 256"),
        (["train", "--target=expected-sarsa"], "must be q-learning or sarsa"),
        (["train", "double-dqn", "--target=sarsa"], "double = True: must be False with target"),
        (["train", "--resume=nix"], "run 'nix': no such folder in 'runs'"),
        (["train", "dqn", "--resume=nix"], "run 'nix': no such folder in 'runs'"),
        (["train", "--name=a/b"], "name 'a/b': must be a plain folder name"),
        (["train", "--name=n[red]m"], "name 'n[red]m': must be a plain folder name"),
        (["train", "--name=pid"], "name 'pid': is already the name of a policy"),
        (["train", "--name=x.toml"], "name 'x.toml': is already the name of a policy"),
        (["train", "--validation-episodes=1000000"], "must be at most 1000000"),
        (["train", "--test-episodes=2000000"], "test_episodes = 2000000: must be at most 1000000"),
        (["--verison"], "command '--verison': unknown; did you mean `touchdown --version`?"),
        (["tune", "pid", "--out=."], "out '.': must be a file, not a folder"),
        (["train", "--device=gpu"], "device 'gpu': JAX finds no such device"),
        (
            ["evaluate", "nix"],
            "policy 'nix': unknown; must be a run of 'runs', one of pid, heuristic",
        ),
        (["evaluate", "x.gif"], "policy 'x.gif': unknown; must be a run of 'runs', one of pid"),
        (["evaluate", "pid", "--env-id=CartPole-v1"], "env_id = 'CartPole-v1': policy 'pid' acts"),
        (["export", "pid"], "run 'pid': is no network, so nothing can be exported; must be a run"),
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
        (
            ["export", "nix", "--format=tflite"],
            "--format: 'tflite': must be one of onnx, safetensors",
        ),
        (["runs", "--runs-dir=nix"], "runs_dir 'nix': no such folder"),
        (["show", "nix"], "run 'nix': no such folder"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(args, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert said in complaint(*args, capsys=capsys)
    assert not list(tmp_path.iterdir())  # nothing was made, nothing was harmed


def test_help_and_import_load_no_heavy_library():
    code = (
        "import sys, touchdown, touchdown.cli.app\n"
        "try: touchdown.cli.app.main(['train', '--help'])\n"
        "except SystemExit: pass\n"
        "heavy = {'jax', 'gymnasium', 'matplotlib', 'scipy', 'optax', 'tensorboardX', 'PIL'}\n"
        "assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_the_version_is_printed(capsys):
    app.main(["--version"])
    assert capsys.readouterr().out == f"touchdown {touchdown.__version__}\n"


def test_a_terminal_without_utf_8_still_gets_its_table(tmp_path):
    done = run("evaluate", "random", "--episodes=1", cwd=tmp_path, PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "return, mean" in done.stdout


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gamma = 0.9\n", "unknown field 'gamma'; it belongs in the table [learning]"),
        ("[learning]\ngama = 0.9\n", "[learning]: unknown field 'gama'; did you mean gamma?"),
        ("[learning]\ngamma = 'x'\n", "[learning]: gamma = 'x': must be a number"),
        ("[learning]\ngamma = 2\n", "[learning]: gamma = 2.0: must be from 0 to 1"),
        ("learning = 3\n", "learning = 3: must be a table [learning]"),
        ("[learning\n", "not TOML"),
        ("format_version = 9\n", "format_version = 9: must be 1 in this version"),
    ],
)
def test_a_bad_config_file_is_refused_in_one_line(tmp_path, text, said, capsys):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    assert said in complaint("train", f"--config={file}", capsys=capsys)


@pytest.mark.parametrize(
    ("file", "content", "verb", "said"),
    [
        ("config.toml", "[half", "show", "not TOML"),
        ("evaluation.json", '{"format_version": 1, "pil', "show", "not JSON, perhaps truncated"),
        ("evaluation.json", '{"format_version": 7}', "show", "format_version = 7"),
        ("checkpoints/best.safetensors", "half", "evaluate", "not a complete safetensors file"),
        ("episodes.jsonl", "broken\n{}\n", "show", "line 1 is not a JSON object"),
        ("episodes.jsonl", "{}\n{}\n", "show", "line 1: episode: missing"),
    ],
)
def test_half_written_run_files_are_named(finished, tmp_path, file, content, verb, said, capsys):
    shutil.copytree(finished, tmp_path / "runs")
    (tmp_path / "runs" / "cart" / file).write_text(content)
    where = f"--runs-dir={tmp_path / 'runs'}"
    assert said in complaint(verb, "cart", where, capsys=capsys)


def test_a_folder_without_a_config_is_not_a_run(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    said = complaint("show", "empty", f"--runs-dir={tmp_path}", capsys=capsys)
    assert "not a run, because it has no config.toml" in said


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


@pytest.mark.parametrize(
    "args",
    [["presets"], ["presets", "pilot"], ["presets", "--json"], ["--version"]],
)
def test_a_reader_that_leaves_early_is_no_error(args, monkeypatch, capsys):
    read, write = os.pipe()
    os.close(read)
    with open(write, "w", encoding="utf-8") as closed:  # noqa: PTH123 - of a descriptor
        monkeypatch.setattr(sys, "stdout", closed)
        app.main(args)
    assert capsys.readouterr().err == ""


def test_a_reader_of_a_help_that_leaves_early_is_no_error():
    read, write = os.pipe()
    os.close(read)
    words = [sys.executable, "-m", "touchdown", "--help"]
    with open(write, "wb") as closed:  # noqa: PTH123 - of a descriptor
        done = subprocess.run(words, stdout=closed, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
@pytest.mark.parametrize("args", [["presets"], ["presets", "--json"], ["--help"], ["--version"]])
def test_output_to_a_full_disk_is_one_line_and_exit_code_2(args):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "touchdown", *args],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (2, "touchdown: No space left on device\n")


@pytest.mark.parametrize("closed", [">&-", "<&- >&-", "<&- >&- 2>&-"])
def test_closed_streams_are_no_error(tmp_path, closed):
    command = f'"{sys.executable}" -m touchdown export pilot-0 --runs-dir . {closed}'
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == 2  # there is no such run
    assert b"Traceback" not in done.stderr
    command = f'"{sys.executable}" -m touchdown play --out page.html --no-browser {closed}'
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "page.html").read_text("utf-8").endswith("</html>")


def test_memory_that_runs_out_in_training_is_one_line(tmp_path, monkeypatch, capsys):
    def exhausted(*_: object) -> None:
        raise RuntimeError("CUDA: Out of memory while trying to allocate")

    monkeypatch.setattr("touchdown.api.pipeline._completed", exhausted)
    said = complaint("train", f"--runs-dir={tmp_path}", "--name=big", capsys=capsys)
    assert said.startswith(f"{tmp_path / 'big'}: out of memory (CUDA: Out of memory")
    assert said.endswith("try a smaller capacity, batch_size or hidden_sizes")
