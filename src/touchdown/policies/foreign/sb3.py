"""A policy saved by Stable-Baselines3, loaded without unpickling anything.

Its archive contains `data`, JSON with pickles, which are not read, and `policy.pth`, PyTorch
weights. The names of the weights determine the algorithm, and their shapes the layers. The
activation is the algorithm's default unless `data` has another one in plain text.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import GreedyPolicy
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import NetworkConfig
from touchdown.core import files
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Spaces
from touchdown.envs import environment
from touchdown.policies.foreign.archive import Archive
from touchdown.policies.foreign.torch_state import read_state

_MOST_BYTES = 128 << 20  # limits of the archive and of a member; an MLP needs a hundredth of them
_HOMES = ("stable_baselines3.", "sb3_contrib.")  # modules of the policies whose defaults are known
_ACTIVATIONS = {"ReLU": "relu", "Tanh": "tanh", "SiLU": "silu"}
_CLASS = re.compile(r"<class '(?:\w+\.)*(\w+)'>")  # as printed by Python
_SEEN = ("Box", "Discrete")
_PICKLED_STATISTICS = ("vec_normalize.pkl", "vecnormalize.pkl")

State = Mapping[str, NDArray[Any]]


class _Linear(NamedTuple):
    """One layer: y = W·x + b."""

    weight: NDArray[Any]  # [out, in]
    bias: NDArray[Any]  # [out]


def read_sb3(path: Path, env_id: str) -> GreedyPolicy:
    """A greedy policy from a Stable-Baselines3 archive of DQN, QRDQN, PPO or A2C with `MlpPolicy`.

    For an actor (PPO, A2C) the action is the most probable one, and the values are the logits.

    Args:
        path: path of the `.zip` file.
        env_id: the environment, which the archive does not name.

    Raises:
        UserError: the file is not such an archive, is broken, or has another kind of policy or
            environment.
    """
    spaces = environment.spaces_of(env_id)
    data = files.read_bytes(path, _MOST_BYTES)
    statistics = [name for name in _PICKLED_STATISTICS if path.with_name(name).is_file()]
    if statistics:
        raise UserError(
            f"{path}: its observations were normalised, as {statistics[0]} is in its folder; the "
            "statistics are a pickle, which is never opened (if only rewards were normalised, move "
            "it away)"
        )
    try:
        return _policy(Archive(data), path, spaces)
    except ValueError as error:
        raise UserError(
            f"{path}: not a supported Stable-Baselines3 policy: {one_line(error)}"
        ) from None


def _policy(archive: Archive, path: Path, spaces: Spaces) -> GreedyPolicy:
    facts = files.parse_json_object(path, archive.read("data", _MOST_BYTES))
    _check_kind(facts)
    state = read_state(archive.read("policy.pth", _MOST_BYTES))
    linears, default = _linears(state)
    last = linears[-1]
    takes, gives = linears[0].weight.shape[1], len(last.bias)
    quantiles = gives // spaces.num_actions if any(map(_is_quantiles, state)) else 0
    declared = _text(facts, "action_space", "n") or str(spaces.num_actions)
    expected = spaces.num_actions * max(quantiles, 1)
    if (takes, gives, declared) != (spaces.observation_size, expected, str(spaces.num_actions)):
        raise ValueError(
            f"it takes {takes} numbers and gives {gives}, for {declared} actions; the environment "
            f"has observations of {spaces.observation_size} and {spaces.num_actions} actions; "
            "set it with --env-id"
        )
    if quantiles:  # SB3 orders them by quantile, we by action
        by_action = np.arange(gives).reshape(quantiles, -1).T.ravel()
        last = _Linear(last.weight[by_action], last.bias[by_action])
    config = NetworkConfig(
        hidden_sizes=tuple(len(linear.bias) for linear in linears[:-1]),
        activation=cast(Any, _activation(facts, default)),
        quantiles=quantiles,
    )
    network = QNetwork(takes, spaces.num_actions, config)
    layers = {
        f"layers.{number}.{name}": array.astype(np.float32)
        for number, linear in enumerate((*linears[:-1], last))
        for name, array in linear._asdict().items()
    }
    return network.policy(network.params_of(layers))


def _check_kind(facts: Mapping[str, Any]) -> None:
    """Refuse another kind of policy, identified by the text outside the pickles."""
    home = _text(facts, "policy_class", "__module__") or "an unnamed module"
    if home.startswith("sbx."):
        raise ValueError("it was saved by SBX, with weights as a pickle; pickles are never opened")
    if not home.startswith(_HOMES):
        raise ValueError(
            f"its policy's class is from {home!r}; only MlpPolicy of stable_baselines3 and "
            "sb3_contrib is supported"
        )
    for space, known in {"action_space": ("Discrete",), "observation_space": _SEEN}.items():
        kind = _class_name(_text(facts, space, ":type:"))
        if kind not in known:
            raise ValueError(f"its {space} is {kind}, must be {' or '.join(known)}")
    if _text(facts, "action_space", "start") not in (None, "0"):
        raise ValueError("its actions do not start at 0")


def _linears(state: State) -> tuple[list[_Linear], str]:
    """The layers from the observation to the values, and the algorithm's activation."""
    if any("features_extractor." in name for name in state):
        raise ValueError(
            "it has a features extractor with weights, such as a CNN; only MlpPolicy is supported"
        )
    if any(name.startswith("lstm_") for name in state):
        raise ValueError("it is recurrent; only MlpPolicy is supported")
    for values in ("q_net.q_net.", "quantile_net.quantile_net."):
        if linears := _sequence(state, values):
            return linears, "ReLU"
    if "action_net.weight" not in state or "log_std" in state:
        raise ValueError(
            "its weights are not those of DQN, QRDQN, PPO or A2C with discrete actions"
        )
    shared = _sequence(state, "mlp_extractor.shared_net.")  # before 1.8
    own = _sequence(state, "mlp_extractor.policy_net.")
    return [*shared, *own, _linear(state, "action_net")], "Tanh"


