from dataclasses import replace

import numpy as np
import pytest

from touchdown.config.presets import preset
from touchdown.core.errors import UserError
from touchdown.studies.claim_tests import Beyond, Greater
from touchdown.studies.claims import Claim
from touchdown.studies.plan import FIRST_TUNING_SEED, Factor, Level, Study, levels_of

GAMMAS = Factor("γ", levels_of("learning.gamma", [0.9, 0.99]))
SIZES = Factor("nodes", levels_of("network.hidden_sizes", [[10], [20, 20]]))


THREE = [Factor(name, [Level(name)]) for name in ("algorithm", "environment", "settings")]


def test_a_study_has_a_run_for_each_level_of_each_factor_and_each_seed():
    study = Study(name="both", factors=(GAMMAS, SIZES), seeds=3)
    assert [cell.labels for cell in study.cells()] == [
        ("0.9", "10"), ("0.9", "20-20"), ("0.99", "10"), ("0.99", "20-20"),
    ]  # fmt: skip
    runs = study.runs()
    assert [run.seed for run in runs] == [0] * 4 + [1] * 4 + [2] * 4
    assert len({run.digest for run in runs}) == 12
    assert runs[1].config.network.hidden_sizes == (20, 20)
    assert runs[1].config.learning.gamma == 0.9


def test_a_run_is_known_by_its_settings_and_its_seed_whatever_study_plans_it():
    one = Study(name="one", factors=(GAMMAS,), seeds=2, base="dqn")
    other = Study(
        name="other",
        factors=(Factor("x", (Level("a", {"preset": "dqn"}), Level("b", {"preset": "pilot"}))),),
        seeds=1,
        changes={"learning": {"gamma": 0.9}},
    )
    assert one.runs()[0].digest == other.runs()[0].digest
    assert one.runs()[0].digest != other.runs()[1].digest


def test_more_seeds_leave_the_runs_that_there_are():
    study = Study(name="one", factors=(GAMMAS,), seeds=2)
    few, many = ({run.digest for run in study.runs(n)} for n in (2, 5))
    assert few < many


def test_the_base_is_the_first_level_or_the_one_that_is_named():
    assert Study(name="a", factors=(GAMMAS,), seeds=1).base_cell().labels == ("0.9",)
    named = Study(name="a", factors=(GAMMAS,), seeds=1, base_level="0.99")
    assert named.base_cell().labels == ("0.99",)


def test_seeds_that_tune_are_out_of_a_studys_reach():
    with pytest.raises(UserError, match=f"must be from 1 to {FIRST_TUNING_SEED}"):
        Study(name="a", factors=(GAMMAS,), seeds=FIRST_TUNING_SEED + 1)


def test_tuning_seeds_begin_where_reported_ones_end():
    study = Study(name="a", factors=(GAMMAS,), seeds=2, first_seed=FIRST_TUNING_SEED)
    seeds = [FIRST_TUNING_SEED] * 2 + [FIRST_TUNING_SEED + 1] * 2
    assert [run.seed for run in study.runs()] == seeds
    with pytest.raises(UserError, match="seeds = 2: must be from 1 to 1"):
        Study(name="a", factors=(GAMMAS,), seeds=2, first_seed=FIRST_TUNING_SEED - 1)
    with pytest.raises(UserError, match="first_seed = -1: must be at least 0"):
        Study(name="a", factors=(GAMMAS,), seeds=2, first_seed=-1)


def test_a_study_without_a_test_is_about_validation_returns():
    untested = {"training": {"test_episodes": 0}}
    with pytest.raises(UserError, match="needs a test, and test_episodes is 0"):
        Study(name="a", factors=(GAMMAS,), seeds=2, changes=untested)
    Study(name="a", factors=(GAMMAS,), seeds=2, changes=untested, metric="validation_return")
    with pytest.raises(UserError, match="metric = 'luck': must be one of best_return"):
        Study(name="a", factors=(GAMMAS,), seeds=2, metric="luck")


def test_a_study_starts_from_settings_as_well_as_from_a_presets_name():
    named = Study(name="a", factors=(GAMMAS,), seeds=2, base="dqn")
    # the seed is the run's, not the base's
    settings = Study(name="a", factors=(GAMMAS,), seeds=2, base=replace(preset("dqn"), seed=7))
    assert [run.digest for run in named.runs()] == [run.digest for run in settings.runs()]
    level = Factor("x", [Level("own", {"preset": "pilot"})])
    (cell,) = Study(name="a", factors=[level], base=preset("dqn")).cells()
    assert cell.config.digest == preset("pilot").digest


def test_a_factor_of_one_field_has_a_level_for_each_value():
    factor = Factor.of("learning.gamma", np.array([0.9, 0.99]))
    assert (factor.name, factor.levels) == ("learning.gamma", GAMMAS.levels)
    assert Factor.of("learning.gamma", [0.9, 0.99], "γ") == GAMMAS


