"""A network saved by PyTorch alone, or by CleanRL, loaded without unpickling anything.

A state dict names its arrays, but not what is computed between them. Only the networks of CleanRL's
DQN, C51 and PPO are known by their names and sizes; another network has to come as ONNX.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.greedy import GreedyPolicy
from touchdown.config.sections import NetworkConfig
from touchdown.core import limits, reading
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import Spaces
from touchdown.envs import environment
from touchdown.policies.foreign import perceptron
from touchdown.policies.foreign.perceptron import Linear, State
from touchdown.policies.foreign.torch_state import read_state

_ZIP = b"PK\x03\x04"
_C51 = "model_weights."  # CleanRL saves these weights with its settings


def read_torch(path: Path, env_id: str) -> GreedyPolicy:
    """A greedy policy from a `.pth`, `.pt` or `.cleanrl_model` of CleanRL's DQN, C51 or PPO.

    For PPO the action is the most probable one, and the values are the logits.

    Args:
        path: path of the file.
        env_id: the environment, which the file does not name.

    Raises:
        UserError: the file is broken, or has another network or environment.
    """
    spaces = environment.spaces_of(env_id)
    data = reading.read_bytes(path, limits.ARCHIVE_BYTES)
    try:
        if not data.startswith(_ZIP):
            raise ValueError(
                "it is not a file of torch.save from PyTorch 1.6 or later, but perhaps a pickle, "
                "which is never opened, or weights of JAX"
            )
        return _policy(read_state(data), spaces)
    except ValueError as error:
        raise UserError(
            f"{path}: not weights of CleanRL's DQN, C51 or PPO: {one_line(error)}; "
            f"{how_to_export(spaces.observation_size)}"
        ) from None


def how_to_export(observation_size: int) -> str:
    """What to do with a network of PyTorch that cannot be read."""
    return (
        "export it where it was trained, with torch.onnx.export(model, "
        f"(torch.zeros(1, {observation_size}),), 'model.onnx'), and use model.onnx"
    )


def _policy(state: State, spaces: Spaces) -> GreedyPolicy:
    atoms = state.get(f"{_C51}atoms")
    if atoms is not None:
        linears = _known(state, f"{_C51}network.", (120, 84))
        return _c51(linears, atoms.astype(np.float64), spaces)
    if any(name.startswith("actor.") for name in state):
        linears = _known(state, "actor.", (64, 64))
        config = NetworkConfig(activation="tanh")
    else:
        linears = _known(state, "network.", (120, 84))
        config = NetworkConfig(activation="relu")
    perceptron.check_fits(linears, spaces, len(linears[-1].bias), 1)
    return perceptron.policy_of(linears, spaces, config)


def _c51(linears: list[Linear], atoms: NDArray[np.float64], spaces: Spaces) -> GreedyPolicy:
    count = atoms.size
    evenly = np.linspace(atoms.flat[0], atoms.flat[-1], count)
    if count < 2 or atoms.shape != evenly.shape or not np.allclose(atoms, evenly):
        raise ValueError("its atoms are not equally spaced")
    num_actions = len(linears[-1].bias) // count
    perceptron.check_fits(linears, spaces, num_actions, count)
    config = NetworkConfig(
        activation="relu", atoms=count, v_min=float(atoms[0]), v_max=float(atoms[-1])
    )
    return perceptron.policy_of(linears, spaces, config)


def _known(state: State, prefix: str, hidden_sizes: tuple[int, ...]) -> list[Linear]:
    """The layers under a prefix, if their sizes are those that CleanRL gives them."""
    linears = perceptron.sequence(state, prefix)
    sizes = tuple(len(each.bias) for each in linears[:-1])
    if sizes != hidden_sizes:
        shown = ", ".join(sorted(state)[:4]) or "no arrays"
        raise ValueError(f"it has {shown}, which do not say what is computed between them")
    return linears
