import numpy as np
import pytest

from touchdown.stats.rules import UNDECIDED
from touchdown.studies.assurance import decided_share, seeds_for_decision
from touchdown.studies.claim_tests import Beyond, Greater

LEVEL = 0.025


def test_a_difference_that_is_nearly_decided_needs_few_seeds():
    one, other = np.linspace(40, 160, 10), np.linspace(20, 140, 10)
    test = Greater("a", "b", margin=20)
    shares = [decided_share(test, [one, other], "", LEVEL, more) for more in (5, 20, 80)]
    assert shares[0] < shares[1] <= shares[2] <= 1
    assert seeds_for_decision(test, [one, other], "", LEVEL) <= 80


def test_seeds_that_all_agree_go_on_agreeing():
    assert decided_share(Beyond("a", 0), [np.ones(5)], "", LEVEL, 5) == 1
    # of five above and five below, few futures decide
    balanced = np.repeat([-1.0, 1.0], 5)
    assert decided_share(Beyond("a", 0), [balanced], "", LEVEL, 10) < 0.3


@pytest.mark.parametrize("difference", [15, 25])
def test_the_assurance_is_the_share_of_studies_that_are_decided(difference):
    """Slow twin: studies of which ten seeds are known go on with true seeds."""
    rng = np.random.default_rng(0)
    test, further, studies = Greater("a", "b", margin=20), 20, 60
    told, decided = [], []
    for _ in range(studies):
        groups = [rng.normal(difference, 20, 30), rng.normal(0, 20, 30)]
        told.append(decided_share(test, [group[:10] for group in groups], "", LEVEL, further))
        decided.append(test.rule(groups, "")(LEVEL).codes != UNDECIDED)
    assert abs(np.mean(told) - np.mean(decided)) < 0.15
