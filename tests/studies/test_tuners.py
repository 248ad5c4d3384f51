import pytest

from touchdown.core.errors import UserError
from touchdown.policies.baselines import read_pid
from touchdown.studies.tuners import TUNERS, Tuning, tune
from touchdown.training.pid_tuning import HAND_PICKED


@pytest.mark.parametrize("tuner", TUNERS)
def test_every_tuner_repeats_and_betters_where_it_begins(tuner):
    tuning = Tuning(tuner=tuner, seed=3, trials=12, starts=4)
    told = []
    found = tune(tuning, lambda share, best: told.append((share, best)))
    assert found == tune(tuning, lambda _share, _best: None)
    assert list(found.history) == sorted(found.history)
    assert found.history[-1] == found.best_return == told[-1][1]
    assert len(found.history) == (1 if tuner == "hand" else 12)
    if tuner == "hand":
        assert found.gains == HAND_PICKED
    else:
        assert told[-1][0] == 1
        assert found.best_return >= tune(Tuning(tuner="hand", seed=3, starts=4), print).best_return


def test_the_gains_are_a_file_that_flies(tmp_path):
    found = tune(Tuning(tuner="hand", seed=0, starts=1), lambda _share, _best: None)
    path = tmp_path / "pid.toml"
    path.write_text(found.to_toml())
    assert read_pid(path) == HAND_PICKED


def test_no_trials_are_refused():
    with pytest.raises(UserError, match="trials = 0: must be at least 1"):
        Tuning(tuner="tpe", seed=0, trials=0)
