import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from touchdown.core.errors import UserError
from touchdown.stats.simulation import CheckRow, fewest_seeds
from touchdown.studies.assurance import FURTHER_SEEDS
from touchdown.studies.claim_tests import (
    FEWEST_FOR_PAIRS,
    Alike,
    Best,
    Beyond,
    Greater,
    Near,
    SweetSpot,
    Trend,
)
from touchdown.studies.claims import Claim, decide
from touchdown.studies.findings import Finding

ERROR_RATES = Path(__file__).parents[2] / "docs/error-rates.csv"
pytestmark = pytest.mark.usefixtures("without_collecting")


def decisions(tests, metric="best_return", **cells):
    """What is decided of each test where cells have these numbers, whatever the metric."""

    def values(cell, _metric):
        return np.array(cells.get(cell, []), float)

    return decide([Claim("it is so", test) for test in tests], values, metric)


def verdicts(tests, metric="best_return", **cells):
    return [decision.verdict for decision in decisions(tests, metric, **cells)]


def around(middle, spread=1.0):
    """Twelve different numbers."""
    return middle + spread * np.linspace(-2, 2, 12)


LOW, MIDDLE, HIGH = around(2), around(52), around(102)
A, B, C = "a", "b", "c"


@pytest.mark.parametrize(
    ("test", "so", "not_so"),
    [
        (Greater(A, B, margin=20), {"a": HIGH, "b": LOW}, {"a": LOW, "b": HIGH}),
        (Greater(A, B, margin=20, failure=50), {"a": HIGH, "b": LOW}, {"a": LOW, "b": HIGH}),
        (
            Trend((A, B, C), 20),
            {"a": LOW, "b": MIDDLE, "c": HIGH},
            {"a": HIGH, "b": MIDDLE, "c": LOW},
        ),
        # a jump, then a decline
        (
            Trend((A, B, C), 20),
            {"a": LOW, "b": HIGH, "c": HIGH + 5},
            {"a": LOW, "b": HIGH, "c": MIDDLE},
        ),
        (
            Trend((A, B, C), 20, "fall"),
            {"a": HIGH, "b": MIDDLE, "c": LOW},
            {"a": LOW, "b": MIDDLE, "c": HIGH},
        ),
        (
            SweetSpot(B, A, C, 20),
            {"a": LOW, "b": HIGH, "c": MIDDLE},
            # better than one end only
            {"a": LOW, "b": MIDDLE, "c": HIGH},
        ),
        (
            Best((B,), (A, B, C), 20),
            {"a": LOW, "b": HIGH, "c": MIDDLE},
            {"a": HIGH, "b": MIDDLE, "c": LOW},
        ),
        (Beyond(A, 50), {"a": HIGH}, {"a": LOW}),
        (Beyond(A, 50, "below"), {"a": LOW}, {"a": HIGH}),
        (Near(A, 100, 10), {"a": HIGH}, {"a": MIDDLE}),
        (Alike((A, B), 20), {"a": LOW, "b": LOW + 3}, {"a": LOW, "b": MIDDLE}),
        (Alike((A, B, C), 20), {"a": LOW, "b": LOW + 3, "c": LOW}, {"a": LOW, "b": HIGH, "c": LOW}),
    ],
)
def test_a_claim_holds_or_does_not_as_the_numbers_say(test, so, not_so):
    assert verdicts([test], **so) == ["holds"]
    assert verdicts([test], **not_so) == ["does not hold"]
    noise = {name: around(50, 300) for name in so}
    assert verdicts([test], **noise) == ["undecided"]
    few = {name: numbers[:5] for name, numbers in so.items()}
    assert verdicts([test], **few) == ["undecided"]


@pytest.mark.parametrize(
    "test",
    [
        Greater(A, B, margin=20),
        Greater(A, B, margin=20, failure=-9),
        Trend((A, B, C), 20),
        SweetSpot(A, B, C, 20),
        Best((A,), (A, B, C), 20),
    ],
)
def test_equal_settings_have_no_difference_that_matters(test):
    rng = np.random.default_rng(0)
    many = {name: rng.normal(102, 3, size=60) for name in "abc"}
    assert verdicts([test], **many) == ["no difference that matters"]


def test_more_than_the_number_is_reached_and_exceeded_for_returns_alone():
    assert verdicts([Near(A, 50, 10)], a=HIGH) == ["reached and exceeded"]
    shares = around(0.5, 0.01)
    assert verdicts([Near(A, 0.1, 0.05)], "hover_share", a=shares) == ["does not hold"]


def test_failing_less_often_is_better_although_the_typical_run_is_the_same():
    rng = np.random.default_rng(0)
    steady, failing = rng.normal(240, 5, size=40), rng.normal(240, 5, size=40)
    failing[:9] = -100
    tests = [Greater(A, B, margin=20, failure=100), Greater(B, A, margin=20, failure=100)]
    assert verdicts(tests, a=steady, b=failing) == ["holds", "does not hold"]
    (found, _) = decisions(tests, a=steady, b=failing)
    assert re.search(
        r"failed, below 100: a 0 of 40 \[0%, 9%\], b 9 of 40 \[11%, 38%\]", found.evidence
    )


def test_two_failures_of_twelve_do_not_make_a_better_setting_worse():
    better = np.concatenate([around(262, 5)[2:], [-57, -579]])
    assert better.mean() < 230
    assert verdicts([Greater(A, B, margin=20)], a=better, b=around(230, 5)) == ["holds"]


