"""Records one episode: a policy's observations and actions, and the data for pictures."""

import io
import os
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from touchdown.core.types import Policy, actions_of
from touchdown.envs import environment, outcome
from touchdown.envs.environment import MadeEnv
from touchdown.envs.flight import Flight, Terrain
from touchdown.lander import engine as engines
from touchdown.lander import rules


def record_flight(policy: Policy, env_id: str, seed: int, name: str) -> Flight:
    """Record one episode; the lander is simulated by the engine in use.

    Args:
        policy: chooses the actions.
        env_id: Gymnasium id.
        seed: environment seed of the start.
        name: name of the policy.

    Raises:
        UserError: there is no such environment, or it cannot be made.
    """
    with _sdl_without_display():
        if rules.is_lander(env_id):
            made = environment.make_env(env_id, engine=engines.engine_in_use())
        else:
            made = environment.make_env(env_id, render_mode="rgb_array")
        try:
            return fly(made, policy, env_id, seed, name)
        finally:
            made.env.close()


def fly(made: MadeEnv, policy: Policy, env_id: str, seed: int, name: str) -> Flight:
    """Record one episode in an environment that is already made; see `record_flight`."""
    env = made.env
    drawn = env.render_mode == "rgb_array"
    observation, _ = env.reset(seed=seed)
    observations, bodies, frames = [observation], [_bodies(env)], [_frame(env, drawn)]
    actions: list[int] = []
    rewards: list[float] = []
    terminated = truncated = False
    while not (terminated or truncated):
        step = np.array([len(actions)])
        action = int(actions_of(policy, observation[None], np.array([seed]), step)[0])
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
