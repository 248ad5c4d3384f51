from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose

from touchdown.agents.learners.state import LearnerState, copy_target, init_state
from touchdown.agents.learners.update import make_update
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig, NetworkConfig
from touchdown.replay.transition import transition_dtype

Layers = list[tuple[np.ndarray, np.ndarray]]  # weight [out, in] and bias [out] of each


QUIET, MEASURED = False, True


def random_batch(seed: int, size: int = 12, reward: float = 3.0) -> np.ndarray:
    """Records with rewards of about `reward`, of which a quarter terminated."""
    rng = default_rng(seed)
    batch = np.zeros(size, transition_dtype(5))
    batch["o_tm1"], batch["o_t"] = rng.normal(size=(2, size, 5))
    batch["a_tm1"] = rng.integers(2, size=size)
    batch["r_t"] = reward * rng.normal(size=size)
    batch["terminated"] = rng.random(size) < 0.25
    batch["discount_t"] = np.where(batch["terminated"], 0, 0.9)
    return batch


def packed_of(batch: np.ndarray) -> np.ndarray:
    return batch.view(np.float32).reshape(len(batch), -1)


# --- the slow twin ---


class Moments(NamedTuple):
    first: Layers
    second: Layers


def layers_of(network: QNetwork, params: jax.Array) -> Layers:
    named = {name: np.asarray(array, float) for name, array in network.layers(params).items()}
    return [
        (named[f"layers.{i}.weight"], named[f"layers.{i}.bias"]) for i in range(len(named) // 2)
    ]


def forward(layers: Layers, x: np.ndarray) -> list[np.ndarray]:
    """What goes into each layer, and after the last one the values."""
    inputs = [x]
    for i, (weight, bias) in enumerate(layers):
        z = weight @ inputs[-1] + bias
        inputs.append(z if i == len(layers) - 1 else np.maximum(z, 0))
    return inputs


def slow_gradient(
    config: LearningConfig, online: Layers, bootstrap: Layers, batch: np.ndarray
) -> tuple[float, Layers]:
    """Loss and semi-gradient, one transition at a time, by the chain rule."""
    loss = 0.0
    gradient = [(np.zeros_like(weight), np.zeros_like(bias)) for weight, bias in online]
    for row in batch:
        inputs = forward(online, row["o_tm1"].astype(float))
        target = float(row["r_t"]) * config.reward_scale
        target += float(row["discount_t"]) * forward(bootstrap, row["o_t"].astype(float))[-1].max()
        delta = target - inputs[-1][row["a_tm1"]]
        if config.loss == "mse":
            loss, slope = loss + delta**2, 2 * delta
        else:
            inside = abs(delta) <= 1
            loss += delta**2 / 2 if inside else abs(delta) - 0.5
            slope = delta if inside else np.sign(delta)
        back = np.zeros(2)
        back[row["a_tm1"]] = -slope
        for i in reversed(range(len(online))):
            gradient[i][0][:] += np.outer(back, inputs[i])
            gradient[i][1][:] += back
            back = (online[i][0].T @ back) * (inputs[i] > 0)
    mean = [(weight / len(batch), bias / len(batch)) for weight, bias in gradient]
    return loss / len(batch), mean


def norm_of(gradient: Layers) -> float:
    return float(np.sqrt(sum(np.sum(array**2) for layer in gradient for array in layer)))


def slow_update(
    config: LearningConfig,
    online: Layers,
    target: Layers | None,
    moments: Moments,
    *,
    number: int,
    batch: np.ndarray,
) -> tuple[float, float]:
    """Adam by hand (Kingma and Ba, 2015), in place. Returns loss and length of the gradient."""
    loss, gradient = slow_gradient(config, online, target or online, batch)
    norm = norm_of(gradient)
    clip = min(1.0, config.max_grad_norm / norm) if config.max_grad_norm else 1.0
    for layer, first, second, slopes in zip(online, *moments, gradient, strict=True):
        for theta, m, v, g in zip(layer, first, second, slopes, strict=True):
            m[:] = 0.9 * m + 0.1 * clip * g
            v[:] = 0.999 * v + 0.001 * (clip * g) ** 2
            m_hat, v_hat = m / (1 - 0.9**number), v / (1 - 0.999**number)
            theta[:] = theta - config.learning_rate * m_hat / (np.sqrt(v_hat) + 1e-8)
    return loss, norm


@pytest.mark.parametrize(
    "config",
    [
        LearningConfig(loss="mse"),
        LearningConfig(loss="huber"),
        LearningConfig(loss="mse", target_period=10),
        LearningConfig(loss="huber", target_period=10),
        LearningConfig(loss="mse", max_grad_norm=2.0),
        LearningConfig(loss="huber", target_period=10, max_grad_norm=0.3),
        LearningConfig(loss="huber", reward_scale=0.1),
        LearningConfig(loss="mse", target_period=10, reward_scale=0.5, max_grad_norm=2.0),
    ],
    ids=lambda config: (
        f"{config.loss}-target{config.target_period}"
        f"-clip{config.max_grad_norm}-scale{config.reward_scale}"
    ),
)
def test_updates_equal_backpropagation_and_adam_by_hand(config: LearningConfig, network: QNetwork):
    config = LearningConfig(
        **{name: getattr(config, name) for name in ("loss", "reward_scale", "max_grad_norm")},
        target_period=config.target_period,
        learning_rate=0.001,
    )
    state = init_state(network, config, seed=0)
    if config.target_period:
        state = state._replace(target_params=network.init(jax.random.key(99)))
    update = make_update(network, config)
    online = layers_of(network, state.online_params)
    target = layers_of(network, state.target_params) if config.target_period else None
    moments = Moments(*([(w * 0, b * 0) for w, b in online] for _ in range(2)))
    clipped = []

    # Adam's first step is blind to the gradient's scale: more steps, of rewards that grow
    for number, reward in enumerate((0.3, 1.0, 9.0), start=1):
        batch = random_batch(number, reward=reward)
        q_tm1 = np.array([forward(online, row["o_tm1"].astype(float))[-1] for row in batch])
        state, metrics, _ = update(state, packed_of(batch), None, MEASURED)
        loss, norm = slow_update(config, online, target, moments, number=number, batch=batch)
        for fast, slow in zip(layers_of(network, state.online_params), online, strict=True):
            assert_allclose(fast[0], slow[0], rtol=0, atol=1e-5)
            assert_allclose(fast[1], slow[1], rtol=0, atol=1e-5)
        assert_allclose(metrics.loss, loss, rtol=1e-4)
        assert_allclose(metrics.gradient_norm, norm, rtol=1e-4)  # before clipping
        assert_allclose(metrics.mean_q, q_tm1.mean(), rtol=1e-4, atol=1e-5)
        assert_allclose(metrics.max_q, q_tm1.max(), rtol=1e-4)
        clipped.append(norm > config.max_grad_norm)
    if config.max_grad_norm:
        assert sorted(clipped) in ([False, True, True], [False, False, True])  # both happened


# --- what an update touches ---


@pytest.mark.parametrize("target_period", [0, 10])
def test_gradient_does_not_flow_through_the_bootstrap(target_period: int, network: QNetwork):
    config = LearningConfig(optimizer="sgd", learning_rate=0.1, target_period=target_period)
    state = init_state(network, config, seed=0)
    batch = np.zeros(4, transition_dtype(5))
    batch["o_tm1"][:, 0] = 1  # states 0 and 1 are learned about
    batch["o_tm1"][2:] = [0, 1, 0, 0, 0]
    batch["o_t"][:, 4] = 1  # state 4 is only bootstrapped from
    batch["discount_t"] = 1
    batch["r_t"] = 5
    new, *_ = make_update(network, config)(state, packed_of(batch), None, QUIET)
    before, after = (layers_of(network, s.online_params)[0][0] for s in (state, new))
    assert np.array_equal(before[:, 4], after[:, 4])
    assert np.abs(before - after)[:, 0].max() > 1e-3
    assert np.abs(before - after)[:, 1].max() > 1e-3


def test_updates_leave_the_target_network_alone(network: QNetwork):
    config = LearningConfig(target_period=10)
    state = init_state(network, config, seed=0)
    before = np.array(state.target_params)
    assert np.array_equal(before, state.online_params)  # it starts as a copy
    for number in range(3):
        state, *_ = make_update(network, config)(
            state, packed_of(random_batch(number)), None, QUIET
        )
    assert np.array_equal(before, state.target_params)
    assert not np.isclose(before, state.online_params).all()


def test_a_copied_target_outlives_the_online_parameters_it_came_from(network: QNetwork):
    config = LearningConfig(target_period=10, batch_size=16)
    update = jax.jit(make_update(network, config), donate_argnums=0, static_argnums=3)
    state = init_state(network, config, seed=0)
    batch = packed_of(random_batch(1, size=16))
    for _ in range(2):  # donated from the start, and after a copy
        old_target = np.array(state.target_params)
        donated = state
        state, *_ = update(state, batch, None, QUIET)
        assert donated.online_params.is_deleted()  # its memory was given away
        assert np.array_equal(state.target_params, old_target)
        online = np.array(state.online_params)
        state = copy_target(state)
        assert np.array_equal(state.target_params, online)
        assert not np.array_equal(online, old_target)
    addresses = [p.unsafe_buffer_pointer() for p in (state.online_params, state.target_params)]
    assert addresses[0] != addresses[1]


def test_measuring_an_update_does_not_change_it(network: QNetwork):
    config = LearningConfig(target_period=10, loss="huber", max_grad_norm=1.0)
    update = jax.jit(make_update(network, config), static_argnums=3)
    state = init_state(network, config, seed=0)
    batch = packed_of(random_batch(0))
    measured, metrics, _ = update(state, batch, None, MEASURED)
    quiet, nothing, _ = update(state, batch, None, QUIET)
    assert metrics is not None
    assert nothing is None
    for one, other in zip(jax.tree.leaves(measured), jax.tree.leaves(quiet), strict=True):
        assert np.array_equal(one, other)


def test_copying_the_target_changes_nothing_else(network: QNetwork):
    config = LearningConfig(target_period=10)
    state = init_state(network, config, seed=0)
    state, *_ = make_update(network, config)(state, packed_of(random_batch(0)), None, QUIET)
    copied = copy_target(state)
    for name in ("online_params", "opt_state"):
        same = jax.tree.map(np.array_equal, getattr(state, name), getattr(copied, name))
        assert jax.tree.all(same), name


def test_state_is_a_value_that_updates_do_not_change(network: QNetwork):
    state = init_state(network, LearningConfig(), seed=0)
    kept = jax.tree.map(np.array, state)
    update = make_update(network, LearningConfig())
    one, *_ = update(state, packed_of(random_batch(0)), None, QUIET)
    two, *_ = update(state, packed_of(random_batch(0)), None, QUIET)
    assert isinstance(one, LearnerState)
    assert jax.tree.all(jax.tree.map(np.array_equal, state, kept))
    assert jax.tree.all(jax.tree.map(np.array_equal, one, two))


def test_a_soft_update_moves_the_target_by_its_share_after_each_update(network: QNetwork):
    config = LearningConfig(polyak=0.25)
    state = init_state(network, config, seed=0)
    before = np.array(state.target_params)
    new, *_ = make_update(network, config)(state, packed_of(random_batch(0)), None, QUIET)
    online = np.array(new.online_params)
    assert_allclose(new.target_params, before + 0.25 * (online - before), rtol=1e-6)


def test_weights_scale_each_transition_s_loss(network: QNetwork):
    config = LearningConfig(optimizer="sgd", learning_rate=1.0)
    state = init_state(network, config, seed=0)
    update = make_update(network, config)
    batch = random_batch(0, size=2)
    only_first, *_ = update(state, packed_of(batch), jnp.array([1.0, 0.0]), QUIET)
    half_of_first, *_ = update(state, packed_of(batch[:1]), jnp.array([0.5]), QUIET)
    assert_allclose(only_first.online_params, half_of_first.online_params, atol=1e-6)


def test_the_errors_handed_back_are_those_of_the_weights_before_the_update(network: QNetwork):
    config = LearningConfig(target_period=9, double=True)
    state = init_state(network, config, seed=0)
    state = state._replace(target_params=state.online_params * 0.5)
    batch = random_batch(0)
    _, _, td_error = make_update(network, config)(state, packed_of(batch), None, QUIET)
    q_tm1, q_t = (network.apply(state.online_params, batch[o]) for o in ("o_tm1", "o_t"))
    evaluated = network.apply(state.target_params, batch["o_t"])
    for i, row in enumerate(batch):
        target = row["r_t"] + row["discount_t"] * evaluated[i][q_t[i].argmax()]
        assert_allclose(td_error[i], target - q_tm1[i][row["a_tm1"]], rtol=1e-4)


# --- atoms, and noisy weights ---


def shaped(**settings) -> QNetwork:
    return QNetwork(5, 2, NetworkConfig(hidden_sizes=(16, 16), **settings))


def compiled(network: QNetwork, config: LearningConfig):
    return jax.jit(make_update(network, config), static_argnums=3)


@pytest.mark.parametrize("double", [False, True])
def test_an_update_of_atoms_descends_the_cross_entropy_of_each_transition(double: bool):
    network = shaped(atoms=7, v_min=-3, v_max=3)
    config = LearningConfig(
        optimizer="sgd", learning_rate=1.0, target_period=9, double=double, reward_scale=0.5
    )
    state = init_state(network, config, seed=0)
    state = state._replace(target_params=network.init(jax.random.key(99)))
    batch = random_batch(0)
    new, metrics, td_error = compiled(network, config)(state, packed_of(batch), None, MEASURED)

    z = np.linspace(-3, 3, 7)
    p_t = np.exp(network.log_probabilities(state.target_params, batch["o_t"]))
    selects = network.apply(state.online_params, batch["o_t"]) if double else p_t @ z
    targets = np.zeros((len(batch), 7))
    for row, chosen in enumerate(np.argmax(selects, axis=1)):
        for atom, p in zip(z, p_t[row, chosen], strict=True):
            moved = np.clip(0.5 * batch["r_t"][row] + batch["discount_t"][row] * atom, -3, 3)
            targets[row] += p * np.maximum(1 - np.abs(moved - z), 0)  # the atoms are 1 apart

    def slow_loss(params: jax.Array) -> jax.Array:
        log_p = network.log_probabilities(params, batch["o_tm1"])
        taken = log_p[jnp.arange(len(batch)), batch["a_tm1"]]
        return -jnp.sum(targets * taken) / len(batch)

    loss, slope = jax.jit(jax.value_and_grad(slow_loss))(state.online_params)
    assert_allclose(new.online_params, state.online_params - slope, rtol=1e-4, atol=1e-6)
    assert_allclose(metrics.loss, loss, rtol=1e-5)
    q_tm1 = np.asarray(network.apply(state.online_params, batch["o_tm1"]))
    assert_allclose(metrics.max_q, q_tm1.max(), rtol=1e-4)
    of_taken = q_tm1[np.arange(len(batch)), batch["a_tm1"]]
    assert_allclose(td_error, targets @ z - of_taken, rtol=1e-4, atol=1e-5)


def test_the_loss_of_atoms_is_the_same_whatever_loss_is_set():
    network = shaped(atoms=7)
    results = []
    for loss in ("mse", "huber"):
        config = LearningConfig(loss=loss)  # pyright: ignore[reportArgumentType]
        state = init_state(network, config, seed=0)
        update = compiled(network, config)
        results.append(update(state, packed_of(random_batch(0)), None, QUIET).state.online_params)
    assert np.array_equal(*results)


def test_one_key_s_noise_repeats_an_update_and_another_s_or_none_makes_another():
    network = shaped(noisy=True)
    config = LearningConfig(target_period=9, double=True)
    state = init_state(network, config, seed=0)
    update = compiled(network, config)

    def errors(noise: jax.Array | None) -> np.ndarray:
        return np.asarray(update(state, packed_of(random_batch(0)), None, QUIET, noise).td_error)

    one, same, other = (errors(jax.random.key(key)) for key in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.isclose(one, other).all()
    assert not np.isclose(one, errors(None)).all()


def test_the_online_the_bootstrapping_and_the_selecting_network_draw_apart():
    network = shaped(noisy=True)
    config = LearningConfig(target_period=9, double=True)
    state = init_state(network, config, seed=0)
    batch, key = random_batch(0), jax.random.key(3)
    update = compiled(network, config)
    td_error = update(state, packed_of(batch), None, QUIET, key).td_error
    learns, bootstraps, selects = jax.random.split(key, 3)
    q_tm1 = network.apply(state.online_params, batch["o_tm1"], learns)
    q_t = network.apply(state.target_params, batch["o_t"], bootstraps)
    best = network.apply(state.online_params, batch["o_t"], selects).argmax(axis=1)
    for i, row in enumerate(batch):
        target = row["r_t"] + row["discount_t"] * q_t[i][best[i]]
        assert_allclose(td_error[i], target - q_tm1[i][row["a_tm1"]], rtol=1e-4, atol=1e-5)


def test_means_and_deviations_of_noisy_weights_are_both_learned():
    network = shaped(noisy=True)
    state = init_state(network, LearningConfig(), seed=0)
    update = compiled(network, LearningConfig())
    new, *_ = update(state, packed_of(random_batch(0)), None, QUIET, jax.random.key(0))
    before, after = (network.layers(it.online_params) for it in (state, new))
    assert [name for name in before if np.array_equal(before[name], after[name])] == []
