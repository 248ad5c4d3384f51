"""Makes an environment, and describes it for an agent."""

import warnings
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple, cast

from gymnasium import spaces
from gymnasium.wrappers import TimeLimit

from touchdown.core.errors import UserError
from touchdown.core.types import Spaces
from touchdown.envs import custom
from touchdown.envs.boundary import Boundary
from touchdown.envs.mirrors import mirror_of
from touchdown.lander.engine import Engine
from touchdown.lander.rules import (
    LANDER_ID,
    MAX_EPISODE_STEPS,
    MIRROR,
    NUM_ACTIONS,
    is_lander,
    settings_of,
)
from touchdown.lander.space import observation_space


class MadeEnv(NamedTuple):
    """An environment and the facts that an agent needs about it."""

    env: Boundary
    spaces: Spaces


def make_env(
    env_id: str = "LunarLander-v3",
    render_mode: str | None = None,
    engine: Engine = "gymnasium",
) -> MadeEnv:
    """A Gymnasium environment with a flat Box observation and Discrete actions.

    A Discrete observation becomes a one-hot Box. An environment without a time limit is truncated
    after 1,000 steps, because a greedy policy may loop forever. What it returns is checked at each
    step (see `Boundary`).

    Args:
        env_id: Gymnasium's id, `module:Id`, or `module:function` of a function that makes one.
        render_mode: Gymnasium's `rgb_array` or `human`, if pictures are wanted.
        engine: engine that simulates the lander; other environments are always Gymnasium's.

    Raises:
        UserError: there is no such environment, it cannot be made, its spaces are not supported, or
            only a file names its module.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gymnasium warns about versions that it then refuses
        if engine == "exact" and is_lander(env_id):
            env = _exact_lander(render_mode, settings_of(env_id))
        else:
            name = LANDER_ID if is_lander(env_id) else env_id
            env = custom.make(name, render_mode, settings_of(env_id))
    try:
        return _described(env, env_id)
    except UserError:
        with suppress(Exception):  # their code may raise anything
            env.close()
        raise


def _described(env: custom.Env, env_id: str) -> MadeEnv:
    observation: Any = getattr(env, "observation_space", None)
    action: Any = getattr(env, "action_space", None)
    if not isinstance(action, spaces.Discrete):
        raise UserError(f"env_id {env_id!r}: its action space is {action}, must be Discrete")
    action = cast(spaces.Discrete, action)
    if action.start != 0:
        raise UserError(f"env_id {env_id!r}: its actions are {action}, must start at 0")
    num_states = transitions = None
    if isinstance(observation, spaces.Discrete):
        num_states = int(cast(spaces.Discrete, observation).n)
        transitions = getattr(env.unwrapped, "P", None)
    elif not isinstance(observation, spaces.Box) or len(observation.shape) != 1:
        raise UserError(
            f"env_id {env_id!r}: its observation space is {observation}, "
            "must be a flat Box (one vector of numbers) or Discrete"
        )
    if env.spec is None or env.spec.max_episode_steps is None:
        env = TimeLimit(env, MAX_EPISODE_STEPS)
    made = Boundary(env, env_id)
    box = cast(spaces.Box, made.observation_space)
    described = _describe(box, int(action.n), num_states, transitions)
    mirror = mirror_of(env, env_id, described.observation_size, described.num_actions)
    return MadeEnv(made, described._replace(mirror=mirror))


def _describe(
    observation: spaces.Box,
    num_actions: int,
    num_states: int | None = None,
    transitions: Any = None,
) -> Spaces:
    return Spaces(
        observation.shape[0],
        num_actions,
        num_states,
        tuple(observation.low.tolist()),
        tuple(observation.high.tolist()),
        transitions,
    )


def _exact_lander(render_mode: str | None, settings: Mapping[str, Any]) -> custom.Env:
    from touchdown.lander.single import LanderEnv  # noqa: PLC0415 - if the engine was built

    return LanderEnv(render_mode, max_episode_steps=MAX_EPISODE_STEPS, **settings)


def spaces_of(env_id: str, engine: Engine = "gymnasium") -> Spaces:
    """The facts that an agent needs about an environment.

    The exact lander's spaces are constants; any other environment is made and closed again.

    Raises:
        UserError: as in `make_env`.
    """
    if engine == "exact" and is_lander(env_id):
        return _describe(observation_space(), NUM_ACTIONS)._replace(mirror=MIRROR)
    made = make_env(env_id, engine=engine)
    made.env.close()
    return made.spaces
