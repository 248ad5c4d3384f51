import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from touchdown.agents.learners.optimizer import make_optimizer
from touchdown.config.sections import LearningConfig


def steps_on_a_slope(config: LearningConfig, slope: list[float], count: int) -> np.ndarray:
    optimizer = make_optimizer(config)
    params = jnp.zeros(len(slope))
    state, steps = optimizer.init(params), []
    for _ in range(count):
        step, state = optimizer.update(jnp.array(slope), state, params)
        steps.append(np.asarray(step))
    return np.array(steps)


def test_learning_rate_falls_in_a_line_to_its_end_and_stays():
    config = LearningConfig(
        optimizer="sgd", learning_rate=0.8, learning_rate_end=0.2, learning_rate_duration=3
    )
    steps = steps_on_a_slope(config, [1.0], 6)[:, 0]
    assert_allclose(steps, [-0.8, -0.6, -0.4, -0.2, -0.2, -0.2], rtol=1e-6)


def test_learning_rate_is_constant_without_a_duration_whatever_its_end():
    config = LearningConfig(optimizer="sgd", learning_rate=0.8, learning_rate_end=0.2)
    assert_allclose(steps_on_a_slope(config, [1.0], 3)[:, 0], [-0.8, -0.8, -0.8], rtol=1e-6)


@pytest.mark.parametrize(
    ("max_grad_norm", "expected"),
    [(0.0, [-3.0, 4.0]), (2.5, [-1.5, 2.0]), (10.0, [-3.0, 4.0])],  # the slope is 5 long
)
def test_long_gradients_are_clipped_and_short_ones_are_not(
    max_grad_norm: float, expected: list[float]
):
    config = LearningConfig(optimizer="sgd", learning_rate=1.0, max_grad_norm=max_grad_norm)
    assert_allclose(steps_on_a_slope(config, [3.0, -4.0], 1)[0], expected, rtol=1e-6)


@pytest.mark.parametrize("optimizer", ["adam", "adamw", "rmsprop", "sgd"])
def test_every_optimizer_that_a_config_may_name_goes_downhill(optimizer: str):
    config = LearningConfig(optimizer=optimizer)  # pyright: ignore[reportArgumentType]
    steps = steps_on_a_slope(config, [1.0, -1.0], 1)[0]
    assert steps[0] < 0 < steps[1]
