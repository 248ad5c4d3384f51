"""A multilayer perceptron from the named arrays of another library."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import GreedyPolicy
from touchdown.agents.models import network_to_act
from touchdown.config.sections import NetworkConfig
from touchdown.core import finite
from touchdown.core.types import Spaces

State = Mapping[str, NDArray[Any]]


class Linear(NamedTuple):
    """One layer: y = W·x + b."""

    weight: NDArray[Any]  # [out, in]
    bias: NDArray[Any]  # [out]


def sequence(state: State, prefix: str) -> list[Linear]:
    """Linear layers, each followed by an activation: numbered 0, 2, 4 and so on.

    Args:
        state: all arrays.
        prefix: beginning of the names of the layers' arrays.

    Returns:
        The layers in order; none if no name begins so.

    Raises:
        ValueError: there are other layers.
    """
    names = [name.removeprefix(prefix) for name in state if name.startswith(prefix)]
    numbers = range(0, len(names), 2)
    if set(names) != {f"{number}.{kind}" for number in numbers for kind in Linear._fields}:
        raise ValueError(f"{prefix[:-1]} has layers that are not linear, which are not supported")
    return [linear(state, f"{prefix}{number}") for number in numbers]


def linear(state: State, name: str) -> Linear:
    """One linear layer.

    Raises:
        ValueError: its arrays are missing or are not those of a linear layer.
    """
    weight, bias = (state.get(f"{name}.{kind}") for kind in Linear._fields)
    if weight is None or bias is None or weight.ndim != 2 or bias.shape != weight.shape[:1]:
        raise ValueError(f"{name} is not a linear layer, which is not supported")
    return Linear(weight, bias)


def policy_of(linears: Sequence[Linear], spaces: Spaces, config: NetworkConfig) -> GreedyPolicy:
    """The greedy policy of layers.

    Args:
        linears: the layers, from the observation to the values of the actions.
        spaces: of the environment.
        config: the network's, except for the sizes of its hidden layers.

    Raises:
        ValueError: their shapes do not fit, or a number is not finite.
    """
    hidden_sizes = tuple(len(each.bias) for each in linears[:-1])
    network = network_to_act(replace(config, hidden_sizes=hidden_sizes), spaces)
    layers = {
        f"layers.{number}.{name}": array.astype(np.float32)
        for number, each in enumerate(linears)
        for name, array in each._asdict().items()
    }
    finite.check(layers)
    return network.policy(network.params_of(layers))


def check_fits(
    linears: Sequence[Linear], spaces: Spaces, num_actions: object, per_action: int
) -> None:
    """Check that layers are for an environment.

    Args:
        linears: the layers.
        spaces: of the environment.
        num_actions: number of actions that the file is for.
        per_action: numbers that the layers give for each action.

    Raises:
        ValueError: they are not.
    """
    takes, gives = linears[0].weight.shape[1], len(linears[-1].bias)
    expected = spaces.num_actions * per_action
    found = takes, gives, str(num_actions)
    if found != (spaces.observation_size, expected, str(spaces.num_actions)):
        raise ValueError(
            f"it takes {takes} numbers and gives {gives}, for {num_actions} actions; the "
            f"environment has observations of {spaces.observation_size} and {spaces.num_actions} "
            "actions; set it with --env-id"
        )
