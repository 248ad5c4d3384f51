import io

import gymnasium
import pytest
from gymnasium.envs.classic_control import CartPoleEnv
from rich.console import Console

import touchdown
from small_configs import tiny
from touchdown.evaluation import table
from touchdown.runs import folder as folders


def test_evaluate_and_fly_agree_on_one_start(run):
    evaluation = touchdown.evaluate(run, episodes=2)
    assert run.evaluation is not None
    assert evaluation.episodes == run.evaluation.episodes
    flight = touchdown.fly(run, seed=1)
    assert flight.episode_return == pytest.approx(evaluation.episodes[1].episode_return)
    assert flight.outcome == evaluation.episodes[1].outcome
    assert flight.fuel == pytest.approx(evaluation.episodes[1].fuel)


def test_a_policy_can_be_given_in_every_way(run):
    weights = run.folder.best
    by_run = touchdown.evaluate(run, episodes=1).episodes
    assert touchdown.evaluate(run.policy, episodes=1).episodes == by_run
    assert touchdown.evaluate(str(weights), episodes=1).episodes == by_run
    assert touchdown.evaluate(weights, episodes=1).episodes == by_run
    assert touchdown.evaluate("pilot-0", episodes=1, runs_dir=run.path.parent).episodes == by_run
    assert touchdown.evaluate(str(run.path), episodes=1).episodes == by_run


def test_fly_writes_the_film_to_the_path_given(tmp_path):
    touchdown.fly("random", seed=3, out=tmp_path / "flight.gif")
    assert (tmp_path / "flight.gif").read_bytes().startswith(b"GIF89a")


def test_fly_needs_a_screen_for_a_window(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(touchdown.UserError) as said:
        touchdown.fly("pid", out="window")
    assert "\n" not in str(said.value)


def test_a_run_without_weights_yet_says_so(tmp_path):
    folders.create(tmp_path, tiny(), "young")
    with pytest.raises(touchdown.UserError, match="run 'young': has no weights"):
        touchdown.evaluate("young", runs_dir=tmp_path)


def test_an_environment_without_a_threshold_counts_no_episode_as_solved():
    gymnasium.register("Unsolvable-v0", CartPoleEnv, max_episode_steps=20)
    try:
        evaluation = touchdown.evaluate("random", episodes=2, env_id="Unsolvable-v0")
    finally:
        gymnasium.registry.pop("Unsolvable-v0")
    assert evaluation.summary.threshold is None
    assert evaluation.summary.share_solved is None
    console = Console(record=True, width=120, file=io.StringIO())
    console.print(table.evaluation_table([evaluation]))
    assert "share" not in console.export_text()
