import numpy as np
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from touchdown.figures import rungs
from touchdown.stats.summary import bootstrap_iqm

# two seeds, validated at different steps; their returns differ by 2 everywhere
LOW = ([0, 50, 100], [0.0, 50.0, 100.0])
HIGH = ([20, 120], [22.0, 122.0])


def test_the_line_covers_the_steps_of_all_curves():
    at, iqm, low, high = rungs.iqm_and_band([LOW, HIGH])
    assert (at[0], at[-1], len(at)) == (20, 100, 200)
    assert_allclose(iqm, at + 1)  # between x and x + 2
    assert_allclose((low, high), (at, at + 2))  # a quarter of the resamples each are one seed twice


def test_the_line_leaves_out_the_best_and_the_worst_of_four_seeds_and_the_band_does_not():
    levels = (-90.0, 4.0, 6.0, 300.0)
    _, iqm, low, high = rungs.iqm_and_band([([0, 1], [level, level]) for level in levels])
    assert_allclose(iqm, 5)
    assert_allclose((low[0], high[0]), (low[-1], high[-1]))
    assert -90 <= low[0] < 0
    assert 100 < high[0] <= 300


def test_the_band_is_the_bootstrap_interval_of_the_tables():
    values = [12.0, 250.0, 230.0, 241.0, 199.0]
    _, iqm, low, high = rungs.iqm_and_band([([0, 1], [value, value]) for value in values])
    table = bootstrap_iqm(values)
    assert_allclose(iqm, table.value)
    assert_allclose((low[0], high[0]), (table.low, table.high), atol=8)  # other resamples


def test_one_seed_is_drawn_without_an_interval():
    at, iqm, low, high = rungs.iqm_and_band([LOW])
    assert_allclose((iqm, low, high), (at, at, at))


def test_the_caption_names_the_seeds_the_line_and_the_band():
    assert rungs.caption({"pilot": [LOW] * 5, "vector-dqn": [LOW] * 5}) == (
        "n = 5 training seeds each; line: interquartile mean; band: its 95% bootstrap interval"
    )
    assert rungs.caption({"pilot": [LOW] * 5, "mine": [LOW] * 3}).startswith("n = 3 to 5 training")
    assert rungs.caption({"mine": [LOW]}) == "n = 1 training seed; line: interquartile mean"


def test_each_variant_has_a_line_and_a_name_with_its_seeds():
    ax = rungs.draw_rungs(Figure().subplots(), {"pilot": [LOW, HIGH], "mine": [LOW]}, solved=77.0)
    policy, mine, solved = ax.get_lines()
    assert (policy.get_label(), mine.get_label()) == ("pilot, 2 seeds", "mine, 1 seed")
    assert_allclose(policy.get_ydata(), np.linspace(21, 101, 200))
    assert set(np.asarray(solved.get_ydata())) == {77.0}
    assert ax.get_xlim()[0] == 0
    assert len({line.get_color() for line in (policy, mine)}) == 2


def test_another_environment_than_the_lander_is_shown_whole_without_a_threshold():
    high = ([0, 100], [400.0, 500.0])
    ax = rungs.draw_rungs(Figure().subplots(), {"mine": [high]}, None, None)
    assert len(ax.get_lines()) == 1
    assert ax.get_ylim()[1] > 500
    lander = rungs.draw_rungs(Figure().subplots(), {"mine": [high]})
    assert lander.get_ylim() == rungs.LANDER_RETURNS


def test_the_share_that_has_reached_something_is_one_minus_kaplan_and_meiers_estimate():
    times = np.array([30.0, 10.0, np.inf, 20.0])
    ax = rungs.draw_reached(Figure().subplots(), {"dqn": times}, 100, "seeds at 200")
    (line,) = ax.get_lines()
    at, shares = line.get_data()
    estimate = 1.0  # the slow twin: a product over the times, of those still at risk
    for place, (time, share) in enumerate(zip(at[1:4], shares[1:4], strict=True)):
        at_risk = 4 - place
        estimate *= (at_risk - 1) / at_risk
        assert (time, share) == (10.0 * (place + 1), 1 - estimate)
    assert (at[-1], shares[-1]) == (100, 0.75)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["dqn: 3 of 4"]


def test_each_level_has_a_panel_beside_the_base():
    figure = Figure()
    curves = {name: [LOW, HIGH] for name in ("0", "5", "10", "20")}
    rungs.draw_panels(figure, curves, "10")
    shown = [ax for ax in figure.axes if ax.axison]
    assert [ax.get_title("left") for ax in shown] == ["0", "5", "10 (base)", "20"]
    counted = [len(ax.get_lines()) for ax in shown]
    assert counted == [3, 3, 2, 3]  # the level, the base, and the return that counts as solved
