"""One recorded episode, and flights as one safetensors file."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from touchdown.core import files, notebook, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.records import Count
from touchdown.core.types import Outcome, Tensors
from touchdown.lander import rules

FORMAT_VERSION = 1


class _Facts(Struct, frozen=True, kw_only=True, rename={"policy": "pilot"}):
    """A flight's entry in a file's metadata."""

    env_id: str
    policy: str
    seed: Count
    outcome: Outcome
    steps_per_second: Annotated[float, Meta(gt=0, le=1_000_000)]


class Terrain(NamedTuple):
    """The ground of one start, in metres."""

    xs: NDArray[np.float64]  # [n] corners of the surface, left to right
    heights: NDArray[np.float64]  # [n]
    helipad_x1: float  # the flag on the left
    helipad_x2: float  # the flag on the right
    helipad_y: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class Flight:
    """One episode of T steps."""

    env_id: str
    """Gymnasium's id of the environment."""
    policy: str
    """The policy's name."""
    seed: int
    """Environment seed: the start."""
    observations: NDArray[np.float32]
    """[T + 1, D], from the reset to the last step."""
    actions: NDArray[np.int64]
    """[T]."""
    rewards: NDArray[np.float64]
    """[T]."""
    outcome: Outcome
    """How it ended."""
    steps_per_second: float
    """Steps per second of simulated time."""
    bodies: NDArray[np.float32] | None = None
    """[T + 1, 3, 3]: hull, leg, leg, each x, y (metres) and angle (radians); the lander only."""
    terrain: Terrain | None = None
    """The ground; the lander only."""
    frames: tuple[bytes, ...] | None = None
    """F PNG files drawn by the environment; None for the lander, drawn from `bodies`."""
    frame_steps: NDArray[np.int64] | None = None
    """The step of each of `frames`, increasing from 0 to T, [F]; None if they are of every step."""

    @property
    def steps(self) -> int:
        """T, the number of steps."""
        return len(self.actions)

    @property
    def returns(self) -> NDArray[np.float64]:
        """Undiscounted sum of the rewards so far at each observation, [T + 1]."""
        # added in order, as in an evaluation, so that the two agree to the last bit
        return np.concatenate(([0.0], self.rewards)).cumsum()

    @property
    def episode_return(self) -> float:
        """Undiscounted sum of the rewards."""
        return float(self.returns[-1])

    @property
    def fuel(self) -> float:
        """Return points spent on engines; 0 in environments other than the lander."""
        return rules.fuel_of(self.actions) if rules.is_lander(self.env_id) else 0.0

    @property
    def facts(self) -> str:
        """Who flew from where, and how it ended, in a line."""
        return notebook.plain(
            f"{self.policy}: {self.env_id} from start {self.seed}, {self.outcome}, "
            f"return {self.episode_return:.1f}, {self.steps} steps"
        )

    def __repr__(self) -> str:
        return f"<Flight {self.facts}>"

    def _repr_html_(self) -> str | None:
        """The film, for a notebook; None if `render`, which draws it, has not been loaded."""
        return notebook.html_of(self)


def save_flights(path: Path, flights: Sequence[Flight]) -> None:
    """Write flights as one safetensors file.

    Raises:
        UserError: the file cannot be written.
    """
    tensors: Tensors = {}
    facts: list[_Facts] = []
    for index, flight in enumerate(flights):
        tensors |= {f"{index}.{name}": value for name, value in _tensors(flight).items()}
        facts.append(
            _Facts(
                env_id=flight.env_id,
                policy=flight.policy,
                seed=flight.seed,
                outcome=flight.outcome,
                steps_per_second=flight.steps_per_second,
            )
        )
    metadata = {
        "format_version": str(FORMAT_VERSION),
        "flights": json.dumps(msgspec.to_builtins(facts)),
    }
    with files.refusing(str(path)):
        files.write_atomic(path, files.to_safetensors(tensors, metadata), follow=False)


def load_flights(path: Path) -> list[Flight]:
    """The flights in a file from `save_flights`.

    Raises:
        UserError: the file is missing, truncated, of another version, or something else.
    """
    tensors, metadata = files.read_tensors(path)
    records.check_readable(metadata.get("format_version"), [str(FORMAT_VERSION)], path)
    where = f"{path}: not recorded flights"
    known = records.decode(metadata.get("flights", ""), list[_Facts], where)
    try:
        return [_flight(facts, tensors, f"{index}.") for index, facts in enumerate(known)]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise UserError(f"{where}: {one_line(error)}") from None


def _tensors(flight: Flight) -> Tensors:
    tensors: Tensors = {
        "observations": flight.observations,
        "actions": flight.actions,
        "rewards": flight.rewards,
    }
    if flight.bodies is not None:
        tensors["bodies"] = flight.bodies
    if flight.terrain is not None:
        tensors["terrain"] = np.stack((flight.terrain.xs, flight.terrain.heights))
        tensors["helipad"] = np.array(flight.terrain[2:], np.float64)
    if flight.frames is not None:
        tensors["frames"] = np.frombuffer(b"".join(flight.frames), np.uint8)
        tensors["frame_sizes"] = np.array([len(frame) for frame in flight.frames], np.int64)
        if flight.frame_steps is not None:
            tensors["frame_steps"] = flight.frame_steps
    return tensors


def _flight(facts: _Facts, tensors: Tensors, prefix: str) -> Flight:
    own = {
        name.removeprefix(prefix): value
        for name, value in tensors.items()
        if name.startswith(prefix)
    }
    steps = len(own["actions"])
    drawn = own.get("frame_steps", np.arange(steps + 1))
    if drawn.ndim != 1 or len(drawn) == 0 or drawn[0] != 0 or drawn[-1] != steps:
        raise ValueError(f"{prefix}frame_steps must be from 0 to {steps}")
    if (np.diff(drawn) <= 0).any():
        raise ValueError(f"{prefix}frame_steps must increase")
    shapes = {
        "observations": (steps + 1, *own["observations"].shape[1:]),
        "actions": (steps,),
        "rewards": (steps,),
        "bodies": (steps + 1, 3, 3),
        "frame_sizes": drawn.shape,
    }
    for name, shape in shapes.items():
        if name in own and own[name].shape != shape:
            raise ValueError(f"{prefix}{name} is {own[name].shape}, must be {shape}")
    terrain = frames = None
    if "terrain" in own:
        xs, heights = own["terrain"]
        terrain = Terrain(xs.copy(), heights.copy(), *own["helipad"].tolist())
    if "frames" in own:
        data, ends = own["frames"].tobytes(), own["frame_sizes"].cumsum().tolist()
        if ends[-1] != len(data):
            raise ValueError(f"{prefix}frames is {len(data)} bytes, must be {ends[-1]}")
        frames = tuple(data[a:b] for a, b in zip([0, *ends], ends, strict=False))
    return Flight(
        env_id=facts.env_id,
        policy=facts.policy,
        seed=facts.seed,
        observations=own["observations"],
        actions=own["actions"],
        rewards=own["rewards"],
        outcome=facts.outcome,
        steps_per_second=facts.steps_per_second,
        bodies=own.get("bodies"),
        terrain=terrain,
        frames=frames,
        frame_steps=own.get("frame_steps"),
    )
