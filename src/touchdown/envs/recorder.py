"""Records one episode: a policy's observations and actions, and the data for pictures."""

import math
import os
from collections.abc import Generator
from contextlib import closing, contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.core.errors import UserError
from touchdown.core.types import Policy, actions_of
from touchdown.envs import environment, outcome
from touchdown.envs.boundary import Boundary
from touchdown.envs.environment import MadeEnv
from touchdown.envs.flight import Flight, Terrain
from touchdown.envs.frames import Frames, NotDrawable
from touchdown.lander import engine as engines
from touchdown.lander import rules

_USUAL_FPS = 50.0  # of an environment that does not say
_LEAST_FPS, _MOST_FPS = 1e-3, 1e6


def record_flight(
    policy: Policy, env_id: str, seed: int, name: str, *, drawn: bool = True
) -> Flight:
    """Record one episode; the lander is simulated by the engine in use.

    Args:
        policy: chooses the actions.
        env_id: Gymnasium id.
        seed: environment seed of the start.
        name: name of the policy.
        drawn: whether pictures are needed. The lander is drawn later, from its positions; any other
            environment draws them itself, which takes time and memory.

    Raises:
        UserError: there is no such environment, it cannot be made, or it breaks Gymnasium's rules.
        NotDrawable: pictures are needed, and the environment gives none.
    """
    lands = rules.is_lander(env_id)
    drawn = drawn and not lands
    with _sdl_without_display():
        if lands:
            made = environment.make_env(env_id, engine=engines.engine_in_use())
        elif drawn:
            made = _made_to_draw(env_id)
        else:
            made = environment.make_env(env_id)
        with closing(made.env):
            return fly(made, policy, env_id, seed, name, drawn=drawn)


def fly(
    made: MadeEnv, policy: Policy, env_id: str, seed: int, name: str, *, drawn: bool = False
) -> Flight:
    """Record one episode in an environment that is already made; see `record_flight`."""
    env = made.env
    lands = rules.is_lander(env_id)
    fps = _steps_per_second(env.metadata)
    frames = Frames(env, fps) if drawn else None
    observation, _ = env.reset(seed=seed)
    observations = [observation]
    bodies = [_bodies(env)] if lands else []
    if frames is not None:
        frames.look(0)
    actions: list[int] = []
    rewards: list[float] = []
    terminated = truncated = False
    while not (terminated or truncated):
        step = np.array([len(actions)])
        action = int(actions_of(policy, observation[None], np.array([seed]), step)[0])
        observation, reward, terminated, truncated, _ = env.step(action)
        actions.append(action)
        rewards.append(reward)
        observations.append(observation)
        if lands:
            bodies.append(_bodies(env))
        if frames is not None:
            frames.look(len(actions), last=terminated or truncated)
    return Flight(
        env_id=env_id,
        policy=name,
        seed=seed,
        observations=np.array(observations, np.float32),
        actions=np.array(actions, np.int64),
        rewards=np.array(rewards, np.float64),
        outcome=outcome.outcome_of(env_id, observation, rewards[-1], terminated=terminated),
        steps_per_second=fps,
        bodies=np.array(bodies, np.float32) if lands else None,
        terrain=_terrain(env) if lands else None,
        frames=None if frames is None else frames.files,
        frame_steps=frames.steps if frames and len(frames.files) <= len(actions) else None,
    )


def _made_to_draw(env_id: str) -> MadeEnv:
    try:
        return environment.make_env(env_id, render_mode="rgb_array")
    except UserError as error:  # its constructor may take no render mode
        raise NotDrawable(str(error)) from error


def _steps_per_second(metadata: Any) -> float:
    """The environment's `render_fps`, or the usual value if it has none that makes sense."""
    try:
        fps = float(metadata["render_fps"])
    except (KeyError, TypeError, ValueError):
        return _USUAL_FPS
    if not math.isfinite(fps) or fps <= 0:
        return _USUAL_FPS
    return min(max(fps, _LEAST_FPS), _MOST_FPS)


@contextmanager
def _sdl_without_display() -> Generator[None]:
    """Allow environments that draw with SDL to draw without a display."""
    before = os.environ.get("SDL_VIDEODRIVER")
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("SDL_VIDEODRIVER", None)


def _bodies(env: Boundary) -> list[list[float]] | NDArray[np.float32]:
    inside: Any = env.unwrapped
    if hasattr(inside, "states"):  # ours
        states = inside.states()
        return np.concatenate((states.positions[0], states.angles[0][:, None]), axis=1)
    if not hasattr(inside, "lander"):
        return []
    parts = (inside.lander, *inside.legs)
    return [[body.position.x, body.position.y, body.angle] for body in parts]


def _terrain(env: Boundary) -> Terrain:
    inside: Any = env.unwrapped
    if hasattr(inside, "terrain"):  # ours
        return Terrain(*inside.terrain().T.copy(), *inside.helipad)
    # each polygon of the sky stands on one edge of the ground and begins with it
    corners = [polygon[0] for polygon in inside.sky_polys] + [inside.sky_polys[-1][1]]
    xs, heights = np.array(corners, np.float64).T
    return Terrain(
        xs.copy(),
        heights.copy(),
        float(inside.helipad_x1),
        float(inside.helipad_x2),
        float(inside.helipad_y),
    )
