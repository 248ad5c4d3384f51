"""A policy saved by Stable-Baselines3, loaded without unpickling anything.

Its archive contains `data`, JSON with pickles, which are not read, and `policy.pth`, PyTorch
weights. The names of the weights determine the algorithm, and their shapes the layers. The
activation is the algorithm's default unless `data` has another one in plain text.
"""

import shlex
from pathlib import Path
from typing import Literal

import numpy as np

from touchdown.agents.greedy import GreedyPolicy
from touchdown.config.sections import NetworkConfig
from touchdown.core import limits, reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Policy, Spaces
from touchdown.envs import environment
from touchdown.policies.foreign import normalisation, perceptron
from touchdown.policies.foreign.archive import Archive
from touchdown.policies.foreign.normalisation import NormalisedPolicy
from touchdown.policies.foreign.perceptron import Linear, State
from touchdown.policies.foreign.sb3_facts import Facts, class_name, read_facts
from touchdown.policies.foreign.torch_state import read_state

_HOMES = ("stable_baselines3.", "sb3_contrib.")  # modules of the policies whose defaults are known
_Activation = Literal["relu", "tanh", "silu"]
_ACTIVATIONS: dict[str, _Activation] = {  # whole names: someone's own `Tanh` may be anything
    "torch.nn.modules.activation.ReLU": "relu",
    "torch.nn.modules.activation.Tanh": "tanh",
    "torch.nn.modules.activation.SiLU": "silu",
}
_RELU, _TANH = list(_ACTIVATIONS)[:2]
_EXTRACTOR = "stable_baselines3.common.torch_layers.FlattenExtractor"
_DISCRETE = ("gymnasium.spaces.discrete.Discrete", "gym.spaces.discrete.Discrete")
_SEEN = ("gymnasium.spaces.box.Box", "gym.spaces.box.Box", *_DISCRETE)


def read_sb3(path: Path, env_id: str, vecnormalize: str | None = None) -> Policy:
    """A greedy policy from a Stable-Baselines3 archive of DQN, QRDQN, PPO or A2C with `MlpPolicy`.

    For an actor (PPO, A2C) the action is the most probable one, and the values are the logits.

    Args:
        path: path of the `.zip` file.
        env_id: the environment, which the archive does not name.
        vecnormalize: path of the statistics that `VecNormalize.save` wrote; `none` if observations
            were not normalised in training; None to find out.

    Raises:
        UserError: the file is not such an archive, is broken, or has another kind of policy or
            environment; or observations were normalised, or may have been, and `vecnormalize` does
            not say how.
    """
    spaces = environment.spaces_of(env_id)
    data = reading.read_bytes(path, limits.ARCHIVE_BYTES)
    try:
        archive = Archive(data)
        facts = read_facts(archive.read("data", limits.ARCHIVE_FACTS_BYTES))
        _check_kind(facts)
        state = read_state(archive.read("policy.pth", limits.ARCHIVE_BYTES))
        policy = _policy(facts, state, spaces)
    except ValueError as error:
        raise UserError(
            f"{path}: not a supported Stable-Baselines3 policy: {one_line(error)}"
        ) from None
    return _normalised(policy, path, facts, state, spaces, vecnormalize)


def _normalised(
    policy: GreedyPolicy,
    path: Path,
    facts: Facts,
    state: State,
    spaces: Spaces,
    vecnormalize: str | None,
) -> Policy:
    """The policy with the statistics of its observations, if it was trained with some."""
    if vecnormalize == normalisation.NONE:
        return policy
    if vecnormalize is not None:
        found = normalisation.read_normalisation(Path(vecnormalize), spaces.observation_size)
        return policy if found is None else NormalisedPolicy(policy, found)
    is_actor = "action_net.weight" in state
    normalised = facts.normalised if is_actor else None  # DQN keeps that observation always
    near = [] if normalised is False else normalisation.statistics_near(path)
    if not normalised and not near:
        return policy
    how = "was trained" if normalised else "may have been trained"
    file = shlex.quote(str(near[0])) if near else "FILE"
    raise UserError(
        f"{path}: {how} with VecNormalize: pass --vecnormalize {file}, the file that "
        "VecNormalize.save wrote (it is read, but never unpickled), or --vecnormalize none if "
        "observations were not normalised"
    )


def _policy(facts: Facts, state: State, spaces: Spaces) -> GreedyPolicy:
    linears, default = _linears(state)
    last = linears[-1]
    gives = len(last.bias)
    quantiles = gives // spaces.num_actions if any(map(_is_quantiles, state)) else 0
    declared = facts.action_space.n or spaces.num_actions
    perceptron.check_fits(linears, spaces, declared, max(quantiles, 1))
    if quantiles:  # SB3 orders them by quantile, we by action
        by_action = np.arange(gives).reshape(quantiles, -1).T.ravel()
        last = Linear(last.weight[by_action], last.bias[by_action])
    config = NetworkConfig(activation=_activation(facts, default), quantiles=quantiles)
    return perceptron.policy_of([*linears[:-1], last], spaces, config)


def _check_kind(facts: Facts) -> None:
    """Refuse another kind of policy, identified by the text outside the pickles."""
    home = str(facts.policy_class.module or "an unnamed module")
    if home.startswith("sbx."):
        raise ValueError("it was saved by SBX, with weights as a pickle; pickles are never opened")
    if not home.startswith(_HOMES):
        raise ValueError(
            f"its policy's class is from {home!r}; only MlpPolicy of stable_baselines3 and "
            "sb3_contrib is supported; export another one to ONNX"
        )
    for name, space, known, wanted in (
        ("action_space", facts.action_space, _DISCRETE, "Discrete"),
        ("observation_space", facts.observation_space, _SEEN, "Box or Discrete"),
    ):
        kind = class_name(space.type)
        if kind not in known:
            raise ValueError(f"its {name} is {kind}, must be Gymnasium's {wanted}")
    if str(facts.action_space.start) not in ("None", "0"):
        raise ValueError("its actions do not start at 0")


def _linears(state: State) -> tuple[list[Linear], str]:
    """The layers from the observation to the values, and the algorithm's activation."""
    if any("features_extractor." in name for name in state):
        raise ValueError(
            "it has a features extractor with weights, such as a CNN; only MlpPolicy is supported"
        )
    if any(name.startswith("lstm_") for name in state):
        raise ValueError("it is recurrent; only MlpPolicy is supported")
    for values in ("q_net.q_net.", "quantile_net.quantile_net."):
        if linears := perceptron.sequence(state, values):
            return linears, _RELU
    if "action_net.weight" not in state or "log_std" in state:
        raise ValueError(
            "its weights are not those of DQN, QRDQN, PPO or A2C with discrete actions"
        )
    shared = perceptron.sequence(state, "mlp_extractor.shared_net.")  # before 1.8
    own = perceptron.sequence(state, "mlp_extractor.policy_net.")
    return [*shared, *own, perceptron.linear(state, "action_net")], _TANH


def _is_quantiles(name: str) -> bool:
    return name.startswith("quantile_net.")


def _activation(facts: Facts, default: str) -> _Activation:
    arguments = facts.policy_kwargs
    extractor = class_name(arguments.features_extractor_class)
    if extractor not in (None, _EXTRACTOR):
        raise ValueError(
            f"its features extractor is {extractor}, must be {_EXTRACTOR}; export it to ONNX"
        )
    name = class_name(arguments.activation_fn) or default
    if name not in _ACTIVATIONS:
        raise ValueError(
            f"its activation is {name}, must be one of {', '.join(_ACTIVATIONS)}; export it to ONNX"
        )
    return _ACTIVATIONS[name]
