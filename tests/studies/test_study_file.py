"""A study file is a study, and a study is a study file."""

import re

import pytest

from touchdown.config.presets import preset
from touchdown.core.errors import UserError
from touchdown.studies import paper
from touchdown.studies.claim_tests import Alike, Best, Beyond, Greater, Near, SweetSpot, Trend
from touchdown.studies.claims import Claim
from touchdown.studies.plan import Factor, Level, Study
from touchdown.studies.study_file import from_toml, to_toml

GAMMA = """
[[factor]]
field = "learning.gamma"
values = [0.9, 0.95, 0.99]
"""


def write(path, text):
    path.write_text(text, "utf-8")
    return path


def test_a_study_in_a_file(tmp_path):
    study = from_toml(
        write(
            tmp_path / "mine.toml",
            """
            base = "vector-dqn"
            base_level = "double"
            seeds = 4
            first_seed = 20
            metric = "area"
            [config.training]
            max_env_steps = 1000
            [[factor]]
            name = "target"
            [[factor.level]]
            label = "plain"
            [[factor.level]]
            label = "double"
            learning.double = true
            [[factor]]
            field = "learning.gamma"
            values = [0.9]
            """,
        )
    )
    assert (study.name, study.seeds) == ("mine", 4)
    assert (study.first_seed, study.metric) == (20, "area")
    assert study.base_cell().labels == ("double", "0.9")
    plain, double = study.cells()
    assert plain.config.training.max_env_steps == 1000
    assert plain.config.network == preset("vector-dqn").network
    assert (plain.config.learning.double, double.config.learning.double) == (False, True)
    assert double.labels == ("double", "0.9")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nmae = 'x'", "unknown field 'nmae'; did you mean name?"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = []", "has no levels"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = [7.0]", r"gamma = 7\.0: must be from 0"),
        ("[[factor]]\nfield = 'learning.gama'\nvalues = [0.9]", "unknown field 'gama'"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = [0.9, 0.9]", "has '0.9' twice"),
        ("[[factor]]\nvalues = [1]", "must have a field, or a name"),
        ("[[factor]]\nname = 'x'\n[[factor.level]]\ngamma = 1", "must be a table with a label"),
        ("seeds = 0.5", r"seeds = 0\.5: must be a whole number"),
        ("base = 'nothing'\n[[factor]]\nfield = 'seed'\nvalues = [1]", "preset 'nothing'"),
        ("format_version = 9", "format_version = 9: must be 1 in this version"),
        ("seeds = 3", "has 0 factors, must be from 1 to 3"),
        ("factor = 3", "factor = 3: must be tables"),
        ("claim = 3", r"claim = 3: must be tables"),
        ("base = 3", "base = 3: must be a preset's name or a table"),
        ("[base]\ngamma = 1", r"mine\.toml \[base\]: unknown field 'gamma'"),
        ("name = 'a/b'\n[[factor]]\nfield = 'learning.gamma'\nvalues = [0.9]", "name = 'a/b'"),
    ],
)
def test_a_broken_file_gets_one_line_that_names_it(tmp_path, text, said):
    path = write(tmp_path / "mine.toml", text)
    with pytest.raises(UserError, match=said) as error:
        from_toml(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


SAME = """
title = "Nodes"
question = "How many?"
base = "target-dqn"
base_level = "wide"
seeds = 2
first_seed = 3
looks = [10, 20]
metric = "last_return"

[config.training]
max_env_steps = 5_000

[[factor]]
name = "nodes"
[[factor.level]]
label = "few"
position = 10
network.hidden_sizes = [10]
[[factor.level]]
label = "wide"
position = 200
series = "one layer"
network = { hidden_sizes = [200] }
learning.double = true
[[factor.level]]
label = "other"
preset = "pilot"

[[claim]]
sentence = "Wider is better."
kind = "greater"
above = "wide"
below = "few"
margin = 20
failure = 100

[[claim]]
sentence = "It rises."
kind = "trend"
levels = ["few", "wide", "other"]
margin = 20
metric = "area"
section = "8.1"

[[claim]]
sentence = "It falls."
kind = "trend"
levels = ["few", "wide"]
margin = 0.5
direction = "fall"

[[claim]]
sentence = "The middle is best."
kind = "sweet-spot"
inside = "wide"
first = "few"
last = "other"
margin = 20

[[claim]]
sentence = "The others are not."
kind = "best"
among = ["wide"]
levels = ["few", "wide", "other"]
margin = 20

[[claim]]
sentence = "It lands."
kind = "beyond"
level = "wide"
number = 200

[[claim]]
sentence = "It does not."
kind = "beyond"
level = "few"
number = 100.0
side = "below"

[[claim]]
sentence = "About 170."
kind = "near"
level = "wide"
number = 170
within = 20

[[claim]]
sentence = "No difference that matters."
kind = "alike"
levels = ["wide", "other"]
within = 20
metric = "area"
"""


def same_in_python() -> Study:
    """`SAME`, line by line."""
    return Study(
        name="same",
        title="Nodes",
        question="How many?",
        base="target-dqn",
        base_level="wide",
        seeds=2,
        first_seed=3,
        looks=(10, 20),
        metric="last_return",
        changes={"training.max_env_steps": 5_000},
        factors=[
            Factor(
                "nodes",
                [
                    Level("few", {"network.hidden_sizes": (10,)}, position=10),
                    Level(
                        "wide",
                        {"network": {"hidden_sizes": [200]}, "learning.double": True},
                        position=200,
                        series="one layer",
                    ),
                    Level("other", {"preset": "pilot"}),
                ],
            )
        ],
        claims=[
            Claim("Wider is better.", Greater(above="wide", below="few", margin=20, failure=100)),
            Claim("It rises.", Trend(("few", "wide", "other"), 20), metric="area", section="8.1"),
            Claim("It falls.", Trend(("few", "wide"), 0.5, "fall")),
            Claim(
                "The middle is best.",
                SweetSpot(inside="wide", first="few", last="other", margin=20),
            ),
            Claim("The others are not.", Best(("wide",), ("few", "wide", "other"), margin=20)),
            Claim("It lands.", Beyond("wide", 200)),
            Claim("It does not.", Beyond("few", 100, "below")),
            Claim("About 170.", Near("wide", 170, within=20)),
            Claim("No difference that matters.", Alike(("wide", "other"), 20), "area"),
        ],
    )


def test_a_study_in_a_file_and_the_same_in_python_are_equal_and_plan_the_same_runs(tmp_path):
    from_file, in_python = from_toml(write(tmp_path / "same.toml", SAME)), same_in_python()
    assert from_file == in_python
    planned = [run.digest for run in from_file.runs()]
    assert planned == [run.digest for run in in_python.runs()]
    assert len(set(planned)) == 6


def test_a_study_comes_back_from_its_toml(tmp_path):
    study = same_in_python()
    assert from_toml(write(tmp_path / "x.toml", to_toml(study))) == study
    settings = Study(name="x", factors=study.factors, base=preset("vector-dqn"))
    again = from_toml(write(tmp_path / "x.toml", to_toml(settings)))
    assert again == settings
    assert [run.digest for run in again.runs()] == [run.digest for run in settings.runs()]


@pytest.mark.parametrize("scale", paper.SCALES)
def test_every_study_of_the_paper_can_be_a_file(scale, tmp_path):
    for study in paper.studies(scale).values():
        assert from_toml(write(tmp_path / "x.toml", to_toml(study))) == study


def claim(**fields):
    """A table of a claim that is sound but for these fields; None leaves one out."""
    sound = {"sentence": "So.", "kind": "greater", "above": "0.99", "below": "0.9"}
    sound |= {"margin": 20} if fields.get("kind") not in ("beyond", "near", "alike") else {}
    table = {name: value for name, value in (sound | fields).items() if value is not None}
    return "[[claim]]\n" + "".join(f"{name} = {value!r}\n" for name, value in table.items())


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"sentence": None}, "[[claim]] 2: sentence: missing"),
        ({"sentence": ""}, "[[claim]] 2: sentence = '': must be text on one line"),
        ({"sentence": 3}, "[[claim]] 2: sentence = 3: must be a string"),
        ({"kind": None}, "[[claim]] 2: kind: missing; must be one of greater, trend, sweet-spot"),
        ({"kind": "more"}, "[[claim]] 2: kind = 'more': unknown; must be one of greater, trend"),
        ({"kind": 3}, "[[claim]] 2: kind = 3: unknown"),
        ({"above": None}, "[[claim]] 2: above: missing"),
        (
            {"abov": "0.9"},
            "unknown field 'abov' for greater; must be one of sentence, kind, metric",
        ),
        ({"above": 0.99}, "above = 0.99: must be the label of a level, such as '0.99'"),
        ({"above": "0.95"}, None),
        ({"above": "0.7"}, "claim 'So.': level '0.7': unknown; must be one of 0.9, 0.95, 0.99"),
        ({"above": "0.9"}, "[[claim]] 2: level '0.9': occurs twice, must occur once"),
        ({"metric": "luck"}, "claim 'So.': metric = 'luck': must be one of best_return"),
        ({"metric": 3}, "[[claim]] 2: metric = 3: must be a string"),
    ],
)
def test_a_claim_that_cannot_be_decided_gets_one_line_that_names_it(tmp_path, fields, said):
    path = write(tmp_path / "mine.toml", GAMMA + claim() + claim(**fields))
    if said is None:  # a decoy: the level is there
        assert len(from_toml(path).claims) == 2
        return
    with pytest.raises(UserError, match=re.escape(said)) as error:
        from_toml(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = 'trend'\nmargin = 1\nlevels = ['0.9']", "levels = ['0.9']: must be at least 2"),
        (
            "kind = 'trend'\nmargin = 1\nlevels = '0.9'",
            "levels = '0.9': must be a list of levels' labels",
        ),
        (
            "kind = 'trend'\nmargin = 1\nlevels = [0.9]",
            "levels[0] = 0.9: must be the label of a level",
        ),
        (
            "kind = 'trend'\nlevels = ['0.9', '0.99']\nmargin = 1\ndirection = 'up'",
            "direction = 'up': must be one of rise, fall",
        ),
        (
            "kind = 'trend'\nmargin = 1\nlevels = ['0.9', '0.99', '0.9']",
            "level '0.9': occurs twice",
        ),
        (
            "kind = 'sweet-spot'\ninside = '0.95'\nfirst = '0.9'\nlast = '0.95'\nmargin = 1",
            "level '0.95': occurs twice",
        ),
        (
            "kind = 'best'\nmargin = 1\namong = ['0.9', '0.99']\nlevels = ['0.9', '0.99']",
            "among = ['0.9', '0.99']: must be some of levels, not all",
        ),
        (
            "kind = 'best'\nmargin = 1\namong = []\nlevels = ['0.9', '0.99']",
            "among = []: must be some",
        ),
        ("kind = 'beyond'\nlevel = '0.9'\nnumber = 'high'", "number = 'high': must be a number"),
        ("kind = 'beyond'\nlevel = '0.9'\nnumber = nan", "number = nan: must be a finite"),
        ("kind = 'beyond'\nlevel = '0.9'\nnumber = 1\nside = 'at'", "side = 'at': must be one"),
        ("kind = 'near'\nlevel = '0.9'\nnumber = 1", "[[claim]] 1: within: missing"),
        ("kind = 'trend'\nlevels = ['0.9', '0.99']", "[[claim]] 1: margin: missing"),
        ("kind = 'greater'\nabove = '0.9'\nbelow = '0.99'\nmargin = 0", "margin = 0.0: must be"),
        ("kind = 'near'\nlevel = '0.9'\nnumber = 1\nwithin = 0", "within = 0.0: must be above 0"),
        (
            "kind = 'alike'\nlevels = ['0.9', '0.99']\nwithin = -5",
            "within = -5.0: must be above 0",
        ),
    ],
)
def test_a_kind_of_claim_refuses_fields_that_make_no_sense(tmp_path, text, said):
    path = write(tmp_path / "mine.toml", f"{GAMMA}[[claim]]\nsentence = 'So.'\n{text}")
    with pytest.raises(UserError, match=re.escape(said)) as error:
        from_toml(path)
    assert str(error.value).startswith(f"{path}: [[claim]] 1: ")
