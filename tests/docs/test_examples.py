"""The documentation's examples, run from a folder outside the package on an installed wheel."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import textwrap
import venv
from pathlib import Path

import pytest

from installs import wheel_without_compiler

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
    """A Python that has touchdown from a wheel, and all else from this environment.

    The wheel was built without a compiler, so all this runs on stock Gymnasium.
    """
    folder = tmp_path_factory.mktemp("installed")
    wheel = wheel_without_compiler(folder)
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
    """Runs a script with the installed touchdown in a folder with the examples."""
    folder = tmp_path_factory.mktemp("outside")
    for path in EXAMPLES.iterdir():
        shutil.copy(path, folder)
    env = {name: of for name, of in os.environ.items() if name != "PYTHONPATH"}

    def run(script: str) -> str:
        done = subprocess.run(
            [installed, "-c", COMMANDS + textwrap.dedent(script)],
            cwd=folder,
            env=env | {"OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    run.folder = folder
    return run


# several commands in one process: each start of Python and JAX takes seconds
COMMANDS = f"""
import shutil
from touchdown.cli import app

SHORT = {SHORT!r}

def refused(*words):
    try:
        app.main(words)
    except SystemExit as end:
        assert end.code == 2, end.code
    else:
        raise AssertionError(words)

"""


def test_the_examples_on_the_page_are_the_files():
    titled = blocks("extending.md")
    assert titled.keys() == {path.name for path in EXAMPLES.iterdir()}
    for name, text in titled.items():
        assert text == (EXAMPLES / name).read_text("utf-8")


def test_munchausen_is_short():
    assert len((EXAMPLES / "munchausen.py").read_text("utf-8").splitlines()) < 80


def test_an_environment_of_ones_own_is_trained_and_read_after_its_module_is_gone(outside):
    said = outside("""
        import touchdown
        print(touchdown.__file__)
        name = "--env-id=gravity:LunarGravity-v0"
        one = [word for word in SHORT if not word.startswith("--num-envs")]
        app.main(["train", "pilot", name, *one, "--name=g"])
        shutil.copytree("runs/g", "runs/h")
    """)
    assert "site-packages" in said.splitlines()[0]  # the wheel is what runs
    assert str(ROOT) not in said.splitlines()[0]
    outside("""
        import sys
        refused("evaluate", "g", "--episodes=1")
        assert "gravity" not in sys.modules
        app.main(["evaluate", "g", "--episodes=1", "--env-id=gravity:LunarGravity-v0"])
        assert "gravity" in sys.modules
        import os
        os.remove("gravity.py")
        app.main(["compare", "g", "h", "--out=page"])
    """)
    page = (outside.folder / "page" / "index.html").read_text("utf-8")
    assert "pilot" in page
    assert "test return" in page


def test_without_a_compiler_each_verb_works_and_what_needs_one_says_how_to_compile(outside):
    said = outside("""
        import contextlib, io
        complaint = io.StringIO()
        with contextlib.redirect_stderr(complaint):
            refused("train", "pilot", "--engine=exact")
            refused("train", "pilot", "--backend=fused")
        print(complaint.getvalue())
        app.main(["doctor"])
        app.main(["evaluate", "ace", "--episodes=2"])
        app.main(["fly", "ace", "--out=ace.gif"])
        app.main(["tune", "pid", "--tolerance=0.99", "--starts=1"])
    """)
    said = " ".join(said.split())
    assert "engine 'exact': was not built when touchdown was installed; use gymnasium, or" in said
    assert said.count("install a C++ compiler such as g++, then run: ") == 3
    assert "was not built, so the slower stock Gymnasium is used" in said
    assert (outside.folder / "ace.gif").is_file()


def test_an_agent_of_ones_own_is_checked_trained_resumed_and_exported(outside):
    outside("""
        from pathlib import Path
        train = ["train", "vector-dqn", "--algorithm=munchausen:MunchausenDQN", *SHORT]
        refused(*train, "--options", "tau=0")
        assert not Path("runs/vector-dqn-3").exists()
        untested = [word for word in train if not word.startswith("--test-episodes")]
        app.main([*untested, "--test-episodes=0", "--options", "tau=0.1"])
        Path("runs/vector-dqn-3/learning-curve.png").unlink()
    """)
    outside("""
        from pathlib import Path
        from munchausen import MunchausenDQN
        from touchdown.testing import check_agent
        refused("train", "--resume", "vector-dqn-3")
        # its weights are a network's: no code of the user's is needed
        app.main(["evaluate", "vector-dqn-3", "--episodes=1"])
        app.main(["export", "vector-dqn-3"])
        app.main(["train", "--resume", "vector-dqn-3", "--trust"])
        assert Path("runs/vector-dqn-3/learning-curve.png").is_file()
        check_agent(MunchausenDQN, options={"tau": 0.1})
    """)


@pytest.mark.slow  # its four worker processes take a minute
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
    outside("""
        refused("study", "run", "short.toml")
        app.main(["study", "run", "short.toml", "--trust", "--workers=1"])
        app.main(["study", "report", "short.toml", "--out=report"])
    """)
    summary = (outside.folder / "report" / "summary.md").read_text("utf-8")
    assert "Munchausen-DQN has a higher test return than DQN." in summary


def test_a_loss_of_ones_own_is_trained(outside):
    outside("""
        import jax.numpy as jnp
        from clipped import ClippedDoubleDQN, clipped_double_q_error
        from touchdown.testing import check_agent
        for online, target in (([0.0, 9.0], [7.0, 4.0]), ([0.0, 4.0], [7.0, 9.0])):
            delta = clipped_double_q_error(
                jnp.array([[5.0, 1.0]]), jnp.array([0]), jnp.array([1.0]), jnp.array([0.5]),
                jnp.array([online]), jnp.array([target]),
            )
            # 1 + 0.5 * 4 - 5: the smaller value of the second action
            assert delta.tolist() == [-2.0], delta
        check_agent(ClippedDoubleDQN)
    """)
