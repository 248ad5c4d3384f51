from functools import partial

import equinox as eqx
import jax
import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.agents.layers import DuelingHead, NoisyLinear


def test_noise_of_a_layer_is_the_product_of_what_its_ends_draw(monkeypatch: pytest.MonkeyPatch):
    layer = NoisyLinear(2, 1, sigma=0.5, key=jax.random.key(0))
    layer = eqx.tree_at(
        lambda it: (it.weight, it.bias, it.weight_sigma, it.bias_sigma),
        layer,
        tuple(np.array(value, np.float32) for value in ([[1, 2]], [3], [[10, 100]], [1000])),
    )
    drawn = jax.numpy.array([4.0, -9.0, 25.0])  # of the output, then of the inputs
    monkeypatch.setattr(jax.random, "normal", lambda *_: drawn)
    x = np.array([1, 1], np.float32)
    # f = 2, -3 and 5: weights 1 + 10·(2·-3) and 2 + 100·(2·5), bias 3 + 1000·2
    assert layer(x, key=jax.random.key(0)).tolist() == [1 - 60 + 2 + 1000 + 3 + 2000]
    assert layer(x).tolist() == [1 + 2 + 3]


def test_the_two_parts_of_a_noisy_dueling_head_draw_apart():
    linear = partial(NoisyLinear, sigma=1.0)
    head = DuelingHead(3, 2, 1, linear, key=jax.random.key(0))
    key, features = jax.random.key(5), np.ones(3, np.float32)
    of_value, of_advantage = jax.random.split(key)
    value = head.value(features, key=of_value)
    advantage = head.advantage(features, key=of_advantage)
    assert_allclose(head(features, key=key), value + advantage - advantage.mean(), rtol=1e-5)


def test_noise_has_no_mean_and_the_spread_that_its_deviations_say():
    layer = NoisyLinear(4, 3, sigma=0.5, key=jax.random.key(0))
    assert np.unique(layer.weight_sigma) == np.unique(layer.bias_sigma) == 0.25  # ½ / √4
    keys = jax.random.split(jax.random.key(1), 4_000)
    x = np.zeros(4, np.float32)
    bias = jax.vmap(lambda key: layer(x, key=key))(keys) - layer.bias
    assert_allclose(bias.mean(axis=0), np.zeros(3), atol=0.02)
    # the variance of f(ε) is the mean of |ε|
    assert_allclose(bias.std(axis=0), np.full(3, 0.25 * (2 / np.pi) ** 0.25), rtol=0.05)
