from pathlib import Path

import numpy as np
import polars as pl
import pytest

from touchdown.stats import simulation
from touchdown.stats.procedures import PROCEDURES
from touchdown.stats.scenarios import SCENARIOS
from touchdown.stats.simulation import CheckRow, fewest_seeds, simulate, to_markdown

pytestmark = pytest.mark.usefixtures("without_collecting")
COMMITTED = Path(__file__).parents[2] / "docs/error-rates.csv"


def rows_of(*names, repetitions=400, counts=(20,)):
    chosen = [each for each in PROCEDURES if each.name in names]
    assert len(chosen) == len(names)
    return simulate(repetitions, counts=counts, procedures=chosen)


def by_scenario(rows):
    return {row.scenario: row for row in rows}


def test_means_err_where_runs_fail_and_pairs_do_not():
    means = by_scenario(rows_of("means (Welch)"))
    pairs = by_scenario(rows_of("most pairs (Brunner-Munzel)"))
    assert means["normal"].keeps
    assert means["3% fail"].error > 0.3
    assert max(row.error for row in pairs.values()) < 0.09
    assert means["10% fail"].power < 0.1
    assert pairs["10% fail"].power > 0.9


def test_a_row_depends_on_the_seed_and_on_itself_alone():
    alone = rows_of("failures (Fisher)", counts=(20,))
    among = rows_of("mean (Student)", "failures (Fisher)", counts=(10, 20))
    assert set(map(str, alone)) <= set(map(str, among))
    chosen = [each for each in PROCEDURES if each.name == "mean (Student)"]
    (one, other) = (simulate(50, seed, counts=(8,), procedures=chosen) for seed in (0, 1))
    assert one != other


@pytest.mark.parametrize("procedure", [each for each in PROCEDURES if each.kind == "verdict"])
def test_verdicts_are_seldom_wrong_and_sometimes_right(procedure):
    rows = by_scenario(simulate(300 / procedure.share, counts=(20,), procedures=[procedure]))
    assert max(row.error for row in rows.values()) < 0.1
    assert rows["normal"].power > 0.8


def made(n, error=0.05, coverage=0.95, kind="test", scenario="normal"):
    return CheckRow(kind, "p", scenario, n, 10**9, error, 0.01, coverage, np.nan)


def test_the_fewest_seeds_keep_the_limit_with_all_larger_numbers_too():
    rows = [made(5, 0.2), made(10), made(20, 0.07), made(30), made(50, 0.06)]
    assert fewest_seeds(rows, "p") == 30
    assert fewest_seeds([made(5), made(50, 0.061)], "p") is None
    assert fewest_seeds([*rows, made(50, 0.2, scenario="ties")], "p") is None
    assert fewest_seeds([made(5, 1, 0.93, "interval"), made(8, 1, 0.94, "interval")], "p") == 5


def test_the_tables_mark_what_breaks_its_limit():
    text = to_markdown([made(5, 0.2), made(10, 0.051)])
    assert "| p | test | error 20.0% | 10 seeds |" in text
    assert "| normal | **20.0** | 5.1 |" in text


def test_every_procedure_is_in_the_committed_table():
    table = pl.read_csv(COMMITTED)
    assert set(table["procedure"]) == {each.name for each in PROCEDURES}
    assert len(table) == simulation.count_rows()
    assert set(table["scenario"]) == {each.name for each in SCENARIOS}
