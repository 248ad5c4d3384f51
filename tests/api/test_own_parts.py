"""Environments and agents of the user's, from training to export, and files of strangers'."""

import re
import shutil
import sys

import gymnasium
import numpy as np
import pytest

import touchdown
from small_configs import lake
from touchdown.config.config import Config
from touchdown.config.sections import TrainingConfig
from touchdown.core import files, plugins
from touchdown.core.errors import Interrupted, UserError
from touchdown.runs.run import list_facts
from touchdown.testing import Chain

# an environment and an agent in nothing but NumPy
MODULE = """
from pathlib import Path
import numpy as np
from touchdown.runs.run import list_facts
from touchdown.testing import Chain

Path(__file__).with_name("ran").touch()

def make_chain():
    return Chain(limit=9)

class Right:
    def __init__(self, config, spaces, streams, *, action=1):
        self.seen, self.action = 0, action
    def act(self, observations):
        return np.full(len(observations), self.action)
    def observe(self, o_tm1, a_tm1, steps, next_observations):
        self.seen += len(a_tm1)
        return {"seen": self.seen} if self.seen % 4 == 0 else None
    def weights(self):
        return {"action": np.array([self.action])}
    def policy(self, weights):
        return Always(int(weights["action"][0]))
    def state(self):
        return {"seen": self.seen}
    def restore(self, state):
        self.seen = state["seen"]

class Always:
    def __init__(self, action):
        self.action = action
    def act(self, observations):
        return np.full(len(observations), self.action)
"""
SHORT = TrainingConfig(
    num_envs=2,
    episodes=6,
    validation_period=5,
    validation_episodes=2,
    final_validation_episodes=3,
    test_episodes=4,
    checkpoint_seconds=0,
)


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A finished run of the module's environment and agent, in the folder of the module."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "own_parts.py").write_text(MODULE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "path", [path for path in sys.path if path])
        agent = "own_parts:Right"
        config = Config(preset="mine", training=SHORT, algorithm=agent, options={"action": 1})
        touchdown.train(config, env="own_parts:make_chain", agent=agent, runs_dir="runs")
        yield folder
    sys.modules.pop("own_parts", None)


@pytest.fixture
def stranger(own, tmp_path, monkeypatch):
    """The same folder as a process sees it that named nothing."""
    monkeypatch.setattr(plugins, "_named", set())
    monkeypatch.setattr(plugins, "_given", {})
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path not in ("", str(own))])
    sys.modules.pop("own_parts", None)
    shutil.copytree(own, tmp_path / "theirs", dirs_exist_ok=True)
    (tmp_path / "theirs" / "ran").unlink()
    monkeypatch.chdir(tmp_path / "theirs")
    return tmp_path / "theirs"


def test_a_run_of_own_parts_is_trained_tested_and_recorded(own):
    run = touchdown.show("mine-0", own / "runs")
    assert run.status == "finished"
    assert (run.config.env_id, run.config.algorithm) == ("own_parts:make_chain", "own_parts:Right")
    assert run.config.options == {"action": 1}
    assert run.evaluation is not None
    assert run.evaluation.summary.mean_return == 8  # it always goes right
    text = run.folder.updates.read_text()
    assert '"seen":4.0' in text.replace(" ", "")


def test_reading_a_strangers_run_imports_nothing(stranger):
    runs = stranger / "runs"
    shutil.copytree(runs / "mine-0", runs / "mine-1")
    (stranger / "own_parts.py").unlink()  # it is not even there
    assert [fact["status"] for fact in list_facts(runs)] == ["finished", "finished"]
    run = touchdown.show("mine-0", runs)
    assert run.evaluation is not None
    touchdown.compare(["mine-0", "mine-1"], runs_dir=runs, out=stranger / "page")
    assert (stranger / "page" / "index.html").is_file()
    assert not (stranger / "ran").exists()


@pytest.mark.parametrize(
    "use",
    [
        lambda runs: touchdown.evaluate("mine-0", episodes=1, runs_dir=runs),
        lambda runs: touchdown.fly("mine-0", runs_dir=runs),
        lambda runs: touchdown.resume("mine-0", runs_dir=runs),
        lambda runs: touchdown.export("mine-0", "safetensors", runs_dir=runs, out=runs / "out"),
        lambda runs: touchdown.evaluate(
            runs / "mine-0" / "checkpoints" / "best.safetensors", episodes=1
        ),
        lambda runs: touchdown.train(touchdown.show("mine-0", runs).config, runs_dir=runs),
    ],
    ids=["evaluate", "fly", "resume", "export", "weights", "train"],
)
def test_a_strangers_code_runs_only_where_the_user_says_so(use, stranger):
    (stranger / "runs" / "mine-0" / "learning-curve.png").unlink()  # something is left to resume
    with pytest.raises(UserError, match="names code that would be imported; if you trust it"):
        use(stranger / "runs")
    assert not (stranger / "ran").exists()
    assert not (stranger / "runs" / "out").exists()


def test_with_trust_a_run_is_evaluated_exported_and_resumed(stranger):
    runs = stranger / "runs"
    found = touchdown.evaluate("mine-0", episodes=3, runs_dir=runs, trust=True)
    assert found.summary.mean_return == 8
    with pytest.raises(UserError, match="format 'onnx': the policy of algorithm 'own_parts:Right'"):
        touchdown.export("mine-0", runs_dir=runs, trust=True)
    out = stranger / "card"
    exported = touchdown.export("mine-0", "safetensors", runs_dir=runs, out=out, trust=True)
    found = touchdown.evaluate(exported.files[0], episodes=1, trust=True)
    assert found.summary.mean_return == 8
    (runs / "mine-0" / "learning-curve.png").unlink()
    assert touchdown.resume("mine-0", runs_dir=runs, trust=True).status == "finished"


