"""Environments by name: Gymnasium's registry, and users' own environments."""

import copy
import inspect
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any, cast

import gymnasium
from gymnasium.envs.registration import registry

from touchdown.core import plugins
from touchdown.core.errors import UserError, one_line
from touchdown.core.names import nearest

Env = gymnasium.Env[Any, Any]
EnvLike = str | Env | Callable[..., Env]
"""A Gymnasium id, `module:Id`, an environment, or a function or class that makes one."""


def make(env_id: str, render_mode: str | None, settings: Mapping[str, Any] | None = None) -> Env:
    """Make an environment from its name.

    Args:
        env_id: Gymnasium's id, `module:Id`, or `module:function`.
        render_mode: passed to its constructor, if it has this parameter.
        settings: other arguments of a registered environment's constructor.

    Raises:
        UserError: there is no such environment, it cannot be made, or only a file names its module.
    """
    if plugins.is_plugin(env_id):
        found = _maker_of(env_id)
        if not isinstance(found, str):
            return _made(found, env_id, render_mode)
        name = found
    else:
        name = env_id
        _check_registered(env_id)
    # only a picture needs a render mode, which not every constructor takes
    arguments: dict[str, Any] = {"render_mode": render_mode} if render_mode else {}
    arguments |= settings or {}
    try:
        return gymnasium.make(name, disable_env_checker=True, **arguments)
    except gymnasium.error.Error as error:
        raise UserError(f"env_id {env_id!r}: cannot be made: {one_line(error)}") from None
    except Exception as error:  # a user's constructor may raise anything
        raise UserError(
            f"env_id {env_id!r}: cannot be made: {type(error).__name__}: {one_line(error)}"
        ) from error


def _check_registered(env_id: str) -> None:
    """Refuse an id that Gymnasium does not have, with the nearest one.

    Gymnasium itself would take an id without a version for its newest version, and a run would not
    say which.
    """
    if env_id in registry:
        return
    newest = max((each.id for each in registry.values() if each.name == env_id), default=None)
    near = newest or nearest(env_id, registry)
    end = f"did you mean {near}?" if near else "must be an id of Gymnasium, or module:Id"
    raise UserError(f"env_id {env_id!r}: unknown; {end}")


def name_of(env: EnvLike, name: str = "") -> str:
    """Register an environment that the user passed, and return the id by which it is found.

    Args:
        env: an id, an environment, or a function or class that makes one. An environment is copied
            as it is now, or made again from its spec if it cannot be copied.
        name: the id to give it; "" takes one from where it was defined.

    Raises:
        UserError: it has another type, or can neither be copied nor made again.
    """
    if isinstance(env, str):
        plugins.write(env)
        return env
    if isinstance(env, gymnasium.Env):
        return _name_of_object(cast(Env, env), name)
    if callable(env):
        return plugins.give(env, name)
    raise UserError(
        f"env = {env!r}: must be a Gymnasium id, an environment, or a function that makes one"
    )


def threshold_of(env_id: str) -> float | None:
    """The return at which an environment counts as solved; None if its spec has none.

    Imports nothing: the module of `module:Id` has been imported if the environment was made.
    """
    spec = registry.get(env_id.rpartition(":")[2])
    if spec is None and env_id in _specs:
        spec = _specs[env_id]
    threshold = spec.reward_threshold if spec else None
    return None if threshold is None else float(threshold)


_objects: dict[str, tuple[Env, Env]] = {}  # passed by the user, and snapshots of them, by name
_specs: dict[str, Any] = {}  # of environments made from outside Gymnasium's registry


def _maker_of(env_id: str) -> str | Callable[..., Env]:
    """The maker of the environment `module:Name`: an id in the registry, or a callable."""
    name = env_id.partition(":")[2]
    if not plugins.is_given(env_id):
        plugins.module_of(env_id, "env_id")  # registers its environments
        if name in registry:
            return name
    found = plugins.load(env_id, "env_id")
    if not callable(found):
        raise UserError(
            f"env_id = {env_id!r}: {name} is neither a registered environment nor a function that "
            "makes one"
        )
    return cast(Callable[..., Env], found)


def _made(maker: Callable[..., Env], env_id: str, render_mode: str | None) -> Env:
    arguments = {"render_mode": render_mode} if render_mode and _takes_mode(maker) else {}
    try:
        env = maker(**arguments)
    except Exception as error:  # a user's code may raise anything
        raise UserError(
            f"env_id = {env_id!r}: cannot be made: {type(error).__name__}: {one_line(error)}"
        ) from error
    if not isinstance(cast(object, env), gymnasium.Env):
        raise UserError(f"env_id = {env_id!r}: made {env!r}, must be a gymnasium.Env")
    _specs[env_id] = env.spec
    return env


def _takes_mode(maker: Callable[..., Env]) -> bool:
    try:
        parameters = inspect.signature(maker).parameters
    except (TypeError, ValueError):
        return False
    any_name = any(each.kind is each.VAR_KEYWORD for each in parameters.values())
    return any_name or "render_mode" in parameters


def _name_of_object(env: Env, name: str) -> str:
    spec = env.spec
    if spec is not None and _is_stock(env):
        return spec.id
    try:
        snapshot = copy.deepcopy(env)
    except Exception as error:  # a user's code may raise anything
        if spec is None:
            raise UserError(
                f"env = {env!r}: cannot be copied ({one_line(error)}); give a function that makes "
                "one: env=lambda: ..."
            ) from error
        return plugins.give(lambda: gymnasium.make(spec), name or _object_name(env, env))
    lost = _lost_in(snapshot, env)
    if lost:
        raise UserError(
            f"env = {env!r}: a copy of it loses what was set after it was made ({lost}); give a "
            "function that makes one: env=lambda: ..."
        )
    return plugins.give(lambda: copy.deepcopy(snapshot), name or _object_name(env, snapshot))


def _is_stock(env: Env) -> bool:
    """Whether an environment is just as `gymnasium.make` makes it, however it is rendered."""
    if env.spec is None or env.spec.id not in registry:
        return False
    plain = copy.deepcopy(env.spec)
    plain.kwargs.pop("render_mode", None)
    if plain != registry[plain.id]:
        return False
    fresh = gymnasium.make(plain.id)
    fresh.close()
    return not _lost_in(fresh, env)


def _lost_in(other: Env, env: Env) -> str:
    """Plain attributes of an environment that differ in its copy.

    Many environments are copied by calling their constructor, which loses attributes that were set
    later.
    """
    mine, theirs = vars(env.unwrapped), vars(other.unwrapped)
    return ", ".join(
        f"{name} = {value!r}"
        for name, value in mine.items()
        if name != "render_mode"
        and isinstance(value, bool | int | float | str)
        and value != theirs.get(name)
    )


def _object_name(env: Env, snapshot: Env) -> str:
    """`module:Class()`, which no import can find, because only this process has the object.

    The same object keeps its name unless it has changed since.
    """
    kind = type(env.unwrapped)
    name = f"{kind.__module__}:{kind.__qualname__}()"
    names = (name if number == 1 else f"{name}{number}" for number in count(1))
    for each in names:
        known = _objects.setdefault(each, (env, snapshot))
        if known[0] is env and not _lost_in(known[1], snapshot):
            return each
    raise AssertionError  # the numbers do not end
