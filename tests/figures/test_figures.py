import dataclasses

import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from PIL import Image

from touchdown.core.errors import UserError
from touchdown.envs.flight import Flight, Terrain
from touchdown.figures import curve, style
from touchdown.figures import flights as flight_figure


def episode(number: int, episode_return: float, **changes) -> dict:
    row = {
        "episode": number,
        "observations": 100 * (number + 1),
        "episode_return": episode_return,
        "steps": 100,
        "outcome": "crashed",
        "epsilon": 0.5**number,
        "seconds": float(number),
    }
    return row | changes


def validation(observations: int, mean_return: float) -> dict:
    return {
        "observations": observations,
        "episode": 1,
        "mean_return": mean_return,
        "returns": [mean_return],
        "time_limit_share": 0.0,
    }


def flight(seed: int, outcome: str, end: float, policy: str = "agent") -> Flight:
    """Three steps straight down from x = 10 to height 4, drifting to `end`."""
    bodies = np.zeros((4, 3, 3), np.float32)
    bodies[:, 0, 0] = np.linspace(10, end, 4)
    bodies[:, 0, 1] = np.linspace(13, 4, 4)
    return Flight(
        env_id="LunarLander-v3",
        policy=policy,
        seed=seed,
        observations=np.zeros((4, 8), np.float32),
        actions=np.zeros(3, np.int64),
        rewards=np.zeros(3),
        outcome=outcome,
        steps_per_second=50,
        bodies=bodies,
        terrain=Terrain(np.linspace(0, 20, 11), np.full(11, 3.0 + seed), 8.0, 12.0, 10 / 3),
    )


@pytest.fixture
def ax():
    return Figure().subplots()


def line(ax, label: str):
    (found,) = (it for it in ax.lines if it.get_label() == label)
    return found


def legend_texts(ax) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_moving_mean_looks_back_over_the_window():
    assert_allclose(curve.moving_mean(np.array([2.0, 4, 9, 2]), 2), [2, 3, 6.5, 5.5])


def test_moving_mean_agrees_with_the_loop():
    values = np.random.default_rng(0).normal(-100, 200, 350)
    slow = [values[max(0, i - 99) : i + 1].mean() for i in range(len(values))]
    assert_allclose(curve.moving_mean(values), slow)
    assert len(curve.moving_mean(values[:0])) == 0


def test_learning_curve_shows_episodes_validations_and_the_selected_checkpoint(ax):
    episodes = [episode(i, 10.0 * i) for i in range(5)]
    validations = [validation(200, 30), validation(400, 90), validation(500, 60)]
    assert curve.learning_curve(ax, episodes, validations, 400) is ax
    (dots,) = ax.collections
    assert_allclose(dots.get_offsets(), [[100 * (i + 1), 10 * i] for i in range(5)])
    assert_allclose(line(ax, "mean of the last 100").get_ydata(), [0, 5, 10, 15, 20])
    checked = line(ax, "validation mean (greedy)")
    assert_allclose(checked.get_xydata(), [[200, 30], [400, 90], [500, 60]])
    assert_allclose(line(ax, "selected").get_xydata(), [[400, 90]])
    assert [text.get_text() for text in ax.texts] == ["solved: 200"]


def test_threshold_is_drawn_at_its_value_and_left_out_on_request(ax):
    rows = [episode(0, 10), episode(1, 20)]
    curve.learning_curve(ax, rows, [], threshold=475)
    assert ax.texts[0].get_text() == "solved: 475"
    assert ax.get_ylim()[1] > 475
    other = curve.learning_curve(Figure().subplots(), rows, [], threshold=None)
    assert not other.texts
    assert other.get_ylim()[1] < 25


def test_a_few_terrible_returns_do_not_squeeze_the_rest(ax):
    rng = np.random.default_rng(0)
    returns = rng.uniform(-200, 280, 300)
    returns[[3, 50, 200]] = -5000, -900, -3000
    validations = [validation(5000, -320), validation(9000, 240)]
    curve.learning_curve(ax, [episode(i, r) for i, r in enumerate(returns)], validations)
    low, high = ax.get_ylim()
    assert -450 < low < -320
    assert high > 280
    inside, below = (collection.get_offsets() for collection in ax.collections)
    assert len(inside) == 297
    assert_allclose(below, [[400, low], [5100, low], [20100, low]])
    assert f"3 below −{-low:g}" in legend_texts(ax)


def test_returns_between_0_and_1_fill_the_axes(ax):
    rows = [episode(number, number % 2) for number in range(10)]
    curve.learning_curve(ax, rows, [], threshold=0.7)
    assert_allclose(ax.get_ylim(), [-0.1, 1.05])  # not from -50


