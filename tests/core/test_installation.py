"""How touchdown was installed, and the commands that complete this installation."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

import touchdown
from installs import wheel_without_compiler
from touchdown.core import installation

ROOT = Path(__file__).parents[2]


@pytest.fixture
def installed(monkeypatch, tmp_path):
    """Pretends that touchdown was installed in some way, with pip, into an active environment."""
    pip = tmp_path / "bin" / "pip"
    pip.parent.mkdir()
    pip.touch(mode=0o755)
    monkeypatch.setattr(sys, "executable", str(pip.with_name("python")))
    monkeypatch.setenv("PATH", str(pip.parent))
    monkeypatch.setattr(installation, "find_spec", lambda _: object())

    def install(origin) -> None:
        monkeypatch.setattr(
            installation,
            "_own",
            lambda: SimpleNamespace(
                read_text=lambda _: origin and json.dumps(origin),
                requires=[
                    "numpy<3",
                    'onnx<2,>=1.17; extra == "onnx"',
                    "gpu[all]>=2; extra == 'ray'",
                ],
            ),
        )

    return install


def test_from_an_index(installed):
    installed(None)
    assert installation.command_for("onnx") == "pip install 'touchdown-rl[onnx]'"
    assert installation.command_to_repair() == "pip install touchdown-rl"
    assert installation.command_to_rebuild() == (
        "pip install --force-reinstall --no-cache-dir --no-deps touchdown-rl"
    )


def test_from_a_clone(installed, tmp_path):
    clone = {"url": (tmp_path / "a clone").as_uri(), "dir_info": {"editable": True}}
    (tmp_path / "a clone").mkdir()
    installed(clone)
    assert installation.command_for("onnx") == f"pip install -e '{tmp_path}/a clone[onnx]'"
    assert installation.command_to_rebuild().endswith(f"--no-deps -e '{tmp_path}/a clone'")
    installed(clone | {"dir_info": {}})
    assert installation.command_for("onnx") == f"pip install '{tmp_path}/a clone[onnx]'"


def test_from_a_repository_the_same_commit_is_taken(installed):
    installed(
        {
            "url": "https://example.org/touchdown.git",
            "vcs_info": {"vcs": "git", "commit_id": "abc123"},
        }
    )
    assert installation.command_for("ray") == (
        "pip install 'touchdown-rl[ray] @ git+https://example.org/touchdown.git@abc123'"
    )


def test_from_a_wheel_that_may_be_gone(installed, tmp_path):
    wheel = tmp_path / "touchdown_rl-0.1.0-cp311-cp311-linux_x86_64.whl"
    wheel.touch()
    installed({"url": wheel.as_uri(), "archive_info": {}})
    assert (
        installation.command_for("onnx") == f"pip install 'touchdown-rl[onnx] @ {wheel.as_uri()}'"
    )
    wheel.unlink()
    assert installation.command_for("onnx") == "pip install 'onnx<2,>=1.17'"
    assert installation.command_for("ray") == "pip install 'gpu[all]>=2'"
    assert installation.command_to_rebuild().endswith("--no-deps touchdown-rl")


def test_an_environment_that_is_not_active_or_has_no_pip(installed, monkeypatch, tmp_path):
    installed(None)
    monkeypatch.setenv("PATH", "")
    python = tmp_path / "bin" / "python"
    assert installation.command_for("onnx").startswith(f"{python} -m pip install ")
    monkeypatch.setattr(installation, "find_spec", lambda _: None)
    assert installation.command_for("onnx").startswith(f"uv pip install --python {python} 'touch")
    assert "--reinstall --no-cache --no-deps" in installation.command_to_rebuild()


def test_each_extra_of_the_project_has_a_hint_and_no_other():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["name"] == installation.DISTRIBUTION
    assert project["version"] == touchdown.__version__
    assert {*project["optional-dependencies"]} == {*installation.EXTRAS, "dev"}
    assert all(map(installation.is_installed, installation.EXTRAS))


def test_an_extra_is_missing_if_one_of_its_libraries_is(installed):
    installed(None)
    assert installation.is_installed("onnx")
    assert not installation.is_installed("ray")


def test_the_documentation_names_no_other_distribution():
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")]
    texts = {page: page.read_text("utf-8") for page in pages}
    texts |= {code: code.read_text("utf-8") for code in ROOT.glob("src/**/*.py")}
    wrong = [
        (path.name, line)
        for path, text in texts.items()
        for line in text.splitlines()
        if re.search(r"\btouchdown\[|(pip|uv) install [^#\n]*\btouchdown\b(?!-rl|\.git)", line)
    ]
    assert not wrong
    hints = [hint for text in texts.values() for hint in re.findall(r"touchdown-rl\[(\w+)\]", text)]
    assert {*hints} >= {"onnx", "optuna", "ray", "wandb", "mlflow"}


SHORT = (
    *("train", "cartpole", "--hidden-sizes=8", "--min-size=20", "--max-env-steps=300"),
    *("--validation-period=100", "--validation-episodes=2", "--final-validation-episodes=2"),
    *("--test-episodes=2",),
)
TUNING = ("tune", "agent", "cartpole", "--trials=1", "--seeds=1", "--env-steps=2000")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("extra", "words", "then"),
    [
        ("onnx", ("export", "ace"), "ace.onnx"),
        ("optuna", TUNING, "cartpole-tuned.toml"),
        ("ray", ("study", "run", "paper", "--on=ray://127.0.0.1:9"), "no cluster can be reached"),
        ("wandb", (*SHORT, "--logger=wandb"), "wandb/offline-run"),
        ("mlflow", (*SHORT, "--logger=mlflow"), "mlflow.db"),
    ],
)
def test_in_an_empty_environment_each_hint_leads_to_what_was_wanted(tmp_path, extra, words, then):
    wheel = wheel_without_compiler(tmp_path)
    bin_dir = Path(sys.executable).parent
    env = {**os.environ, "PATH": f"{bin_dir}{os.pathsep}{os.environ['PATH']}"}
    env |= {"WANDB_MODE": "offline", "OMP_NUM_THREADS": "1"}

    def run(*args, code: int | None = 0) -> str:
        done = subprocess.run(
            args, cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        assert code is None or done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    run("uv", "venv", "--python", sys.executable, "empty")
    python = tmp_path / "empty" / "bin" / "python"
    lock = ROOT / "requirements.lock"
    run("uv", "pip", "install", "--python", python, "--constraints", lock, wheel)
    touchdown_command = python.with_name("touchdown")
    hint = run(touchdown_command, *words, code=2).rpartition("install it: ")[2].strip()
    assert f"[{extra}] @ file://" in hint
    run("sh", "-c", hint)
    said = run(touchdown_command, *words, code=None)
    assert "Traceback" not in said
    assert then in said or next(tmp_path.rglob(f"{then}*"), None), said
