"""The documentation's examples, run from a folder outside the package on an installed wheel."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
SHORT = (
    *("--hidden-sizes=8", "--num-envs=2", "--min-size=50", "--episodes=4", "--seed=3"),
    *("--validation-period=50", "--validation-episodes=2", "--final-validation-episodes=2"),
    *("--test-episodes=2", "--learning-rate-duration=0"),
)


def blocks(page: str) -> dict[str, str]:
    """The titled code blocks of a page, by title."""
    text = (ROOT / "docs" / page).read_text("utf-8")
    return dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```$', text, re.DOTALL | re.MULTILINE))


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A Python that has touchdown from a wheel, and all else from this environment."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
         "--disable-pip-version-check", "--wheel-dir", str(folder), str(ROOT)],
        check=True,
        capture_output=True,
    )  # fmt: skip
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "venv", with_pip=False, symlinks=True)
    python = folder / "venv" / "bin" / "python"
    site = next((folder / "venv" / "lib").glob("python*/site-packages"))
    subprocess.run(
        [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--offline", "--no-deps",
         "--python", str(python), str(wheel)],
        check=True,
        capture_output=True,
    )  # fmt: skip
    # a plain path: the editable install's own .pth is not read
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


@pytest.fixture(scope="module")
def outside(installed, tmp_path_factory):
    """Runs the installed touchdown, or its Python, in a folder with the examples."""
    folder = tmp_path_factory.mktemp("outside")
    for path in EXAMPLES.iterdir():
        shutil.copy(path, folder)
    env = {name: of for name, of in os.environ.items() if name != "PYTHONPATH"}

    def run(*words: str, code: int = 0) -> str:
        command = [installed, *words] if words[0] == "-c" else [installed.with_name("touchdown")]
        done = subprocess.run(
            command if words[0] == "-c" else [*command, *words],
            cwd=folder,
            env=env | {"OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    run.folder = folder
    return run


def test_the_examples_on_the_page_are_the_files():
    titled = blocks("extending.md")
    assert titled.keys() == {path.name for path in EXAMPLES.iterdir()}
    for name, text in titled.items():
        assert text == (EXAMPLES / name).read_text("utf-8")


def test_munchausen_is_short():
    assert len((EXAMPLES / "munchausen.py").read_text("utf-8").splitlines()) < 80


def test_the_wheel_is_what_runs(outside):
    said = outside("-c", "import touchdown; print(touchdown.__file__)")
    assert str(ROOT) not in said
    assert "site-packages" in said


def test_an_environment_of_ones_own_is_trained_and_read_after_its_module_is_gone(outside):
    name = "gravity:LunarGravity-v0"
    outside("train", "pilot", f"--env-id={name}", *SHORT, "--name=g", "--num-envs=1")
    outside("-c", "import shutil; shutil.copytree('runs/g', 'runs/h')")
    refused = outside("evaluate", "g", "--episodes=1", code=2)
    assert refused.count("\n") == 1
    assert "names code that would be imported" in refused
    assert "± " in outside("evaluate", "g", "--episodes=2", f"--env-id={name}")
    (outside.folder / "gravity.py").unlink()
    outside("compare", "g", "h", "--out=page")
    page = (outside.folder / "page" / "index.html").read_text("utf-8")
    assert name in page


def test_an_agent_of_ones_own_is_checked_trained_resumed_and_exported(outside):
    script = """
import touchdown
from munchausen import MunchausenDQN
from touchdown.testing import check_agent
check_agent(MunchausenDQN, options={"tau": 0.1})
"""
    outside("-c", script)
    name = "munchausen:MunchausenDQN"
    train = "train", "vector-dqn", f"--algorithm={name}"
    said = outside(*train, *SHORT, "--options", "tau=0", code=2)
    assert "tau = 0: must be above 0" in said
    assert not (outside.folder / "runs" / "vector-dqn-3").exists()
    outside(*train, *SHORT, "--options", "tau=0.1")
    curve = outside.folder / "runs" / "vector-dqn-3" / "learning-curve.png"
    curve.unlink()
    assert "names code" in outside("train", "--resume", "vector-dqn-3", code=2)
    outside("train", "--resume", "vector-dqn-3", "--trust")
    assert curve.is_file()
    # its weights are a network's: no code of the user's is needed
    outside("evaluate", "vector-dqn-3", "--episodes=2")
    assert "actions" in outside("export", "vector-dqn-3")


def test_an_agent_of_ones_own_is_compared_in_a_study(outside):
    text = (EXAMPLES / "munchausen.toml").read_text("utf-8")
    settings = """
[config.network]
hidden_sizes = [8]
[config.replay]
min_size = 50
[config.training]
num_envs = 2
episodes = 4
validation_period = 50
validation_episodes = 2
final_validation_episodes = 2
test_episodes = 2
"""
    text = text.replace("seeds = 5\n", f"seeds = 2\n{settings}")
    (outside.folder / "short.toml").write_text(text)
    assert "names code" in outside("study", "run", "short.toml", code=2)
    outside("study", "run", "short.toml", "--trust")
    outside("study", "report", "short.toml", "--out=report")
    assert "Munchausen-DQN" in (outside.folder / "report" / "summary.md").read_text("utf-8")


def test_a_loss_of_ones_own_is_trained(outside):
    script = """
from clipped import ClippedDoubleDQN, clipped_double_q_error
from touchdown.testing import check_agent
import jax.numpy as jnp
for online, target in (([0.0, 9.0], [7.0, 4.0]), ([0.0, 4.0], [7.0, 9.0])):
    delta = clipped_double_q_error(
        jnp.array([[5.0, 1.0]]), jnp.array([0]), jnp.array([1.0]), jnp.array([0.5]),
        jnp.array([online]), jnp.array([target]),
    )
    assert delta.tolist() == [-2.0], delta  # 1 + 0.5 * 4 - 5: the lesser value of the second action
check_agent(ClippedDoubleDQN)
"""
    outside("-c", script)
