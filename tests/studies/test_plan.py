import pytest

from touchdown.config.presets import preset
from touchdown.core.errors import UserError
from touchdown.studies.plan import FIRST_TUNING_SEED, Factor, Level, Study, from_toml, levels_of

GAMMAS = Factor("γ", levels_of("learning.gamma", [0.9, 0.99]))
SIZES = Factor("nodes", levels_of("network.hidden_sizes", [[10], [20, 20]]))


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
        ("nmae = 'x'", "unknown field 'nmae'; known: format_version, name"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = []", "has no levels"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = [7.0]", r"gamma = 7\.0: must be from 0"),
        ("[[factor]]\nfield = 'learning.gama'\nvalues = [0.9]", "unknown field 'gama'"),
        ("[[factor]]\nfield = 'learning.gamma'\nvalues = [0.9, 0.9]", "has level '0.9' twice"),
        ("[[factor]]\nvalues = [1]", "must have a field, or a name"),
        ("[[factor]]\nname = 'x'\n[[factor.level]]\ngamma = 1", "must be a table with a label"),
        ("seeds = 0.5", r"seeds = 0\.5: must be a whole number"),
        ("base = 'nothing'\n[[factor]]\nfield = 'seed'\nvalues = [1]", "preset 'nothing'"),
        ("format_version = 9", "format_version = 9: must be 1 in this version"),
        ("seeds = 3", "has 0 factors, must be 1 or 2"),
        ("factor = 3", "factor = 3: must be tables"),
        ("name = 'a/b'\n[[factor]]\nfield = 'learning.gamma'\nvalues = [0.9]", "name = 'a/b'"),
    ],
)
def test_a_broken_file_gets_one_line_that_names_it(tmp_path, text, said):
    path = write(tmp_path / "mine.toml", text)
    with pytest.raises(UserError, match=said) as error:
        from_toml(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


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
