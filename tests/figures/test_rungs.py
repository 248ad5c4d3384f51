import numpy as np
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from touchdown.figures import rungs

# two seeds, validated at different steps; their returns differ by 2 everywhere
LOW = ([0, 50, 100], [0.0, 50.0, 100.0])
HIGH = ([20, 120], [22.0, 122.0])


def test_the_mean_covers_the_steps_of_all_curves_with_students_interval():
    at, mean, half = rungs.mean_and_interval([LOW, HIGH])
    assert (at[0], at[-1], len(at)) == (20, 100, 200)
    assert_allclose(mean, at + 1)  # between x and x + 2
    assert_allclose(
        half, 12.706, rtol=1e-4
    )  # t = 12.706 for two seeds, times a standard error of 1


def test_three_seeds_have_a_narrower_interval_than_two():
    _, mean, half = rungs.mean_and_interval([([0, 1], [v, v]) for v in (0.0, 3.0, 6.0)])
    assert_allclose(mean, 3)
    assert_allclose(half, 4.3027 * 3 / 3**0.5, rtol=1e-4)  # a deviation of 3


def test_one_seed_is_drawn_without_an_interval():
    at, mean, half = rungs.mean_and_interval([LOW])
    assert_allclose(mean, at)
    assert not half.any()


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
