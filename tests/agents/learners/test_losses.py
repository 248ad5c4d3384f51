import jax.numpy as jnp

from touchdown.agents.learners.losses import losses_of


def test_huber_is_a_parabola_up_to_its_knee_at_one_and_then_a_line():
    assert float(losses_of(jnp.array([0.5]), "huber").mean()) == 0.125  # ½·½²
    assert float(losses_of(jnp.array([1.0]), "huber").mean()) == 0.5
    assert float(losses_of(jnp.array([-3.0]), "huber").mean()) == 2.5  # 3 − ½
    assert float(losses_of(jnp.array([-3.0, 1.0]), "huber").mean()) == 1.5  # their mean
    assert float(losses_of(jnp.array([-3.0, 1.0]), "mse").mean()) == 5.0