def test_changes_by_dotted_names_are_those_of_the_sections():
    dotted = Level("x", {"learning.double": True, "learning.gamma": np.float64(0.5)})
    assert dotted == Level("x", {"learning": {"double": True, "gamma": 0.5}})


def test_a_study_takes_lists_and_holds_what_cannot_change():
    claim = Claim("It is so.", Greater("0.99", "0.9", margin=20))
    study = Study(name="a", factors=[GAMMAS], claims=[claim])
    assert (study.factors, study.claims, study.seeds) == ((GAMMAS,), (claim,), 5)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"seeds": "3"}, "seeds = '3': must be a whole number"),
        ({"seeds": True}, "seeds = True: must be a whole number"),
        ({"base": 3}, "base = 3: must be a preset's name or a Config"),
        ({"base": "nothing"}, "preset 'nothing': unknown"),
        ({"changes": [1]}, r"changes = \[1\]: must be a dictionary of settings"),
        ({"changes": {"learning.gamma": 7.0}}, r"gamma = 7\.0: must be from 0"),
        ({"factors": GAMMAS}, "must be a list of Factor"),
        ({"factors": []}, "has 0 factors, must be from 1 to 3"),
        ({"factors": ["learning.gamma"]}, r"factors = \['learning.gamma'\]: must be a list of"),
        ({"claims": ["it is so"]}, r"claims = \['it is so'\]: must be a list of Claim"),
        ({"metric": "luck"}, "metric = 'luck': must be one of best_return"),
        ({"title": 3}, "title = 3: must be a string"),
        (
            {"factors": THREE, "metric": "hover_share"},
            "metric = 'hover_share': must be a return or",
        ),
        ({"base_level": "0.5"}, r"base_level = '0\.5': must be one of 0\.9, 0\.99"),
        ({"name": "a/b"}, "name = 'a/b': must be letters"),
    ],
)
def test_a_study_of_bad_fields_is_refused_where_it_is_made(fields, said):
    with pytest.raises(UserError, match=said) as error:
        Study(**({"name": "a", "factors": [GAMMAS], "seeds": 2} | fields))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Level(""), "label = '': must be text on one line"),
        (lambda: Level("a\nb"), r"label = 'a\\nb': must be text on one line"),
        (lambda: Level(0.9), r"label = 0\.9: must be a string"),
        (lambda: Level("a", {"learning.gamma": 1, "learning": {"gamma": 2}}), "is set twice"),
        (lambda: Level("a", "gamma"), "changes = 'gamma': must be a dictionary"),
        (lambda: Level("a", position="left"), "position = 'left': must be a number or null"),
        (lambda: Factor("x", []), "factor 'x': has no levels"),
        (lambda: Factor("x", ["a"]), r"levels = \['a'\]: must be a list of Level"),
        (lambda: Factor.of("learning.gamma", [0.9, 0.9]), "has '0.9' twice"),
    ],
)
def test_a_level_or_a_factor_that_makes_no_sense_is_refused_where_it_is_made(make, said):
    with pytest.raises(UserError, match=said):
        make()


def test_cells_of_one_name_are_refused():
    factors = [
        Factor("x", [Level("a · b"), Level("a", {"seed": 1})]),
        Factor("y", [Level("c"), Level("b · c")]),
    ]
    with pytest.raises(UserError, match="two cells are called 'a · b · c'"):
        Study(name="a", factors=factors)


def test_a_claim_about_what_the_study_does_not_have_is_refused():
    def study(*claims, **fields):
        return Study(**({"name": "a", "factors": [GAMMAS], "claims": claims} | fields))

    known = Claim("More.", Greater("0.99", "0.9", margin=20))
    study(known)
    with pytest.raises(
        UserError, match=r"claim 'More.': level '0\.95': unknown; must be one of 0\.9, 0\.99"
    ):
        study(Claim("More.", Greater("0.95", "0.9", margin=20)))
    # of two factors a level alone is no cell
    with pytest.raises(UserError, match=r"level '0\.99': unknown; must be one of 0\.9 · 10, "):
        study(known, factors=[GAMMAS, SIZES])
    study(Claim("More.", Greater("0.99 · 10", "0.9 · 10", margin=20)), factors=[GAMMAS, SIZES])
    with pytest.raises(UserError, match=r"claim 'Luck\.': metric = 'luck': must be one of"):
        study(Claim("Luck.", Beyond("0.9", 1), "luck"))
    untested = {
        "changes": {"training.test_episodes": 0},
        "metric": "validation_return",
    }
    study(known, **untested)
    with pytest.raises(UserError, match=r"claim 'Last\.': metric = 'last_return': needs a test"):
        study(Claim("Last.", Beyond("0.9", 1), "last_return"), **untested)
