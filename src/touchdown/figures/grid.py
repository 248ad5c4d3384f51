"""How worlds of cells are drawn: which state lies where, and what marks it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from touchdown.core.types import IntArray

_PLACES = "RGYB"  # where the taxi's passengers wait and go to, in the order of its numbers

Cell = tuple[int, int]
"""Row from the top, column from the left."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridWorld:
    """A world of cells as it is drawn: M maps of R rows and C columns, most often one.

    Several maps are several values of what the cell does not tell: they lie in rows and columns
    of maps, with a name for each.
    """

    glyphs: str  # an arrow or a letter for each action
    states: IntArray  # the state that each cell stands for: [M, R, C]
    acts: NDArray[np.bool_]  # whether an action is ever taken there: [M, R, C]
    letters: NDArray[np.str_]  # what marks the cell, or nothing: [M, R, C]
    walls: tuple[Cell, ...] = ()  # cells that one cannot leave to the right
    row_names: tuple[str, ...] = ("",)
    column_names: tuple[str, ...] = ("",)

    def __post_init__(self) -> None:
        maps = len(self.row_names) * len(self.column_names)
        shapes = {self.states.shape, self.acts.shape, self.letters.shape}
        if self.states.ndim != 3 or len(self.states) != maps or len(shapes) != 1:
            raise ValueError(f"states, acts and letters must be [{maps}, R, C], got {shapes}")


def grid_of(env: gym.Env[Any, Any]) -> GridWorld | None:
    """How Gymnasium's FrozenLake, CliffWalking or Taxi is drawn; None of any other world."""
    world = cast(Any, env.unwrapped)
    match type(world).__name__:
        case "FrozenLakeEnv":
            return _frozen_lake(world.desc)
        case "CliffWalkingEnv":
            return _cliff_walking(world._cliff, world.start_state_index)  # nowhere else
        case "TaxiEnv":
            return _taxi(world.desc)
        case _:
            return None


def cells_of(world: GridWorld, states: Sequence[int] | IntArray) -> list[Cell]:
    """The cell of each state, within its map."""
    _, rows, columns = world.states.shape
    places = np.argsort(world.states, axis=None)[np.asarray(states, np.intp)] % (rows * columns)
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
    """A cliff from which one is put back to the start, with the goal in the last cell."""
    letters = np.where(cliff, "C", "")
    letters.flat[start], letters.flat[-1] = "S", "G"
    return GridWorld(
        glyphs="↑→↓←",
        states=np.arange(cliff.size).reshape(1, *cliff.shape),
        acts=~np.isin(letters, ["C", "G"])[None],
        letters=letters[None],
    )


def _taxi(desc: NDArray[np.bytes_]) -> GridWorld:
    """A map for each place of the passenger (four and the taxi) and each destination (four)."""
    inside = desc.astype(np.str_)[1:-1, 1:-1]  # cells and what parts them take turns
    places, partings = inside[:, ::2], inside[:, 1::2]
    rows, columns = places.shape
    # a state is ((row · C + column) · 5 + passenger) · 4 + destination
    states = np.arange(places.size * 20).reshape(rows, columns, 20).transpose(2, 0, 1)
    # a passenger who waits at the destination was brought there: the episode is over
    over = np.array([passenger == goal for passenger in range(5) for goal in range(4)])
    acts = np.broadcast_to(~over[:, None, None], states.shape)
    return GridWorld(
        glyphs="↓↑→←PD",
        states=states,
        acts=acts,
        letters=np.where(acts & (places != " "), places, ""),
        walls=tuple((int(row), int(column)) for row, column in np.argwhere(partings == "|")),
        row_names=(*(f"passenger at {place}" for place in _PLACES), "passenger in the taxi"),
        column_names=tuple(f"to {place}" for place in _PLACES),
    )