def test_names_given_in_the_call_are_trusted_and_must_be_the_runs(stranger):
    runs = stranger / "runs"
    (runs / "mine-0" / "learning-curve.png").unlink()
    with pytest.raises(UserError, match="env = 'CartPole-v1': the run's environment is 'own_parts"):
        touchdown.resume("mine-0", env="CartPole-v1", agent="own_parts:Right", runs_dir=runs)
    with pytest.raises(UserError, match="agent = 'other:Right': the run's agent is 'own_parts"):
        touchdown.resume("mine-0", env=Chain, agent="other:Right", runs_dir=runs)
    run = touchdown.resume("mine-0", env=Chain, agent="own_parts:Right", runs_dir=runs)
    assert run.status == "finished"


def test_a_run_whose_module_is_gone_says_so_when_it_is_flown(stranger):
    (stranger / "own_parts.py").unlink()
    with pytest.raises(UserError, match="module own_parts cannot be imported: ModuleNotFoundError"):
        touchdown.evaluate("mine-0", runs_dir=stranger / "runs", trust=True)


def test_an_environment_may_be_an_object_a_class_or_a_function(tmp_path):
    config = lake()
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    run = touchdown.train(config, env=env, name="lake", runs_dir=tmp_path)
    assert run.config.env_id == "gymnasium.envs.toy_text.frozen_lake:FrozenLakeEnv()"
    again = touchdown.train(
        config, env=lambda: gymnasium.make("FrozenLake-v1", is_slippery=False), runs_dir=tmp_path
    )
    assert again.evaluation is not None
    assert run.evaluation is not None
    assert again.evaluation.summary == run.evaluation.summary


class Undrawable(Chain):
    """Draws text, returns scalars as arrays, and cannot be closed."""

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012

    def __init__(self, render_mode=None):
        super().__init__(limit=9)
        self.render_mode = render_mode

    def step(self, action):
        observation, reward, *ended, info = super().step(action)
        return observation, np.array([reward]), *map(np.array, ended), info

    def render(self):
        return "..o.."

    def close(self):
        raise RuntimeError


def test_a_run_without_a_film_says_why_and_is_finished(own, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(own)
    config = Config(preset="mine", training=SHORT)
    parts = {"env": Undrawable, "agent": "own_parts:Right", "runs_dir": tmp_path}
    run = touchdown.train(config, progress=True, **parts)
    said = " ".join(capsys.readouterr().out.split())
    assert re.search(
        r"no film: environment \S+:Undrawable: render\(\) returned '..o..', must", said
    )
    assert [path.name for path in run.pictures] == ["learning-curve.png"]
    assert run.status == "finished"
    run.pictures[0].unlink()
    assert touchdown.resume("mine-0", **parts).status == "finished"


def test_a_stopped_run_of_ones_own_parts_goes_on_identically(own, tmp_path, monkeypatch):
    monkeypatch.chdir(own)
    plugins.allow("own_parts:Right")
    right = plugins.load("own_parts:Right", "algorithm")
    stopped = []

    class Stopping(right):
        def observe(self, *args):
            if self.seen >= 20 and not stopped:
                stopped.append(True)
                raise Interrupted
            return super().observe(*args)

    config = Config(preset="mine", training=SHORT)
    with pytest.raises(Interrupted):
        touchdown.train(config, env=Chain, agent=Stopping, runs_dir=tmp_path)
    run = touchdown.resume("mine-0", env=Chain, agent=Stopping, runs_dir=tmp_path)
    whole = touchdown.train(config, env=Chain, agent=right, name="whole", runs_dir=tmp_path)
    for each in ("episodes", "updates", "validations"):
        one, other = (
            [row | {"seconds": 0} for row in files.read_jsonl(getattr(folder, each))]
            for folder in (run.folder, whole.folder)
        )
        assert one == other


def test_a_run_of_our_own_parts_takes_no_others_when_it_is_resumed(tmp_path):
    touchdown.train(lake(), name="lake", runs_dir=tmp_path)
    (tmp_path / "lake" / "learning-curve.png").unlink()
    with pytest.raises(UserError, match="the run's environment is 'FrozenLake-v1'"):
        touchdown.resume("lake", env=Chain, runs_dir=tmp_path)
    with pytest.raises(UserError, match="the run's agent is 'tabular'"):
        touchdown.resume("lake", agent=Chain, runs_dir=tmp_path)


def test_a_run_of_an_object_says_that_it_must_be_passed_again(tmp_path, monkeypatch):
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    touchdown.train(lake(), env=env, name="lake", runs_dir=tmp_path)
    (tmp_path / "lake" / "learning-curve.png").unlink()
    with pytest.raises(UserError, match=r"env = None: the run's environment is .* pass it again"):
        touchdown.resume("lake", runs_dir=tmp_path)
    monkeypatch.setattr(plugins, "_given", {})  # as in another process
    assert touchdown.resume("lake", env=env, runs_dir=tmp_path).status == "finished"


def test_runs_with_different_options_are_compared(own, tmp_path, monkeypatch):
    monkeypatch.chdir(own)
    config = Config(preset="mine", training=SHORT)
    other = touchdown.train(
        config, env="own_parts:make_chain", agent="own_parts:Right", runs_dir=tmp_path
    )
    for runs in ([own / "runs" / "mine-0", other], [other, own / "runs" / "mine-0"]):
        page = touchdown.compare(runs, out=tmp_path / "page", force=True)
        assert "options.action" in page.read_text("utf-8")
