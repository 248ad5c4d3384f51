import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from touchdown.figures import studies as figures
from touchdown.figures.studies import Point, Row

LOW, HIGH = np.array([10.0, 12.0, 14.0]), np.array([200.0, 210.0, 220.0])
TEN = np.arange(10.0, 110.0, 10.0)
"""Of ten seeds, the second and the ninth are the ends of the median's interval."""


def new_axes():
    return Figure().subplots()


def test_levels_on_an_axis_have_their_seeds_their_median_and_its_interval():
    lines = {"one layer": [Point(10, LOW), Point(20, TEN)]}
    ax = figures.draw_over_axis(new_axes(), lines, "nodes", 20)
    seeds = [tuple(point) for dots in ax.collections for point in dots.get_offsets()]
    assert {(10, 10), (10, 14), (20, 100)} <= set(seeds)
    (container,) = ax.containers
    line, _, (bars,) = container
    assert_allclose(line.get_ydata(), [12, 55])
    first, second = bars.get_segments()
    assert_allclose(first[:, 1], [12, 12])  # three seeds have no interval
    assert_allclose(second[:, 1], [20, 90])
    # the seeds stand beside their median, not under it
    aside = ax.collections[0].get_offset_transform().transform((10, 12))
    assert aside[0] > ax.transData.transform((10, 12))[0]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["one layer"]
    assert ax.get_xlabel() == "nodes"


@pytest.mark.parametrize(
    ("positions", "scale"),
    [
        ((1, 2, 3), "linear"),
        ((1, 100, 10_000), "symlog"),
        ((1e-4, 3e-4, 9e-4), "symlog"),
        ((32, 64, 128), "symlog"),
        ((0.9, 0.99, 0.999), "function"),
    ],
)
def test_positions_far_apart_or_crowding_towards_one_are_spread(positions, scale):
    lines = {"": [Point(position, LOW) for position in positions]}
    ax = figures.draw_over_axis(new_axes(), lines, "x")
    assert ax.get_xscale() == scale
    assert ax.get_legend() is None
    at = ax.transData.transform([(position, 0) for position in positions])[:, 0]
    gaps = np.diff(at)
    assert_allclose(gaps, gaps[0], rtol=0.01)
    left, right = ax.transAxes.transform([(0, 0), (1, 0)])[:, 0]
    assert_allclose([at[0] - left, right - at[-1]], 0.06 * (at[-1] - at[0]), rtol=0.01)


def test_long_numbers_on_an_axis_are_short():
    ax = figures.draw_over_axis(new_axes(), {"": [Point(100, LOW), Point(10_000, LOW)]}, "x")
    assert [text.get_text() for text in ax.get_xticklabels()] == ["100", "10k"]


def test_a_list_of_levels_reads_from_the_top_and_names_the_lines_to_compare_with():
    rows = [Row("dqn", LOW), Row("target", HIGH, is_base=True)]
    ax = figures.draw_rows(new_axes(), rows, {"PID": 222.0})
    assert [text.get_text() for text in ax.get_yticklabels()] == ["dqn", "target"]
    assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert {text.get_text() for text in ax.texts} == {"12", "210", "PID"}
    shares = figures.draw_rows(new_axes(), [Row("dqn", LOW / 100)], shares=True)
    assert [text.get_text() for text in shares.texts] == ["12%"]
    colours = {line.get_color() for line in ax.get_lines()}
    assert len(colours) == 3


def test_a_map_shows_the_median_and_seeds_of_each_cell_and_leaves_out_missing_cells():
    cells = {(0, 0): TEN, (1, 0): HIGH, (1, 1): np.array([150.0])}
    axes = ("decay", ["0.9", "0.99"]), ("γ", ["0.95", "0.99"])
    ax = figures.draw_map(new_axes(), *axes, cells)
    texts = {text.get_text(): text.get_position() for text in ax.texts}
    assert texts == {
        "55\n20 to 90\nn = 10": (0, 0),
        "210\nn = 3": (0, 1),
        "150\nn = 1": (1, 1),
    }
    few = figures.draw_map(new_axes(), *axes, {(0, 0): np.array([0.25, 0.25])}, shares=True)
    assert [text.get_text() for text in few.texts] == ["25%\nn = 2"]


def test_numbers_have_a_margin_and_outliers_do_not_squeeze_the_rest():
    groups = [np.array([-4_000.0, 100.0, 200.0])]
    ax = figures.finish(new_axes(), "return", groups, "y", shown=figures.LANDER_RETURNS)
    assert -400 < ax.get_ylim()[0] < -300
    assert 200 < ax.get_ylim()[1] < 400
    assert ax.get_ylabel() == "return"


def test_seeds_beyond_the_limits_are_counted_at_the_ends():
    groups = [np.array([-4_000.0, -500.0, 100.0]), np.array([200.0, 900.0]), np.array([0.0])]
    for along in ("x", "y"):
        ax = figures.finish(new_axes(), "return", groups, along, shown=figures.LANDER_RETURNS)
        figures.mark_beyond(ax, (1, 2, 3), groups, along)
        low, high = ax.get_xlim() if along == "x" else ax.get_ylim()
        ends = {(1.0, low), (2.0, high)}
        at = {tuple(float(each[0]) for each in line.get_data()) for line in ax.get_lines()}
        assert {(y, x) if along == "x" else (x, y) for x, y in at} == ends
        assert [text.get_text() for text in ax.texts] == ["2 to -4000", "900"]


def test_without_limits_every_seed_is_shown():
    ax = figures.finish(new_axes(), "return", [np.array([0.0, 1.0]), np.array([0.5])], "y")
    assert_allclose(ax.get_ylim(), (-0.05, 1.05))
    far = figures.finish(new_axes(), "return", [np.array([-1_000.0, -990.0])], "y")
    assert far.get_ylim()[0] < -1_000 < -990 < far.get_ylim()[1] < -900


def test_an_axis_covers_the_seeds_and_the_other_numbers():
    ax = figures.finish(new_axes(), "return", [LOW, HIGH], "x", others=[-180.0])
    assert ax.get_xlim()[1] > 220
    assert ax.get_xlim()[0] < -180


def test_shares_are_in_per_cent_from_zero():
    ax = figures.finish(
        new_axes(), "share", [np.array([0.2, 0.2]), np.array([0.5])], "x", shares=True
    )
    assert_allclose(ax.get_xlim(), (-0.02, 0.55))
    assert ax.xaxis.get_major_formatter()(0.5) == "50%"
