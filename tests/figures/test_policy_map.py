import gymnasium as gym
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from touchdown.figures import style
from touchdown.figures.grid import GridWorld, cells_of, grid_of
from touchdown.figures.policy_map import (
    draw_path,
    draw_policy,
    greedy_glyphs,
    policy_text,
    save_policy,
)

LEFT, DOWN, RIGHT, UP = range(4)  # of the frozen lake
TO_G = 1  # second of the taxi's destinations


def gridworld(env_id: str, **options) -> GridWorld:
    grid = grid_of(gym.make(env_id, **options))
    assert grid is not None
    return grid


def preferring(grid: GridWorld, actions: dict[int, int]) -> np.ndarray:
    """A table in which the named states prefer an action; the values of all others are equal."""
    q = np.zeros((grid.states.size, len(grid.glyphs)))
    for state, action in actions.items():
        q[state, action] = 1.0
    return q


def all_preferring(grid: GridWorld, action: int) -> np.ndarray:
    return preferring(grid, dict.fromkeys(range(grid.states.size), action))


def glyphs_of(ax: Axes, gid: str) -> PathCollection:
    (found,) = [artist for artist in ax.collections if artist.get_gid() == gid]
    assert isinstance(found, PathCollection)
    return found


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture
def lake() -> GridWorld:
    return gridworld("FrozenLake-v1", desc=["SFH", "FFG"])


def test_a_policy_in_text_has_arrows_and_the_marks_of_cells_without_an_action(lake: GridWorld):
    q = preferring(lake, {0: DOWN, 1: LEFT, 2: RIGHT, 3: RIGHT, 4: UP, 5: LEFT})
    assert (
        policy_text(lake, q) == "↓ ← H\n→ ↑ G"
    )  # none in the hole and the goal, though q has values


def test_a_state_with_equal_values_has_no_arrow(lake: GridWorld):
    assert policy_text(lake, np.full((6, 4), -3.0)) == "· · H\n· · G"


def test_of_several_best_actions_the_first_is_shown(lake: GridWorld):
    q = np.zeros((6, 4))
    q[0] = [-1, 5, 2, 5]
    assert greedy_glyphs(lake, q)[0, 0, 0] == "↓"


@pytest.mark.parametrize(
    ("action", "row"), [(0, "↑ C C C C C C C C C C G"), (3, "← C C C C C C C C C C G")]
)
def test_the_cliff_is_at_the_bottom_between_start_and_goal(action: int, row: str):
    grid = gridworld("CliffWalking-v1")
    lines = policy_text(grid, all_preferring(grid, action)).split("\n")
    assert lines == [" ".join(row[0] * 12)] * 3 + [row]


@pytest.mark.parametrize("env_id", ["FrozenLake-v1", "CliffWalking-v1", "Taxi-v4"])
def test_every_arrow_points_where_the_environment_moves(env_id: str):
    env = gym.make(env_id, **({"is_slippery": False} if env_id == "FrozenLake-v1" else {}))
    grid = grid_of(env)
    assert grid is not None
    way = {"←": (0, -1), "→": (0, 1), "↑": (-1, 0), "↓": (1, 0), "P": (0, 0), "D": (0, 0)}
    acting = set(grid.states[grid.acts].tolist())
    moved = set()
    for state in acting:
        for action, glyph in enumerate(grid.glyphs):
            ((_, next_state, reward, _),) = env.unwrapped.P[state][action]
            (here, there) = cells_of(grid, [state, next_state])
            step = (there[0] - here[0], there[1] - here[1])
            assert step in {(0, 0), way[glyph]} or reward == -100  # a wall, or the fall
            moved.add(glyph if step == way[glyph] else "")
    assert moved >= set(grid.glyphs)


def test_the_taxi_s_text_has_a_map_for_each_passenger_and_destination_with_its_walls():
    grid = gridworld("Taxi-v4")
    q = all_preferring(grid, 0)
    q[grid.states[4 * 4 + TO_G, 0, 4]] = [0, 0, 0, 0, 0, 9]  # in the taxi, at G, to G: drop off
    lines = policy_text(grid, q).split("\n")
    assert len(lines) == 5 * 7 + 4
    assert lines[0] == "passenger at R"
    assert lines[1] == "to R        to G        to Y        to B"
    assert lines[2] == " " * 12 + "   ".join(["↓ ↓|↓ ↓ ↓"] * 3)  # R to R: the passenger has arrived
    assert lines[6] == " " * 12 + "   ".join(["↓|↓ ↓|↓ ↓"] * 3)
    assert lines[-7] == "passenger in the taxi"
    assert lines[-5] == "↓ ↓|↓ ↓ ↓   ↓ ↓|↓ ↓ D   ↓ ↓|↓ ↓ ↓   ↓ ↓|↓ ↓ ↓"


def test_the_taxi_s_cells_stand_for_the_states_that_it_encodes():
    env = gym.make("Taxi-v4").unwrapped
    grid = grid_of(env)
    assert grid is not None
    for state in range(500):
        row, column, passenger, goal = env.decode(state)
        assert grid.states[passenger * 4 + goal, row, column] == state
        assert grid.acts[passenger * 4 + goal, row, column] == (passenger != goal)
    for letter, (row, column) in zip("RGYB", env.locs, strict=True):
        assert grid.letters[-1, row, column] == letter


def test_an_environment_that_is_not_a_gridworld_has_no_map():
    assert grid_of(gym.make("CartPole-v1")) is None


