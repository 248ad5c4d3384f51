"""One recorded episode: what was seen and done, how it ended, and what a picture of it needs."""

import io
import json
import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, cast

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray
from PIL import Image
from safetensors.numpy import save

from touchdown.core import files, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.records import Count
from touchdown.core.types import Outcome, Policy, Tensors
from touchdown.envs import environment, outcome
from touchdown.envs.environment import MadeEnv
from touchdown.lander import engine as engines
from touchdown.lander import rules

FORMAT_VERSION = 1


class _Facts(Struct, frozen=True, kw_only=True, rename={"policy": "pilot"}):
    """What is kept of a flight in a file's metadata, beside its arrays."""

    env_id: str
    policy: str
    seed: Count
    outcome: Outcome
    steps_per_second: Annotated[int, Meta(ge=1, le=1_000_000)]


class Terrain(NamedTuple):
    """The ground of one start, in metres."""

    xs: NDArray[np.float64]  # [n] corners of the surface, left to right
    heights: NDArray[np.float64]  # [n]
    helipad_x1: float  # the flag on the left
    helipad_x2: float  # the flag on the right
    helipad_y: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flight:
    """One episode of T steps."""

    env_id: str
    """Gymnasium's id of the world."""
    policy: str
    """The policy's name."""
    seed: int
    """Environment seed: the start."""
    observations: NDArray[np.float32]
    """[T + 1, D], from the reset's to the last step's."""
    actions: NDArray[np.int64]
    """[T]."""
    rewards: NDArray[np.float64]
    """[T]."""
    outcome: Outcome
    """How it ended."""
    steps_per_second: int
    """Steps in a second of the world's own clock."""
    bodies: NDArray[np.float32] | None = None
    """[T + 1, 3, 3]: hull, leg, leg, each x, y (metres) and angle (radians); the lander's alone."""
    terrain: Terrain | None = None
    """The ground; the lander's alone."""
    frames: tuple[bytes, ...] | None = None
    """T + 1 PNG files that the world drew itself; None for the lander, drawn from `bodies`."""

    @property
    def steps(self) -> int:
        """T, the number of steps."""
        return len(self.actions)

    @property
    def returns(self) -> NDArray[np.float64]:
        """Sum of the rewards so far, undiscounted, at each observation: [T + 1]."""
        # added in order, as an evaluation does, so that the two agree to the last bit
        return np.concatenate(([0.0], self.rewards)).cumsum()

    @property
    def episode_return(self) -> float:
        """Undiscounted sum of the rewards."""
        return float(self.returns[-1])

    @property
    def fuel(self) -> float:
        """Return points spent on engines; 0 in worlds that are not the lander's."""
        return rules.fuel_of(self.actions) if rules.is_lander(self.env_id) else 0.0


def record_flight(policy: Policy, env_id: str, seed: int, name: str) -> Flight:
    """One episode; of the lander, on the engine in use.

    Args:
        policy: chooses the actions.
        env_id: Gymnasium's id.
        seed: environment seed of the start.
        name: what to call the policy.

    Raises:
        UserError: there is no such environment, or it cannot be made.
    """
    with _sdl_without_display():
        if rules.is_lander(env_id):
            world = environment.make_env(env_id, engine=engines.engine_in_use())
        else:
            world = environment.make_env(env_id, render_mode="rgb_array")
        try:
            return fly(world, policy, env_id, seed, name)
        finally:
            world.env.close()


def fly(world: MadeEnv, policy: Policy, env_id: str, seed: int, name: str) -> Flight:
    """One episode in a world that is already made; see `record_flight`."""
    env = world.env
    drawn = env.render_mode == "rgb_array"
    observation, _ = env.reset(seed=seed)
    observations, bodies, frames = [observation], [_bodies(env)], [_frame(env, drawn)]
    actions: list[int] = []
    rewards: list[float] = []
    terminated = truncated = False
    while not (terminated or truncated):
        action = int(policy.act(observation[None])[0])
        observation, reward, terminated, truncated, _ = env.step(action)
        actions.append(action)
        rewards.append(float(reward))
        observations.append(observation)
        bodies.append(_bodies(env))
        frames.append(_frame(env, drawn))
    lands = rules.is_lander(env_id)
    return Flight(
        env_id=env_id,
        policy=name,
        seed=seed,
        observations=np.array(observations, np.float32),
        actions=np.array(actions, np.int64),
        rewards=np.array(rewards, np.float64),
        outcome=outcome.outcome_of(env_id, observation, rewards[-1], terminated=bool(terminated)),
        steps_per_second=int(env.metadata.get("render_fps") or 50),
        bodies=np.array(bodies, np.float32) if lands else None,
        terrain=_terrain(env) if lands else None,
        frames=tuple(frames) if drawn else None,
    )


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
        files.write_atomic(path, save(tensors, metadata))


def load_flights(path: Path) -> list[Flight]:
    """The flights of a file that `save_flights` wrote.

    Raises:
        UserError: the file is missing, cut off, of another version, or holds something else.
    """
    tensors, metadata = files.read_tensors(path)
    version = metadata.get("format_version")
    if version != str(FORMAT_VERSION):
        raise UserError(
            f"{path}: format_version = {version!r}: this touchdown reads {FORMAT_VERSION}"
        )
    where = f"{path}: not recorded flights"
    known = records.decode(metadata.get("flights", ""), list[_Facts], where)
    try:
        return [_flight(facts, tensors, f"{index}.") for index, facts in enumerate(known)]
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise UserError(f"{where}: {one_line(error)}") from None


@contextmanager
def _sdl_without_display() -> Generator[None]:
    """Let worlds that draw with SDL draw where there is no display, without looking for one."""
    before = os.environ.get("SDL_VIDEODRIVER")
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("SDL_VIDEODRIVER", None)


def _bodies(env: environment.Env) -> list[list[float]] | NDArray[np.float32]:
    inside: Any = env.unwrapped
    if hasattr(inside, "states"):  # ours
        states = inside.states()
        return np.concatenate((states.positions[0], states.angles[0][:, None]), axis=1)
    if not hasattr(inside, "lander"):
        return []
    parts = (inside.lander, *inside.legs)
    return [[body.position.x, body.position.y, body.angle] for body in parts]


def _frame(env: environment.Env, drawn: bool) -> bytes:
    if not drawn:
        return b""
    file = io.BytesIO()
    Image.fromarray(cast(NDArray[np.uint8], env.render())).save(file, "PNG", compress_level=1)
    return file.getvalue()


def _terrain(env: environment.Env) -> Terrain:
    inside: Any = env.unwrapped
    if hasattr(inside, "terrain"):  # ours
        return Terrain(*inside.terrain().T.copy(), *inside.helipad)
    # each polygon of the sky stands on one edge of the ground, and begins with that edge
    corners = [polygon[0] for polygon in inside.sky_polys] + [inside.sky_polys[-1][1]]
    xs, heights = np.array(corners, np.float64).T
    return Terrain(
        xs.copy(),
        heights.copy(),
        float(inside.helipad_x1),
        float(inside.helipad_x2),
        float(inside.helipad_y),
    )


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
    return tensors


def _flight(facts: _Facts, tensors: Tensors, prefix: str) -> Flight:
    own = {
        name.removeprefix(prefix): value
        for name, value in tensors.items()
        if name.startswith(prefix)
    }
    steps = len(own["actions"])
    shapes = {
        "observations": (steps + 1, *own["observations"].shape[1:]),
        "actions": (steps,),
        "rewards": (steps,),
        "bodies": (steps + 1, 3, 3),
        "frame_sizes": (steps + 1,),
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
    )