def test_times_of_seeds_that_never_got_there_are_the_longest():
    never = np.inf
    slow = [*around(200_000, 1_000)[:4], *[never] * 8]
    (found,) = decisions(
        [Greater(A, B, margin=10_000)], "env_steps_to_solved", a=slow, b=around(100_000, 1_000)
    )
    assert found.verdict == "holds"
    assert "medians a: inf, b: 100,000" in found.evidence


WEAK = {"a": around(12, 2), "b": around(9, 2)}


def test_claims_of_one_study_are_corrected_for_each_other():
    test = Greater(A, B, margin=20)
    (alone,) = decisions([test], **WEAK)
    among = decisions([test] * 4, **WEAK)[0]
    assert among.p_value == pytest.approx(4 * alone.p_value)
    assert among.p_raw == alone.p_raw


def test_a_verdict_at_the_corrected_level_is_undecided_above_it():
    a, b = around(100, 25), around(65, 25)
    test = Greater(A, B, margin=20)
    p = Finding(test.rule([a, b], ""), "", 12).p_value
    assert 0.005 < p < 0.05
    assert verdicts([test], a=a, b=b) == ["holds"]
    assert set(verdicts([test] * 10, a=a, b=b)) == {"undecided"}


def test_what_is_undecided_says_how_many_seeds_decide_it_with_80_percent():
    a, b = around(100, 25), around(78, 25)
    (found,) = decisions([Greater(A, B, margin=20)], a=a, b=b)
    assert found.verdict == "undecided"
    assert found.more_seeds in FURTHER_SEEDS
    assert found.evidence.endswith(
        f"{found.more_seeds} more seeds of each decide it with 80% probability"
    )
    # beside other claims the test is stricter, and asks for more
    among = decisions([Greater(A, B, margin=20)] * 8, a=a, b=b)[0]
    assert among.more_seeds > found.more_seeds


def test_what_no_number_of_seeds_decides_says_so():
    rng = np.random.default_rng(0)
    far = {name: rng.normal(0, 1_000, size=12) for name in "ab"}
    (found,) = decisions([Alike((A, B), 1)], **far)
    assert found.more_seeds is None
    assert "160 more seeds of each decide it with less than 80% probability" in found.evidence


def test_too_few_seeds_are_told_as_such():
    (found,) = decisions([Greater(A, B, margin=20)], a=HIGH, b=LOW[:9])
    assert (found.verdict, found.seeds, found.p_raw) == ("undecided", 9, 1)
    assert found.evidence == "9 finished seeds of each level; the test needs 10"
    (found,) = decisions([Beyond(A, 50)], a=HIGH[:5])
    assert found.evidence == "5 finished seeds of each level; the test needs 6"
    assert verdicts([Beyond(A, 50)], a=HIGH[:6]) == ["holds"]


def test_the_fewest_seeds_are_those_of_the_committed_table():
    table = pl.read_csv(ERROR_RATES)
    rows = [CheckRow(**{**row, "power": 0.0}) for row in table.fill_null(0).iter_rows(named=True)]
    of_pairs = [
        "most pairs (Brunner-Munzel)",
        *{row.procedure for row in rows if row.kind == "verdict" and "near" not in row.procedure},
    ]
    for name in of_pairs:
        assert fewest_seeds(rows, name) <= FEWEST_FOR_PAIRS, name
    for name in ("near, at the margin", "median (order statistics)", "failures (Fisher)"):
        assert fewest_seeds(rows, name) == min(row.seeds for row in rows), name


def test_a_claim_is_about_its_own_metric_or_the_studys():
    numbers = {"area": {"a": LOW, "b": HIGH}, "best_return": {"a": HIGH, "b": LOW}}

    def values(cell, metric):
        return np.array(numbers[metric][cell], float)

    test = Greater(A, B, margin=20)
    claims = [Claim("So.", test), Claim("Not so.", test, "area")]
    of_returns = decide(claims, values, "best_return")
    assert [decision.verdict for decision in of_returns] == ["holds", "does not hold"]
    assert [decision.metric for decision in of_returns] == ["best_return", "area"]
    of_areas = decide(claims, values, "area")
    assert [decision.verdict for decision in of_areas] == ["does not hold"] * 2


def test_numbers_that_a_run_does_not_have_are_left_out():
    some = np.concatenate([around(0.9, 0.01), [np.nan]])
    (found,) = decisions([Beyond(A, 0.5)], "share_solved", a=some)
    assert (found.verdict, found.seeds) == ("holds", 12)
    assert found.evidence.startswith("a: median 90.0% [")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Claim("", Greater(A, B, 1)), "sentence = '': must be text on one line"),
        (lambda: Claim("a\nb", Greater(A, B, 1)), "must be text on one line"),
        (lambda: Claim("So.", "greater"), "test = 'greater': must be one of Greater, Trend"),
        (lambda: Claim("So.", Greater(A, B, 1), metric=3), "metric = 3: must be a string"),
        (lambda: Greater(A, A, 1), "level 'a': occurs twice"),
        (lambda: Greater(1, B, 1), "above = 1: must be the label of a level"),
        (lambda: Greater(A, B, 0), r"margin = 0\.0: must be above 0"),
        (lambda: Near(A, 1, within=-1), r"within = -1\.0: must be above 0"),
        (lambda: Trend("ab", 1), "levels = 'ab': must be a list of levels' labels"),
        (lambda: Trend([A, B], 1, "up"), "direction = 'up': must be one of rise, fall"),
    ],
)
def test_a_claim_that_makes_no_sense_is_refused_where_it_is_made(make, said):
    with pytest.raises(UserError, match=said):
        make()


def test_a_list_of_levels_is_as_good_as_a_tuple():
    assert Trend([A, B], 1) == Trend((A, B), 1)
