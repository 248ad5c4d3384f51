"""The layout of gridworlds: the cell of each state, and the marks on cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import IntArray

_PLACES = "RGYB"  # the taxi's stands, in the order of their numbers in the state

Cell = tuple[int, int]
"""Row from the top, column from the left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridWorld:
    """The layout of a gridworld: M maps (usually one) of R rows and C columns.

    With several maps, each stands for one value of the rest of the state, such as the taxi's
    passenger. The maps are laid out in named rows and columns.
    """

    glyphs: str  # one character per action, an arrow or a letter
    states: IntArray  # the state of each cell: [M, R, C]
    acts: NDArray[np.bool_]  # whether an action is ever taken in the cell: [M, R, C]
    letters: NDArray[np.str_]  # the mark on the cell, or "": [M, R, C]
    walls: tuple[Cell, ...] = ()  # cells with a wall on their right
    row_names: tuple[str, ...] = ("",)
    column_names: tuple[str, ...] = ("",)

    def __post_init__(self) -> None:
        maps = len(self.row_names) * len(self.column_names)
        shapes = {self.states.shape, self.acts.shape, self.letters.shape}
        if self.states.ndim != 3 or len(self.states) != maps or len(shapes) != 1:
            raise ValueError(f"states, acts and letters must be [{maps}, R, C], got {shapes}")


def grid_of(env: gym.Env[Any, Any]) -> GridWorld | None:
    """The layout of Gymnasium's FrozenLake, CliffWalking or Taxi; None for other environments."""
    toy = cast(Any, env.unwrapped)
    match type(toy).__name__:
        case "FrozenLakeEnv":
            return _frozen_lake(toy.desc)
        case "CliffWalkingEnv":
            return _cliff_walking(toy._cliff, toy.start_state_index)  # not public
        case "TaxiEnv":
            return _taxi(toy.desc)
        case _:
            return None


def cells_of(grid: GridWorld, states: Sequence[int] | IntArray) -> list[Cell]:
    """The cell of each state, within its map."""
    _, rows, columns = grid.states.shape
    places = np.argsort(grid.states, axis=None)[np.asarray(states, np.intp)] % (rows * columns)
    return [divmod(int(place), columns) for place in places]


def _frozen_lake(desc: NDArray[np.bytes_]) -> GridWorld:
    """A lake of `S`tart, `F`rozen, `H`ole and `G`oal."""
    letters = desc.astype(np.str_)[None]
    return GridWorld(
        glyphs="←↓→↑",
        states=np.arange(letters.size).reshape(letters.shape),
        acts=~np.isin(letters, ["H", "G"]),
        letters=np.where(letters == "F", "", letters),
    )


def _cliff_walking(cliff: NDArray[np.bool_], start: int) -> GridWorld:
    """A cliff; a step onto it leads back to the start. The goal is the last cell."""
    letters = np.where(cliff, "C", "")
    letters.flat[start], letters.flat[-1] = "S", "G"
    return GridWorld(
        glyphs="↑→↓←",
        states=np.arange(cliff.size).reshape(1, *cliff.shape),
        acts=~np.isin(letters, ["C", "G"])[None],
        letters=letters[None],
    )


def _taxi(desc: NDArray[np.bytes_]) -> GridWorld:
    """A map for each position of the passenger (four stands or the taxi) and each destination."""
    inside = desc.astype(np.str_)[1:-1, 1:-1]  # cells and the walls between them alternate
    places, walls = inside[:, ::2], inside[:, 1::2]
    rows, columns = places.shape
    # a state is ((row · C + column) · 5 + passenger) · 4 + destination
    states = np.arange(places.size * 20).reshape(rows, columns, 20).transpose(2, 0, 1)
    # a passenger at the destination has arrived: the episode is over
    over = np.array([passenger == goal for passenger in range(5) for goal in range(4)])
    acts = np.broadcast_to(~over[:, None, None], states.shape)
    return GridWorld(
        glyphs="↓↑→←PD",
        states=states,
        acts=acts,
        letters=np.where(acts & (places != " "), places, ""),
        walls=tuple((int(row), int(column)) for row, column in np.argwhere(walls == "|")),
        row_names=(*(f"passenger at {place}" for place in _PLACES), "passenger in the taxi"),
        column_names=tuple(f"to {place}" for place in _PLACES),
    )
