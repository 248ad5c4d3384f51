import jax
import numpy as np
import pytest
from numpy.random import default_rng

from touchdown.agents.greedy import GreedyPolicy, in_blocks
from touchdown.agents.networks import QNetwork
from touchdown.core.errors import UserError


def tied(network: QNetwork, params: np.ndarray) -> np.ndarray:
    """Parameters of two actions whose values are the same sum in another order.

    The second half of the last hidden layer doubles the first, and the actions weigh the halves
    the other way round: which action is better is decided by nothing but rounding.
    """
    numbered = network.layers(np.arange(network.num_params, dtype=np.float32))
    at = {name: np.asarray(places).astype(int) for name, places in numbered.items()}
    for name in ("layers.1.weight", "layers.1.bias"):
        params[at[name][8:]] = params[at[name][:8]]
    one, other = at["layers.2.weight"]
    params[other] = np.roll(params[one], 8)
    params[at["layers.2.bias"]] = 0
    return params


def test_an_action_does_not_depend_on_the_observations_beside_it(network: QNetwork):
    policy = GreedyPolicy(network, tied(network, np.array(network.init(jax.random.key(0)))))
    observations = (
        default_rng(0).normal(size=(200, 5)).astype(np.float32) * 3
    )  # more than six full calls
    together = policy.act(observations)
    left, right = np.asarray(network.values(policy.params, observations)).T
    np.testing.assert_allclose(left, right, atol=1e-5)  # ties, but for rounding
    alone = [policy.act(observations[i : i + 1]).item() for i in range(200)]
    assert together.tolist() == alone
    assert policy.act(observations[::-1]).tolist() == alone[::-1]
    assert policy.act(observations[:33]).tolist() == alone[:33]


def test_blocks_are_of_one_size_and_their_filling_is_left_out():
    seen: list[tuple[int, ...]] = []

    def double(block: np.ndarray) -> np.ndarray:
        seen.append(block.shape)
        return 2 * block[:, 0]

    observations = np.arange(10).reshape(5, 2)
    assert in_blocks(double, observations, rows=2).tolist() == [0, 4, 8, 12, 16]
    assert seen == [(2, 2)] * 3


def test_a_value_that_is_not_finite_has_no_best_action(network: QNetwork):
    policy = GreedyPolicy(network, np.array(network.init(jax.random.key(0))))
    observations = np.zeros((3, 5), np.float32)
    observations[1, 2] = np.inf
    with pytest.raises(
        UserError, match=r"values are not finite for the observation \[0\.0, 0\.0, inf"
    ):
        policy.act(observations)
    assert policy.act(observations[:1]).shape == (1,)
