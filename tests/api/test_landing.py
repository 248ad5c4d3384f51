import pytest

import touchdown


@pytest.mark.slow
def test_the_pilot_learns_to_land_on_unseen_starts(tmp_path):
    run = touchdown.train("pilot", seed=0, runs_dir=tmp_path)
    assert run.evaluation is not None
    assert run.evaluation.summary.mean_return >= 200
    assert run.evaluation.summary.outcomes["landed"] >= 0.8
