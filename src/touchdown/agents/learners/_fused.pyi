from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

def simd() -> str:
    """The instruction set in use: avx512, avx2 or baseline."""

class Network:
    """A Q-network's shape, for other modules in C++."""

class Perceptron:
    """A Q-network's shape: ReLU after each hidden layer, flat parameters as `QNetwork` has them.

    Without quantiles and atoms it predicts the means of returns.
    """

    def __init__(
        self,
        num_observations: int,
        hidden_sizes: Sequence[int],
        num_actions: int,
        layer_norm: bool = False,
        dueling: bool = False,
        quantiles: int = 0,
        atoms: int = 0,
        v_min: float = 0.0,
        v_max: float = 0.0,
        noisy: bool = False,
    ) -> None: ...
    @property
    def network(self) -> Network:
        """The shape."""
    @property
    def num_params(self) -> int:
        """P."""
    def values(
        self,
        params: Floats,
        observations: Floats,
        q: Floats,
        noise: tuple[int, int, int] | None = None,
    ) -> None:
        """Write Q(s,·) of observations [N, D] into q [N, A].

        The noise of a noisy network is the seed, purpose and number of a sample.
        """
    def learn(
        self,
        online: Floats,
        target: Floats | None,
        mu: Floats,
        nu: Floats,
        num_updates: int,
        rates: Floats,
        packed: Floats,
        weights: Floats | None,
        td_error: Floats,
        huber: bool,
        double_q: bool,
        sarsa: bool,
        reward_scale: float,
        max_grad_norm: float,
        polyak: float,
        noise: tuple[int, int, int] | None = None,
    ) -> tuple[float, float, float, float]:
        """K updates of online [P] (and of Adam's mu, nu) in place, from packed [K, B, W].

        Returns the last update's loss, mean Q, greatest Q and gradient norm.
        """
    def fit(
        self,
        online: Floats,
        mu: Floats,
        nu: Floats,
        num_updates: int,
        rates: Floats,
        o_tm1: Floats,
        a_tm1: NDArray[np.int32],
        targets: Floats,
        order: NDArray[np.int64],
        td_error: Floats,
        huber: bool,
        max_grad_norm: float,
    ) -> tuple[float, float, float, float]:
        """K updates of means towards targets [M]; order [K, B] says which each minibatch takes."""

def transition_fields(observation_size: int) -> dict[str, int]:
    """Where each field of a packed transition begins, in 4-byte words."""
