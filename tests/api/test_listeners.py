import re
import runpy
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import touchdown
from small_configs import lake
from touchdown.core import files
from touchdown.training.listeners import ListenerError

PAGE = Path(__file__).parents[2] / "docs" / "loggers.md"


class Heard:
    """Keeps what it is told; does something when it is told for the `at`-th time."""

    def __init__(self, at: int = 0, do=lambda: None) -> None:
        self.told: list[tuple[int, dict[str, float]]] = []
        self.closed = 0
        self._at, self._do = at, do

    def log(self, step, scalars) -> None:
        self.told.append((step, scalars))
        if len(self.told) == self._at:
            self._do()

    def close(self) -> None:
        self.closed += 1


def often_saved(**changes):
    """A short run that saves a checkpoint after each episode."""
    config = lake(**changes)
    settings = {"checkpoint_seconds": 0.0, "metrics_period": 10, "test_episodes": 0}
    return replace(config, training=replace(config.training, **settings))


def scalars_on_disk(run: touchdown.Run) -> list[tuple[int, str, float]]:
    """Of the run's own records, those that have a line each."""
    rows = [
        (row["observations"], "rollout/ep_rew", row["episode_return"])
        for row in files.read_jsonl(run.folder.episodes)
    ]
    for row in files.read_jsonl(run.folder.updates):
        del row["update"]
        step = row.pop("observations")
        rows += [(step, f"train/{name}", value) for name, value in row.items()]
    rows += [
        (row["observations"], "eval/mean_reward", row["mean_return"])
        for row in files.read_jsonl(run.folder.validations)
    ]
    return sorted(rows)


def scalars_told(heard: Heard) -> list[tuple[int, str, float]]:
    """What a listener was told of the same."""
    return sorted(
        (step, tag, value)
        for step, scalars in heard.told
        for tag, value in scalars.items()
        if tag == "rollout/ep_rew" or not tag.startswith(("rollout", "time"))
    )


def fail() -> None:
    raise RuntimeError("the plot\nis gone")


def test_a_listener_is_told_every_scalar_that_the_records_have(tmp_path):
    heard, path = Heard(), tmp_path / "scalars.jsonl"
    run = touchdown.train(
        often_saved(),
        runs_dir=tmp_path,
        listeners=[heard, touchdown.JsonLinesLogger(path)],
    )
    told = scalars_told(heard)
    assert told == scalars_on_disk(run)
    assert {"rollout/ep_rew", "train/loss", "eval/mean_reward"} <= {tag for _, tag, _ in told}
    assert {type(step) for step, _ in heard.told} == {int}
    assert {type(value) for _, scalars in heard.told for value in scalars.values()} == {float}
    means = [s["rollout/ep_rew_mean"] for _, s in heard.told if "rollout/ep_rew_mean" in s]
    returns = [row["episode_return"] for row in files.read_jsonl(run.folder.episodes)]
    assert means[-1] == pytest.approx(sum(returns) / len(returns))
    assert heard.closed == 1
    rows = files.read_jsonl(path)
    assert [(row.pop("step"), row) for row in rows] == heard.told


def test_a_listener_that_raises_is_named_and_the_run_goes_on_from_its_last_checkpoint(tmp_path):
    whole = touchdown.train(often_saved(), runs_dir=tmp_path, name="whole")
    count = len(files.read_jsonl(whole.folder.episodes))
    before, fails, after = Heard(), Heard(count, fail), Heard()
    with pytest.raises(touchdown.UserError) as raised:
        touchdown.train(
            often_saved(), runs_dir=tmp_path, name="half", listeners=[before, fails, after]
        )
    assert str(raised.value) == (
        "listener Heard: log raised RuntimeError: the plot is gone; the last saved state is "
        f"intact; resume with: touchdown train --resume half --runs-dir {tmp_path}"
    )
    assert isinstance(raised.value.__cause__, RuntimeError)
    assert len(before.told) == len(after.told) + 1 == count
    assert [each.closed for each in (before, fails, after)] == [1, 1, 1]
    heard = Heard()
    half = touchdown.resume("half", runs_dir=tmp_path, listeners=[heard])
    for name in ("updates", "validations"):
        assert getattr(half.folder, name).read_bytes() == getattr(whole.folder, name).read_bytes()
    weights, same = (files.read_tensors(run.folder.best)[0] for run in (half, whole))
    assert all(np.array_equal(weights[name], same[name]) for name in same)
    assert heard.closed == 1
    # from the checkpoint on: what was told before it is not told again
    assert 0 < heard.told[0][0] <= before.told[-1][0]
    all_told = {each for one in (before, heard) for each in scalars_told(one)}
    assert all_told == set(scalars_on_disk(whole))


def test_a_resumed_run_tells_only_what_follows_its_checkpoint(tmp_path):
    before = Heard(30, lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(touchdown.Interrupted):
        touchdown.train(often_saved(), runs_dir=tmp_path, name="run", listeners=[before])
    assert before.closed == 1
    after = Heard()
    run = touchdown.resume("run", runs_dir=tmp_path, listeners=[after])
    assert sorted(scalars_told(before) + scalars_told(after)) == scalars_on_disk(run)


def test_a_second_ctrl_c_closes_the_listeners_too(tmp_path):
    def press_twice() -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    heard = Heard(3, press_twice)
    with pytest.raises(KeyboardInterrupt):
        touchdown.train(often_saved(), runs_dir=tmp_path, listeners=[heard])
    assert heard.closed == 1


def test_a_listener_that_fails_to_close_is_named_when_the_run_is_finished(tmp_path):
    heard = Heard()
    heard.close = fail
    with pytest.raises(ListenerError, match="listener Heard: close raised RuntimeError"):
        touchdown.train(often_saved(), runs_dir=tmp_path, name="run", listeners=[heard])
    assert touchdown.show("run", tmp_path).status == "finished"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"config": "pilto"}, "pilto"),
        ({"config": lake(env_id="Blackjack-v1")}, "Blackjack-v1"),
        ({"listeners": [print]}, "must be an object with log and close"),
        ({"logger": "tensorbord"}, "logger 'tensorbord': must be one of wandb, mlflow"),
    ],
)
def test_a_refused_run_closes_its_listeners_and_makes_no_folder(tmp_path, options, said):
    heard = Heard()
    options["listeners"] = [heard, *options.get("listeners", [])]
    with pytest.raises(touchdown.UserError, match=said) as refused:
        touchdown.train(**options, runs_dir=tmp_path / "runs")
    assert "\n" not in str(refused.value)
    assert heard.closed == 1
    assert not list(tmp_path.iterdir())


def test_the_listener_of_the_documentation_tells_of_each_best_validation(
    tmp_path, monkeypatch, capsys
):
    (code, call) = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[:2]
    (tmp_path / "notice.py").write_text(code)
    (tmp_path / "use.py").write_text(call.replace('"cartpole"', "short"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    run = runpy.run_path("use.py", {"short": often_saved()})["run"]
    assert run.folder.path.absolute().parent == tmp_path / "runs"
    rows = files.read_jsonl(run.folder.validations)
    best, lines = -float("inf"), []
    for row in rows:
        if row["mean_return"] > best:
            best = row["mean_return"]
            lines.append(f"{row['observations']:,} steps: validation return {best:.1f}")
    assert capsys.readouterr().out.splitlines() == [*lines, f"best of all: {best:.1f}"]
