"""Random command lines: every verb ends with exit code 0, 2 or 130, and says at most one line."""

import functools
import os

import hypothesis
import pytest
from hypothesis import strategies as st
from one_line import ends_in_one_line

from touchdown.api import doctor, training
from touchdown.api.studies import run as study_run
from touchdown.cli import parse
from touchdown.cli.flags import flags_of
from touchdown.config import presets
from touchdown.core import device
from touchdown.core.errors import Interrupted, UserError
from touchdown.envs import environment, recorder
from touchdown.evaluation import evaluation
from touchdown.render import film
from touchdown.report import comparison, paper_page, study_page
from touchdown.runs import folder as folders
from touchdown.studies import store
from touchdown.training import pid_tuning

LONG_CASES = int(os.environ.get("TOUCHDOWN_FUZZ_CASES", "20000"))

WORDS = [
    *("pilot", "swift", "tabular-q", "dqn", "pilto"),
    *("ace", "pid", "random", "heuristic", "mine", "mien", "runs/mine", "nope", "paper", "ladder"),
    *("x.gif", "x.mp4", "x.avi", "x.onnx", "x.zip", "x.toml", "x.safetensors", "x.pth", "window"),
    *("CartPole-v1", "FrozenLake-v1", "Nope-v1", "json:dumps", "no_module:Id", ":", "a:b:c"),
    *("0", "1", "-1", "3", "1.5", "1e5", "1_000", "nan", "inf", "-inf", "-0", "1e400", "9" * 5000),
    *("64,64", "64", ",", "a=b", "=", "alpha=0.9", "None", "True", "true", "0x10", "１２"),
    *("", " ", ".", "..", "/", "a/b", "../x", "/dev/null", "/dev/full", "~", "*", "a" * 300),
    *("\udcff", "\x1b[31mred", "[red]x[/]", "[/]", "{x}", "%s", "a\nb", "\u202e", "é", "🙂" * 9),
    *("cpu", "gpu", "exact", "gymnasium", "onnx", "quick", "full", "local"),
    *("sqlite://", "sqlite:///x.db", "sqlite:///x.db?timeout=abc", "nosuch://h/x"),
    *("postgresql://u:p@h:abc/db", "postgresql:/u:p@h/db", "postgresql+nosuch://u:p@h/db"),
    *("-", "--", "-h", "--help", "-x", "--=", "--=x", "help"),
]
FLAGS = sorted(
    {word for kind in parse.COMMANDS.values() for f in flags_of(kind) for word in f.words}
)

text = st.text(st.characters(exclude_characters="\0"), max_size=12)
values = st.one_of(
    st.sampled_from(WORDS), text, st.integers().map(str), st.floats().map(str), st.just("1")
)


def _mutated(flag: str, change: int) -> str:
    """A flag with a letter left out, with underscores, in capitals, or as it is."""
    at = 2 + change % max(1, len(flag) - 2)
    return [
        flag,
        flag,
        flag,
        flag,
        flag.replace("-", "_"),
        flag[:at] + flag[at + 1 :],
        flag.upper(),
    ][change % 7]


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    """A verb, mostly one that exists, then flags, mostly its own, with values and loose words."""
    verb = draw(st.sampled_from(sorted(parse.COMMANDS)))
    own = [word for flag in flags_of(parse.COMMANDS[verb]) for word in flag.words]
    own = [word for word in own if word.startswith("--")]
    argv = verb.split() if draw(st.integers(0, 19)) else [draw(values)]
    for _ in range(draw(st.integers(0, 5))):
        kind = draw(st.integers(0, 9))
        if kind < 3:
            argv.append(draw(values))
            continue
        flag = draw(st.sampled_from(own)) if kind < 9 else draw(st.sampled_from(FLAGS))
        flag = _mutated(flag, draw(st.integers(0, 69)))
        if kind < 6:
            argv += [flag, draw(values)]
        elif kind == 6:
            argv.append(f"{flag}={draw(values)}")
        else:
            argv.append(flag)
    return argv


def _stopped(*_: object, **__: object) -> None:
    raise Interrupted("stopped where the work begins")


def _use_device(name: str) -> None:
    if name == "gpu":
        raise UserError("device 'gpu': JAX finds no such device")


def _store(path, *, make=False, open_store=store.open_store):
    return store.Store(path) if make else open_store(path)


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with one run; what would train, fly, draw or write for long stops at once."""
    place = tmp_path_factory.mktemp("fuzz")
    folders.create(place / "runs", presets.preset("pilot"), "mine")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for where, name in (
            (training, "complete"),
            (folders, "create"),
            (evaluation, "evaluate_policy"),
            (recorder, "record_flight"),
            (film, "show_window"),
            (comparison, "write_comparison"),
            (paper_page, "write_paper_report"),
            (study_page, "write_study_report"),
            (pid_tuning, "tune_pid"),
            (study_run, "_note_started"),
            (study_run, "estimate"),
        ):
            patch.setattr(where, name, _stopped)
        patch.setattr("touchdown.exports.graph.check_installed", _stopped)
        patch.setattr("touchdown.policies.weights.read_weights", _stopped)
        patch.setattr("optuna.storages.RDBStorage", _stopped)
        patch.setattr("touchdown.studies.ray_executor.RayExecutor", _stopped)
        patch.setattr(store, "open_store", _store)
        patch.setattr(device, "use", _use_device)
        patch.setattr(doctor, "check_up", lambda _: [])
        patch.setattr(environment, "spaces_of", functools.cache(environment.spaces_of))
        yield place


@pytest.mark.usefixtures("here")
@hypothesis.settings(max_examples=150)
@hypothesis.given(command_lines())
def test_any_arguments_end_in_one_line(argv):
    ends_in_one_line(argv)


@pytest.mark.slow
@pytest.mark.usefixtures("here")
@hypothesis.settings(max_examples=LONG_CASES)
@hypothesis.given(command_lines())
def test_very_many_arguments_end_in_one_line(argv):
    ends_in_one_line(argv)
