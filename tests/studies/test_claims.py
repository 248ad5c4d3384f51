import re

import numpy as np
import pytest

from touchdown.core.errors import UserError
from touchdown.stats.compare import compare, margin
from touchdown.studies.claim_tests import Alike, Best, Beyond, Greater, Near, SweetSpot, Trend
from touchdown.studies.claims import Claim, decide

pytestmark = pytest.mark.usefixtures("without_collecting")


def verdicts(tests, **cells):
    """What each test says where cells have these numbers, whatever the metric."""

    def values(cell, _metric):
        return np.array(cells.get(cell, []), float)

    claims = [Claim("it is so", test) for test in tests]
    return [decision.verdict for decision in decide(claims, values)]


LOW, MIDDLE, HIGH = [1, 2, 3, 2], [51, 52, 53, 52], [101, 102, 103, 102]
A, B, C = "a", "b", "c"


@pytest.mark.parametrize(
    ("test", "so", "not_so"),
    [
        (Greater(A, B), {"a": HIGH, "b": LOW}, {"a": LOW, "b": HIGH}),
        (
            Trend((A, B, C)),
            {"a": LOW, "b": MIDDLE, "c": HIGH},
            {"a": HIGH, "b": MIDDLE, "c": LOW},
        ),
        (
            Trend((A, B, C), "fall"),
            {"a": HIGH, "b": MIDDLE, "c": LOW},
            {"a": LOW, "b": MIDDLE, "c": HIGH},
        ),
        (
            SweetSpot(B, A, C),
            {"a": LOW, "b": HIGH, "c": MIDDLE},
            # better than one end only
            {"a": LOW, "b": MIDDLE, "c": HIGH},
        ),
        (
            Best((B,), (A, B, C)),
            {"a": LOW, "b": HIGH, "c": MIDDLE},
            {"a": HIGH, "b": MIDDLE, "c": LOW},
        ),
        (Beyond(A, 50), {"a": HIGH}, {"a": LOW}),
        (Beyond(A, 50, "below"), {"a": LOW}, {"a": HIGH}),
        (Near(A, 100, 10), {"a": HIGH}, {"a": MIDDLE}),
        (Near(A, 5, 10), {"a": LOW}, {"a": MIDDLE}),
        (Alike(A, B, 20), {"a": LOW, "b": [2, 3, 4, 3]}, {"a": LOW, "b": MIDDLE}),
        (Alike(A, B, 20), {"a": [2, 3, 4, 3], "b": LOW}, {"a": MIDDLE, "b": LOW}),
    ],
)
def test_a_claim_holds_or_does_not_as_the_numbers_say(test, so, not_so):
    assert verdicts([test], **so) == ["holds"]
    assert verdicts([test], **not_so) == ["does not hold"]
    noise = {name: [-400, 500, -300, 400] for name in so}
    assert verdicts([test], **noise) == ["undecided"]
    assert verdicts([test], **{name: numbers[:1] for name, numbers in so.items()}) == ["undecided"]


def test_claims_of_one_study_are_corrected_for_each_other():
    weak = {"a": [10, 12, 14, 11], "b": [8, 10, 11, 9]}
    test = Greater(A, B)

    def values(cell, _metric):
        return np.array(weak[cell], float)

    alone = decide([Claim("x", test)], values)[0]
    among = decide([Claim("x", test)] * 4, values)[0]
    assert among.p_value == pytest.approx(4 * alone.p_value)


def seeds_more(claims, values):
    decision = decide([Claim("x", test) for test in claims], values)[0]
    assert decision.verdict == "undecided"
    return int(re.search(r"about (\d+) more seeds? of each", decision.evidence)[1])


def test_what_is_undecided_says_how_many_more_seeds_would_do():
    def values(cell, _metric):
        return np.array({"a": [10, 12, 14, 11], "b": [8, 10, 13, 9]}[cell], float)

    needed = compare(values(B, ""), values(A, "")).seeds_needed()
    assert seeds_more([Greater(A, B)], values) == needed - 4
    # beside other claims the test is stricter, and asks for more
    assert seeds_more([Greater(A, B)] * 4, values) > needed - 4


def test_what_the_correction_alone_left_open_takes_one_seed_more_at_least():
    def values(cell, _metric):
        return np.array({"a": [12, 14, 16, 13], "b": [8, 10, 13, 9]}[cell], float)

    assert verdicts([Greater(A, B)], a=values(A, ""), b=values(B, "")) == ["holds"]
    assert seeds_more([Greater(A, B)] * 3, values) >= 1


