import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from touchdown.agents.states import Grid, OneHot, states_of
from touchdown.config.sections import TableConfig
from touchdown.core.errors import UserError
from touchdown.core.types import Spaces

DISCRETE = Spaces(observation_size=5, num_actions=2, num_states=5)
BOX = Spaces(2, 3, low=(-1.0, 0.0), high=(1.0, 4.0))


def test_one_hot_observations_are_numbered_by_their_one():
    assert_array_equal(OneHot(3).states(np.array([[0, 0, 1], [1, 0, 0]], np.float32)), [2, 0])
    env = gym.wrappers.FlattenObservation(gym.make("Taxi-v4"))
    observation, _ = env.reset(seed=0)
    assert OneHot(500).states(observation[None])[0] == env.unwrapped.s


@pytest.mark.parametrize("rows", [[[0, 0]], [[1, 1]], [[0, 2]], [[1, -1]], [[1, 0, 0]], [1, 0]])
def test_observations_that_are_not_one_hot_are_refused(rows: list):
    with pytest.raises(ValueError, match="observations must be"):
        OneHot(2).states(np.array(rows, float))


def test_one_hot_needs_a_state():
    with pytest.raises(ValueError, match="1 state"):
        OneHot(0)


def test_a_grid_numbers_its_cells_with_the_last_dimension_fastest():
    grid = Grid((2, 3), low=(0.0, -3.0), high=(1.0, 3.0))
    assert grid.num_states == 6
    observations = np.array([[0.2, -2.0], [0.2, 0.0], [0.2, 2.0], [0.7, -2.0], [0.7, 2.0]])
    assert_array_equal(grid.states(observations), [0, 1, 2, 3, 5])


def test_a_bin_holds_its_lower_edge_and_the_last_bin_its_upper_edge_too():
    grid = Grid((4,), (0.0,), (4.0,))
    assert_array_equal(grid.states(np.array([[0.0], [1.0], [1.99], [3.0], [4.0]])), [0, 1, 1, 3, 3])


def test_what_lies_outside_goes_to_the_bins_at_the_ends():
    grid = Grid((4,), (0.0,), (4.0,))
    outside = np.array([[-1.0], [-np.inf], [5.0], [np.inf], [np.finfo(np.float64).max]])
    assert_array_equal(grid.states(outside), [0, 0, 3, 3, 3])


@given(
    st.lists(st.integers(1, 5), min_size=1, max_size=3).flatmap(
        lambda bins: st.tuples(
            st.just(tuple(bins)),
            arrays(float, (4, len(bins)), elements=st.floats(allow_nan=False)),
        )
    )
)
def test_every_observation_has_a_state_and_it_is_that_of_a_slow_search(drawn: tuple):
    bins, observations = drawn
    grid = Grid(bins, (-1.0,) * len(bins), (3.0,) * len(bins))
    states = grid.states(observations)
    assert ((states >= 0) & (states < grid.num_states)).all()
    for state, observation in zip(states, observations, strict=True):
        for cell, count, value in zip(
            np.unravel_index(state, bins), bins, observation, strict=True
        ):
            width = 4.0 / count
            assert cell == 0 or value >= -1.0 + cell * width - 1e-9
            assert cell == count - 1 or value <= -1.0 + (cell + 1) * width + 1e-9


@pytest.mark.parametrize(
    ("bins", "low", "high"),
    [
        ((), (), ()),
        ((2, 2), (0.0,), (1.0,)),
        ((2,), (0.0,), (1.0, 2.0)),
        ((0,), (0.0,), (1.0,)),
        ((2,), (1.0,), (1.0,)),
        ((2,), (2.0,), (1.0,)),
        ((2,), (-np.inf,), (1.0,)),
        ((2,), (0.0,), (np.nan,)),
        ((2,), (-1.7e308,), (1.7e308,)),
    ],
)
def test_a_grid_that_cannot_be_is_refused(bins: tuple, low: tuple, high: tuple):
    with pytest.raises(ValueError, match=r"need|must"):
        Grid(bins, low, high)


@pytest.mark.parametrize("rows", [[[np.nan, 0.0]], [[0.0]], [0.0, 0.0]])
def test_observations_that_a_grid_cannot_place_are_refused(rows: list):
    with pytest.raises(ValueError, match="observations must be"):
        Grid((2, 2), (0.0, 0.0), (1.0, 1.0)).states(np.array(rows))


def test_states_are_those_of_a_discrete_space_or_the_bins_of_a_box():
    assert states_of(TableConfig(), DISCRETE) == OneHot(5)
    cut = TableConfig(bins=(2, 3), bins_low=(-2, -2), bins_high=(2, 2))
    assert states_of(cut, BOX) == Grid((2, 3), (-2.0, -2.0), (2.0, 2.0))
    assert states_of(TableConfig(bins=(2, 3)), BOX) == Grid((2, 3), BOX.low, BOX.high)
    half = TableConfig(bins=(2, 3), bins_low=(-2, -2))
    assert states_of(half, BOX) == Grid((2, 3), (-2.0, -2.0), BOX.high)


@pytest.mark.parametrize(
    ("config", "spaces", "said"),
    [
        (
            TableConfig(bins=(4,)),
            DISCRETE,
            "bins = (4,): must be () for an environment of 5 discrete states",
        ),
        (
            TableConfig(),
            BOX,
            (
                "bins = (): must be 2 numbers, the number of bins for each of the "
                "observation's dimensions, such as --bins 4 4"
            ),
        ),
        (
            TableConfig(bins=(4, 4, 4)),
            BOX,
            (
                "bins = (4, 4, 4): must be 2 numbers, the number of bins for each of the "
                "observation's dimensions, such as --bins 4 4"
            ),
        ),
        (
            TableConfig(bins=(4, 4)),
            BOX._replace(low=(-1.0, -np.inf)),
            (
                "bins_low = (): must be 2 numbers, as the environment's own bounds are not all "
                "finite: -1, -inf"
            ),
        ),
        (
            TableConfig(bins=(4, 4), bins_low=(-1, -1)),
            BOX._replace(high=(float(np.finfo(np.float32).max), 1.0)),
            (
                "bins_high = (): must be 2 numbers, as the environment's own bounds are not all "
                "finite: 3.403e+38, 1"
            ),
        ),
        (
            TableConfig(bins=(4, 4), bins_low=(2, 2)),
            BOX,
            "bins = (4, 4): need a finite low below a finite high, got 2.0 and 1.0",
        ),
    ],
)
def test_bins_that_do_not_fit_the_environment_are_refused(
    config: TableConfig, spaces: Spaces, said: str
):
    with pytest.raises(UserError) as refused:
        states_of(config, spaces)
    assert str(refused.value) == said