def test_short_run_shows_every_return(ax):
    curve.learning_curve(ax, [episode(0, -5000), episode(1, 100)], [])
    assert ax.get_ylim()[0] < -5000
    assert legend_texts(ax) == ["training episode", "mean of the last 100"]


def test_exploration_shows_epsilon_and_the_share_that_timed_out(ax):
    outcomes = ["timed out", "landed", "timed out", "crashed"]
    rows = [episode(i, 0, outcome=outcome) for i, outcome in enumerate(outcomes)]
    assert curve.exploration(ax, rows) is ax
    assert_allclose(line(ax, "ε").get_xydata()[:, 1], [1, 0.5, 0.25, 0.125])
    share = line(ax, "share of the last 100 that timed out")
    assert_allclose(share.get_xydata(), [[100, 1], [200, 1 / 2], [300, 2 / 3], [400, 1 / 2]])


@pytest.mark.parametrize("episodes", [0, 1, 150])
def test_learning_curve_of_any_run_is_written_at_full_resolution(tmp_path, episodes):
    path = tmp_path / "curve.png"
    rows = [episode(i, -5.0 * i) for i in range(episodes)]
    curve.save_learning_curve(path, rows, [validation(50, 3)], 50, "a run")
    with Image.open(path) as image:
        assert image.size == (1680, 1040)
        assert image.convert("L").getextrema() != (255, 255)
    assert [file.name for file in tmp_path.iterdir()] == ["curve.png"]


def test_no_figure_is_kept_in_pyplot(tmp_path):
    curve.save_learning_curve(tmp_path / "curve.png", [episode(0, 1)], [], None, "a run")
    assert not Gcf.get_all_fig_managers()


def test_saved_figure_is_cleared(tmp_path):
    figure = style.new_figure(2, 2)
    figure.subplots()
    style.save(figure, tmp_path / "empty.png")
    assert not figure.axes


def test_missing_folder_is_reported_in_one_line(tmp_path):
    path = tmp_path / "none" / "curve.png"
    with pytest.raises(UserError) as raised:
        curve.save_learning_curve(path, [episode(0, 1)], [], None, "a run")
    assert str(raised.value) == f"{path}: cannot be written: No such file or directory"


def test_flights_are_drawn_where_the_hull_flew(ax):
    groups = {
        "agent": [flight(0, "landed", 10.5), flight(1, "crashed", 12)],
        "pid": [flight(0, "landed", 9), flight(1, "out of bounds", 20)],
    }
    assert flight_figure.flights_overlay(ax, groups) is ax
    paths = [it for it in ax.lines if len(it.get_xdata()) == 4]
    for path, flown in zip(paths, groups["agent"] + groups["pid"], strict=True):
        assert_allclose(path.get_xydata(), flown.bodies[:, 0, :2])
    colours = [path.get_color() for path in paths]
    assert colours == [style.BLUE, style.BLUE, style.RED, style.RED]
    ends = {
        (it.get_marker(), *it.get_xydata()[0].tolist())
        for it in ax.lines
        if it.get_markeredgecolor() == "white"
    }
    assert ends == {("o", 10.5, 4), ("X", 12, 4), ("o", 9, 4), (">", 20, 4)}
    assert ax.get_aspect() == 1


def test_ground_of_every_start_is_drawn_once(ax):
    groups = {name: [flight(0, "landed", 10), flight(1, "landed", 10)] for name in ("a", "b")}
    flight_figure.flights_overlay(ax, groups)
    grounds = [it for it in ax.lines if len(it.get_xdata()) == 11]
    assert [it.get_ydata()[0] for it in grounds] == [3, 4]


def test_legend_counts_landings_and_names_the_outcomes_seen(ax):
    groups = {
        "agent": [flight(0, "landed", 10.5), flight(1, "timed out", 12)],
        "pid": [flight(0, "crashed", 9), flight(1, "crashed", 11)],
    }
    flight_figure.flights_overlay(ax, groups)
    assert legend_texts(ax) == ["agent: 1 of 2 landed", "pid: 0 of 2 landed"]
    (marks,) = (it for it in ax.artists if it is not ax.get_legend())
    names = [text.get_text() for text in marks.get_texts()]
    assert names == ["start", "landed", "crashed", "timed out"]


def test_flights_are_written_at_full_resolution(tmp_path):
    path = tmp_path / "flights.png"
    flight_figure.save_flights(path, {"agent": [flight(0, "landed", 10)]}, "one flight")
    with Image.open(path) as image:
        assert image.size == (1680, 1280)


def test_flights_of_another_environment_are_refused(ax):
    other = dataclasses.replace(flight(0, "terminated", 10), env_id="CartPole-v1", terrain=None)
    with pytest.raises(ValueError, match="CartPole-v1"):
        flight_figure.flights_overlay(ax, {"agent": [other]})