def test_what_is_far_from_near_needs_one_side_only_to_fail():
    def values(_labels, _metric):
        return np.array([120, 160, 175, 230], float)

    # the mean of 171 is far above 50 and hardly below 170 + 20: one side is enough against it
    assert (
        seeds_more([Near(A, 50, 100)], values) == margin(values(A, ""), 150).seeds_needed(0.025) - 4
    )


def test_a_claim_that_is_just_not_true_seldom_holds():
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(300):
        drawn = {"a": rng.normal(size=4), "b": rng.normal(size=4)}
        wrong += verdicts([Greater(A, B)], **drawn) == ["holds"]
    assert wrong / 300 < 0.05


def test_numbers_at_the_edge_of_near_are_seldom_called_near():
    rng = np.random.default_rng(1)
    wrong = sum(
        verdicts([Near(A, 0, 1)], a=rng.normal(1, 0.3, size=5)) == ["holds"] for _ in range(300)
    )
    assert wrong / 300 < 0.06


def test_a_claim_is_about_its_own_metric_or_the_studys():
    numbers = {"area": {"a": LOW, "b": HIGH}, "best_return": {"a": HIGH, "b": LOW}}

    def values(cell, metric):
        return np.array(numbers[metric][cell], float)

    claims = [Claim("So.", Greater(A, B)), Claim("Not so.", Greater(A, B), "area")]
    of_returns = decide(claims, values, "best_return")
    assert [decision.verdict for decision in of_returns] == ["holds", "does not hold"]
    assert [decision.metric for decision in of_returns] == ["best_return", "area"]
    of_areas = decide(claims, values, "area")
    assert [decision.verdict for decision in of_areas] == ["does not hold"] * 2


def test_a_decision_has_the_raw_p_the_corrected_one_and_the_seeds():
    def values(cell, _metric):
        return np.array({"a": [10, 12, 14, 11], "b": [8, 10, 13]}[cell], float)

    claim = Claim("So.", Greater(A, B))
    alone, (first, _) = decide([claim], values)[0], decide([claim] * 2, values)
    assert (
        alone.p_raw == alone.p_value == pytest.approx(compare(values(B, ""), values(A, "")).p_value)
    )
    assert (first.p_raw, first.p_value) == (alone.p_raw, pytest.approx(2 * alone.p_raw))
    assert alone.seeds == 3
    assert f"about {alone.more_seeds} more seeds" in alone.evidence
    (decided,) = decide(
        [Claim("So.", Greater(A, B))], lambda cell, _: np.array(HIGH if cell == A else LOW)
    )
    assert decided.more_seeds is None
    (too_few,) = decide([claim], lambda _cell, _metric: np.array([1.0]))
    assert (too_few.p_raw, too_few.seeds, too_few.more_seeds) == (1, 1, None)


def test_shares_are_shown_in_percent_whatever_named_the_metric():
    (found,) = decide(
        [Claim("So.", Beyond(A, 0.5))], lambda *_: np.array([0.1, 0.2]), "hover_share"
    )
    assert found.evidence.startswith("a 15.0% [")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Claim("", Greater(A, B)), "sentence = '': must be text on one line"),
        (lambda: Claim("a\nb", Greater(A, B)), "must be text on one line"),
        (lambda: Claim("So.", "greater"), "test = 'greater': must be one of Greater, Trend"),
        (lambda: Claim("So.", Greater(A, B), metric=3), "metric = 3: must be a string"),
        (lambda: Greater(A, A), "level 'a': occurs twice"),
        (lambda: Greater(1, B), "above = 1: must be the label of a level"),
        (lambda: Near(A, 1, within=-1), r"within = -1\.0: must be above 0"),
        (lambda: Trend("ab"), "levels = 'ab': must be a list of levels' labels"),
        (lambda: Trend([A, B], "up"), "direction = 'up': must be one of rise, fall"),
    ],
)
def test_a_claim_that_makes_no_sense_is_refused_where_it_is_made(make, said):
    with pytest.raises(UserError, match=said):
        make()


def test_a_list_of_levels_is_as_good_as_a_tuple():
    assert Trend([A, B]) == Trend((A, B))
