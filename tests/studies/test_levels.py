from numpy.testing import assert_allclose

from finished_runs import write_run
from touchdown.stats.compare import compare
from touchdown.studies.levels import summarise_levels
from touchdown.studies.plan import Factor, Study
from touchdown.studies.results import read_study
from touchdown.studies.store import open_store

GAMMAS = Factor.of("learning.gamma", [0.9, 0.95, 0.99])
RETURNS = {"0.9": [10, 20, 30], "0.95": [110, 120, 130], "0.99": [12, 20, 34]}


def results_of(folder, returns, **fields):
    """A study whose finished runs have these test returns, by level, seed by seed."""
    store = open_store(folder / "results", make=True)
    study = Study(name="made-up", factors=[GAMMAS], seeds=3, **fields)
    for run in study.runs():
        of_level = returns.get(run.cell.name, [])
        if run.seed < len(of_level):
            write_run(store.runs / run.digest, (of_level[run.seed],), (of_level[run.seed] - 5,))
    return read_study(study, 3, store)


def test_levels_are_summarised_and_compared_with_the_base(tmp_path):
    base, better, third = summarise_levels(
        results_of(tmp_path, RETURNS, base_level="0.9"), "best_return"
    )
    assert [level.cell.name for level in (base, better, third)] == ["0.9", "0.95", "0.99"]
    assert (base.is_base, better.is_base) == (True, False)
    assert base.against_base is None
    assert (base.seeds.n, base.seeds.mean.value, base.last_weights) == (3, 20, 15)
    assert (base.env_steps_to_solved.median, base.seconds_to_solved.median) == (3_500, 35)
    found = better.against_base
    assert found.comparison == compare([10, 20, 30], [110, 120, 130])
    assert_allclose(found.comparison.difference.value, 100)
    # Holm: the smaller of two p is doubled, the larger is not
    assert_allclose(found.p_corrected, 2 * found.comparison.p_value)
    assert_allclose(third.against_base.p_corrected, third.against_base.comparison.p_value)


def test_another_metric_is_summarised_in_the_same_way(tmp_path):
    found = summarise_levels(results_of(tmp_path, RETURNS), "hover_share")
    assert [level.seeds.mean.value for level in found] == [0.5] * 3
    assert [level.last_weights for level in found] == [15, 115, 17]


def test_a_level_without_runs_is_left_out_and_one_seed_is_not_compared(tmp_path):
    found = summarise_levels(
        results_of(tmp_path, RETURNS | {"0.95": [120], "0.99": []}), "best_return"
    )
    assert [level.cell.name for level in found] == ["0.9", "0.95"]
    assert [level.against_base for level in found] == [None, None]


def test_without_the_base_nothing_is_compared(tmp_path):
    (only,) = summarise_levels(results_of(tmp_path, {"0.95": [1, 2, 3]}), "best_return")
    assert (only.is_base, only.against_base) == (False, None)