def test_cells_of_states_are_found(lake: GridWorld):
    assert cells_of(lake, [0, 2, 4]) == [(0, 0), (0, 2), (1, 1)]
    taxi = gym.make("Taxi-v4").unwrapped
    assert cells_of(gridworld("Taxi-v4"), [taxi.encode(3, 1, 2, 0)]) == [(3, 1)]


def test_a_table_of_another_environment_is_refused(lake: GridWorld, ax: Axes):
    for draw in (greedy_glyphs, policy_text, lambda grid, q: draw_policy(ax, grid, q)):
        with pytest.raises(ValueError, match=r"q must be \[6, 4\]"):
            draw(lake, np.zeros((6, 3)))


def test_a_gridworld_whose_maps_do_not_match_its_names_is_refused(lake: GridWorld):
    with pytest.raises(ValueError, match=r"must be \[2, R, C\]"):
        GridWorld(
            glyphs=lake.glyphs,
            states=lake.states,
            acts=lake.acts,
            letters=lake.letters,
            row_names=("one", "two"),
        )


def test_a_drawn_policy_has_an_arrow_in_every_cell_with_an_action(lake: GridWorld, ax: Axes):
    assert draw_policy(ax, lake, all_preferring(lake, RIGHT)) is ax
    arrows, marks = (glyphs_of(ax, gid).get_paths() for gid in ("actions", "marks"))
    middles = [path.get_extents().get_points().mean(axis=0) for path in (*arrows, *marks)]
    # x and y of row by row, y down: four arrows, then the hole and the goal
    wanted = [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5), (2.5, 0.5), (2.5, 1.5)]
    assert_allclose(middles, wanted, atol=1e-9)
    assert ax.get_ylim()[0] > ax.get_ylim()[1]


def test_a_drawn_arrow_s_head_is_where_it_points(lake: GridWorld, ax: Axes):
    draw_policy(ax, lake, preferring(lake, {0: LEFT, 1: RIGHT, 3: UP, 4: DOWN}))
    # a head has more corners than a shaft: their mean lies towards it
    left, right, up, down = (
        path.vertices[:-1].mean(axis=0) - path.get_extents().get_points().mean(axis=0)
        for path in glyphs_of(ax, "actions").get_paths()
    )
    assert left[0] < 0 < right[0]
    assert up[1] < 0 < down[1]  # y grows downwards


def test_cells_are_coloured_by_the_value_of_their_best_action(lake: GridWorld, ax: Axes):
    q = np.zeros((6, 4))
    q[:, RIGHT] = [1, 2, 99, 3, 4, 99]  # the decoys: hole and goal have no action
    draw_policy(ax, lake, q)
    mesh = ax.collections[0]
    assert_array_equal(mesh.get_array().compressed(), [1, 2, 3, 4])
    assert mesh.get_clim() == (1, 4)


def test_a_table_of_one_value_is_drawn_as_well(lake: GridWorld, ax: Axes):
    draw_policy(ax, lake, np.zeros((6, 4)))
    ax.figure.draw_without_rendering()
    assert ax.collections[0].get_clim() == (-0.5, 0.5)


def test_the_taxi_s_maps_lie_side_by_side_with_their_names_and_walls(ax: Axes):
    grid = gridworld("Taxi-v4")
    draw_policy(ax, grid, all_preferring(grid, 1))
    assert (
        len(glyphs_of(ax, "actions").get_paths()) == 16 * 25
    )  # none where the passenger has arrived
    assert {text.get_text() for text in ax.texts} >= {"passenger in the taxi", "to B"}
    (walls,) = [artist for artist in ax.collections if isinstance(artist, LineCollection)]
    assert len(walls.get_segments()) == 16 * 6
    assert ax.get_xlim() == (-0.05, 23.05)  # 4 maps of 5 and 3 gaps


def test_a_path_runs_through_the_centres_of_its_cells_below_the_arrows(ax: Axes):
    assert draw_path(ax, [(1, 0), (0, 0), (0, 1)], style.RED, "SARSA") is ax
    (line,) = ax.lines
    assert_array_equal(line.get_xydata(), [[0.5, 1.5], [0.5, 0.5], [1.5, 0.5]])
    draw_policy(ax, gridworld("CliffWalking-v1"), np.zeros((48, 4)))
    actions = next(each for each in ax.collections if each.get_gid() == "actions")
    assert ax.collections[0].get_zorder() < line.get_zorder() < actions.get_zorder()


def test_a_fall_back_to_the_start_is_a_gap_in_the_path(ax: Axes):
    draw_path(ax, [(2, 1), (2, 2), (3, 0), (2, 0)], style.RED, "Q-learning")
    x = ax.lines[0].get_xdata()
    assert_array_equal(x, [1.5, 2.5, np.nan, 0.5, 0.5])


def test_paths_are_named_in_a_legend(ax: Axes):
    draw_path(ax, [(0, 0), (0, 1)], style.RED, "Q-learning")
    draw_path(ax, [(0, 0), (1, 0)], style.BLUE, "SARSA")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["Q-learning", "SARSA"]


@pytest.mark.parametrize("env_id", ["FrozenLake-v1", "CliffWalking-v1", "Taxi-v4"])
def test_no_band_of_a_policys_picture_is_empty(tmp_path, env_id):
    grid = gridworld(env_id)
    save_policy(tmp_path / "policy.png", grid, all_preferring(grid, 0), "A title")
    with Image.open(tmp_path / "policy.png") as picture:
        rows = np.asarray(picture.convert("L")).min(axis=1) == 255
    edges = np.flatnonzero(np.diff(np.concatenate(([0], rows, [0]))))
    assert (edges[1::2] - edges[::2]).max() < 0.1 * len(rows)