def _is_quantiles(name: str) -> bool:
    return name.startswith("quantile_net.")


def _sequence(state: State, prefix: str) -> list[_Linear]:
    """Linear layers, each followed by an activation: numbered 0, 2, 4 and so on."""
    names = [name.removeprefix(prefix) for name in state if name.startswith(prefix)]
    numbers = range(0, len(names), 2)
    if set(names) != {f"{number}.{kind}" for number in numbers for kind in _Linear._fields}:
        raise ValueError(f"{prefix[:-1]} has layers that are not linear, which are not supported")
    return [_linear(state, f"{prefix}{number}") for number in numbers]


def _linear(state: State, name: str) -> _Linear:
    weight, bias = (state.get(f"{name}.{kind}") for kind in _Linear._fields)
    if weight is None or bias is None or weight.ndim != 2 or bias.shape != weight.shape[:1]:
        raise ValueError(f"{name} is not a linear layer, which is not supported")
    return _Linear(weight, bias)


def _activation(facts: Mapping[str, Any], default: str) -> str:
    extractor = _class_name(_text(facts, "policy_kwargs", "features_extractor_class"))
    if extractor not in (None, "FlattenExtractor"):
        raise ValueError(f"its features extractor is {extractor}, must be FlattenExtractor")
    said = _text(facts, "policy_kwargs", "activation_fn")
    name = default if said is None else _class_name(said)
    if name not in _ACTIVATIONS:
        raise ValueError(f"its activation is {name}, must be one of {', '.join(_ACTIVATIONS)}")
    return _ACTIVATIONS[name]


def _text(facts: Mapping[str, Any], name: str, inside: str) -> str | None:
    """A value in plain text, which SB3 writes in addition to its pickle."""
    holder = facts.get(name)
    if not isinstance(holder, dict) or inside not in holder:
        return None
    return str(cast(dict[str, object], holder)[inside])


def _class_name(text: str | None) -> str | None:
    """The class name in `<class 'a.b.C'>`, without its module; other text unchanged."""
    named = _CLASS.fullmatch(text or "")
    return named[1] if named else text
