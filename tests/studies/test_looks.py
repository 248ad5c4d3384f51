import numpy as np
import pytest

from touchdown.core.types import FloatArray
from touchdown.studies import looks
from touchdown.studies.claim_tests import Beyond, Greater
from touchdown.studies.claims import Claim
from touchdown.studies.looks import (
    LookDecision,
    SeedValues,
    decide_in_looks,
    questions,
    seeds_of_cells,
)
from touchdown.studies.plan import Factor, Level, Study

A_OVER_B = Claim("a is better", Greater("a", "b", margin=20))
A_OVER_C = Claim("a is better than c", Greater("a", "c", margin=20))
LOOKS = (10, 20, 40)
pytestmark = pytest.mark.usefixtures("without_collecting")


def numbers(**cells: FloatArray):
    def values(cell: str, _metric: str, seeds: int) -> FloatArray:
        return np.asarray(cells[cell][:seeds], float)

    return values


def decided(claims: list[Claim], values: SeedValues) -> list[LookDecision]:
    return decide_in_looks(questions(claims, values), LOOKS)


def around(middle: float, count: int, seed: int, spread: float = 10.0) -> FloatArray:
    return middle + spread * np.random.default_rng(seed).standard_normal(count)


def test_what_a_look_decides_no_later_seed_changes():
    a, b = around(100, 20, 0), around(0, 20, 1)
    (found,) = decided([A_OVER_B], numbers(a=a[:10], b=b[:10]))
    assert found.decision.verdict == "undecided"  # the first look has a level of 0.0001
    assert found.next_seeds == 20
    assert found.decision.more_seeds == 10
    (found,) = decided([A_OVER_B], numbers(a=a, b=b))
    assert found.decision.verdict == "holds"
    assert "decided at look 2 of 3, 20 seeds" in found.decision.evidence
    later = numbers(a=np.append(a, np.full(20, -500.0)), b=np.append(b, np.zeros(20)))
    (same,) = decided([A_OVER_B], later)
    assert same == found


def test_seeds_between_two_looks_are_not_looked_at():
    a, b = around(100, 19, 0), around(0, 19, 1)
    (few,) = decided([A_OVER_B], numbers(a=a[:10], b=b[:10]))
    (more,) = decided([A_OVER_B], numbers(a=a, b=b))
    assert more == few


def test_only_the_cells_of_open_claims_get_more_seeds():
    cells = {"a": around(100, 20, 0), "b": around(0, 20, 1), "c": around(90, 20, 2, 60.0)}
    cells["d"] = np.zeros(9)
    claims = [A_OVER_B, A_OVER_C]
    factor = Factor("letter", [Level(name) for name in cells])
    study = Study(name="letters", factors=[factor], looks=LOOKS, seeds=7, claims=claims)
    wanted = seeds_of_cells(study, claims, decided(claims, numbers(**cells)))
    assert wanted == {"a": 40, "b": 10, "c": 40, "d": 7}  # no claim names d


def test_a_claim_waits_for_its_first_look():
    values = numbers(a=around(0, 9, 0), b=around(0, 12, 1))
    (found,) = decided([A_OVER_B], values)
    assert found.next_seeds == 10
    assert found.decision.evidence.startswith("9 of 10 seeds of each level have this number")


def test_a_verdict_is_provisional_until_no_claim_waits():
    cells = {"a": around(100, 20, 0), "b": around(0, 20, 1), "c": around(0, 9, 2)}
    found, waits = decided([A_OVER_B, A_OVER_C], numbers(**cells))
    assert "; provisional while other claims wait for their seeds" in found.decision.evidence
    assert waits.next_seeds == 10
    cells["c"] = around(0, 20, 2)
    found, other = decided([A_OVER_B, A_OVER_C], numbers(**cells))
    assert "provisional" not in found.decision.evidence + other.decision.evidence


def test_a_hopeless_claim_gets_no_more_seeds(monkeypatch):
    values = numbers(a=around(10, 10, 0, 100.0), b=around(0, 10, 1, 100.0))
    (found,) = decided([A_OVER_B], values)
    assert found.next_seeds == 20
    monkeypatch.setattr(looks, "HOPELESS", 1.0)
    (found,) = decided([A_OVER_B], values)
    assert found.next_seeds is None
    assert "given up" in found.decision.evidence


def test_after_the_last_look_nothing_more_is_asked():
    values = numbers(a=around(5, 40, 0, 60.0), b=around(0, 40, 1, 60.0))
    (found,) = decided([A_OVER_B], values)
    assert found.decision.verdict == "undecided"
    assert (found.next_seeds, found.decision.more_seeds) == (None, None)
    assert "open at look 3 of 3, 40 seeds" in found.decision.evidence


def test_three_looks_err_no_more_often_than_one():
    above = Claim("it is above 0", Beyond("a", 0.0, "above"))
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(400):
        values = numbers(a=rng.standard_normal(40))
        (found,) = decided([above], values)
        wrong += found.decision.verdict in ("holds", "does not hold")
    assert wrong / 400 < 0.05 + 2 * 0.011  # two standard errors
