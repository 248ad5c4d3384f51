from dataclasses import asdict, replace
from types import SimpleNamespace

import pytest
import tomli_w

import touchdown
from touchdown.policies import baselines


def test_tuning_writes_gains_that_fly(tmp_path):
    out = tmp_path / "gains.toml"
    best = touchdown.tune_pid(starts=2, tolerance=0.9, out=out)
    assert baselines.read_pid(out) == best
    assert out.read_text().startswith("# touchdown tune pid --rule signed --starts 2 --seed 0\n")
    assert touchdown.evaluate(out, episodes=1).name == "gains"


def test_tuning_starts_from_the_gains_given(tmp_path, monkeypatch):
    tried = []

    def fly(_evaluator, policy, starts):
        tried.append(policy.config)
        return [SimpleNamespace(episode_return=0.0) for _ in starts]

    monkeypatch.setattr("touchdown.evaluation.evaluator.Evaluator.rollout", fly)
    gains = replace(baselines.shipped_pid(), kp_vertical=-3.25)
    file = tmp_path / "gains.toml"
    file.write_text(tomli_w.dumps(asdict(gains)))
    touchdown.tune_pid(starts=1, tolerance=0.9, begin=file, rule="absolute")
    assert tried[0] == replace(gains, rule="absolute")
    tried.clear()
    touchdown.tune_pid(starts=1, tolerance=0.9, begin=gains)
    assert tried[0] == gains


def test_gains_that_cannot_be_saved_are_printed(tmp_path, monkeypatch):
    def full(*_args) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("touchdown.core.files.write_atomic", full)
    with pytest.raises(touchdown.UserError, match=r"kp_vertical=.*No space left on device"):
        touchdown.tune_pid(starts=1, tolerance=0.9, out=tmp_path / "pid.toml")
