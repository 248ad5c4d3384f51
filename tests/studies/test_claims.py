import numpy as np
import pytest

from touchdown.studies.claims import (
    Alike,
    Best,
    Beyond,
    Claim,
    Greater,
    Near,
    SweetSpot,
    Trend,
    decide,
)

pytestmark = pytest.mark.usefixtures("without_collecting")


def verdicts(tests, **cells):
    """What each test says where cells have these numbers, whatever the metric."""

    def values(labels, _metric):
        return np.array(cells.get(labels[0], []), float)

    claims = [Claim("it is so", "8", test) for test in tests]
    return [decision.verdict for decision in decide(claims, values)]


LOW, MIDDLE, HIGH = [1, 2, 3, 2], [51, 52, 53, 52], [101, 102, 103, 102]
A, B, C = ("a",), ("b",), ("c",)


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

    def values(labels, _metric):
        return np.array(weak[labels[0]], float)

    alone = decide([Claim("x", "1", test)], values)[0]
    among = decide([Claim("x", "1", test)] * 4, values)[0]
    assert among.p_value == pytest.approx(4 * alone.p_value)


def test_what_is_undecided_says_how_many_seeds_would_do():
    def values(labels, _metric):
        return np.array({"a": [10, 12, 14, 11], "b": [8, 10, 13, 9]}[labels[0]], float)

    decision = decide([Claim("x", "1", Greater(A, B))], values)[0]
    assert decision.verdict == "undecided"
    assert "seeds of each would decide it" in decision.evidence


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
