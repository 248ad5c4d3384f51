"""The learner's state as a value, and the update that makes a new one (Algorithm 2, lines 7-12)."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, cast

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Float, Int, PRNGKeyArray
from numpy.typing import NDArray

from touchdown.agents import td
from touchdown.agents.batch import Params, TransitionBatch, unpack_transitions
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import LearningConfig


class LearnerState(NamedTuple):
    """Everything that an update reads and writes."""

    online_params: Params
    target_params: Params | None  # None: no target network, the online one bootstraps
    opt_state: optax.OptState


class Metrics(NamedTuple):
    """What one update saw. Q values and the loss are in units of the scaled reward.

    The loss of atoms is a cross entropy, in nats.
    """

    loss: jax.Array
    mean_q: jax.Array
    max_q: jax.Array
    gradient_norm: jax.Array

    def to_floats(self, reward_scale: float) -> dict[str, float]:
        """By name, for the records; values in units of the reward, whatever scale is learnt in."""
        return {
            "loss": float(self.loss),
            "mean_q": float(self.mean_q) / reward_scale,
            "max_q": float(self.max_q) / reward_scale,
            "gradient_norm": float(self.gradient_norm),
        }


class Updated(NamedTuple):
    """What an update gives."""

    state: LearnerState
    metrics: Metrics | None
    td_error: Float[jax.Array, " B"]


Batch = Float[jax.Array, "B W"]
Weights = Float[jax.Array, " B"]


class Noise(NamedTuple):
    """Keys of an update's samples of noisy weights; None where the weights are not noisy."""

    tm1: PRNGKeyArray | None  # of the online network, of what was done
    t: PRNGKeyArray | None  # of the network that bootstraps
    selection: PRNGKeyArray | None  # of the online network, where it selects the next action


Losses = Callable[[Params, Params, TransitionBatch, Noise], tuple[jax.Array, jax.Array, jax.Array]]
"""Losses [B], Q(s,·) [B, A] and TD errors [B] of online and bootstrapping weights on a batch."""


class Update(Protocol):
    """A new learner state from a minibatch."""

    def __call__(
        self,
        state: LearnerState,
        words: Batch,
        weights: Weights | None,
        measured: bool,
        noise: PRNGKeyArray | None = None,
    ) -> Updated:
        """Update once; `noise` is the key for noisy weights, None where they are not noisy."""
        ...


def make_optimizer(config: LearningConfig) -> optax.GradientTransformation:
    """The optimiser named by the config, behind a clip of the gradient's norm where one is set."""
    if config.learning_rate_duration:
        rate = optax.linear_schedule(
            config.learning_rate, config.learning_rate_end, config.learning_rate_duration
        )
    else:
        rate = config.learning_rate
    optimizer = getattr(optax, config.optimizer)(rate)
    if config.max_grad_norm:
        return optax.chain(optax.clip_by_global_norm(config.max_grad_norm), optimizer)
    return optimizer


def init_learner(network: QNetwork, config: LearningConfig, seed: int) -> LearnerState:
    """A fresh learner; the target network starts as a copy of the online one."""
    online = network.init(jax.random.key(seed))
    return LearnerState(
        online_params=online,
        target_params=jnp.array(online, copy=True) if config.has_target else None,
        opt_state=make_optimizer(config).init(online),
    )


def copy_target(state: LearnerState) -> LearnerState:
    """Θ′ ← Θ (Eq. 5)."""
    return state._replace(target_params=state.online_params.copy())


def follow(state: LearnerState, share: float) -> LearnerState:
    """Θ′ ← Θ′ + share·(Θ − Θ′)   (Polyak averaging; Lillicrap et al., 2016)."""
    lag = optax.tree.sub(state.online_params, state.target_params)
    return state._replace(target_params=optax.tree.add_scale(state.target_params, share, lag))


def tensors_of(state: LearnerState) -> dict[str, NDArray[Any]]:
    """All arrays of a state by name, for a checkpoint."""
    return {name: np.array(leaf) for name, leaf in _named_leaves(state).items()}


def state_from(like: LearnerState, tensors: Mapping[str, NDArray[Any]]) -> LearnerState:
    """The state whose arrays `tensors_of` gave, of the same form as `like`.

    Raises:
        ValueError: the arrays are others, or of other shapes or types.
    """
    named = _named_leaves(like)
    if named.keys() != tensors.keys():
        raise ValueError(f"it holds {sorted(tensors)}, the learner needs {sorted(named)}")
    leaves: list[jax.Array] = []
    for name, leaf in named.items():
        value = tensors[name]
        if value.shape != leaf.shape or value.dtype != leaf.dtype:
            raise ValueError(
                f"{name} is {value.dtype}{value.shape}, must be {leaf.dtype}{leaf.shape}"
            )
        # the fused kernel's state is NumPy's, to be written to
        leaves.append(
            cast(jax.Array, value.copy()) if isinstance(leaf, np.ndarray) else jnp.array(value)
        )
    return cast(LearnerState, jax.tree.unflatten(cast(Any, jax.tree.structure(like)), leaves))


def _named_leaves(state: LearnerState) -> dict[str, jax.Array]:
    leaves = cast(list[tuple[Any, jax.Array]], jax.tree.leaves_with_path(state))
    return {jax.tree_util.keystr(path).lstrip("."): leaf for path, leaf in leaves}


def losses_of(td_error: Float[jax.Array, " B"], kind: str) -> Float[jax.Array, " B"]:
    """δ² (`mse`), or Huber's loss with its knee at 1 (`huber`), of each transition."""
    return jnp.square(td_error) if kind == "mse" else optax.huber_loss(td_error)


def _losses_by_network(network: QNetwork, config: LearningConfig) -> Losses:
    """Losses by what the network's outputs are: values, quantiles or atoms."""

    def by_values(
        online: Params, bootstrap: Params, batch: TransitionBatch, noise: Noise
    ) -> tuple[jax.Array, jax.Array, jax.Array]:
        q_tm1 = network.apply(online, batch.o_tm1, noise.tm1)
        q_t = jax.lax.stop_gradient(network.apply(bootstrap, batch.o_t, noise.t))
        taken = batch.a_tm1, batch.r_t, batch.discount_t
        if config.double:
            q_t_online = jax.lax.stop_gradient(network.apply(online, batch.o_t, noise.selection))
            td_error = td.double_q_error(q_tm1, *taken, q_t_online, q_t)
        elif config.target == "sarsa":
            td_error = td.sarsa_error(q_tm1, *taken, q_t, batch.a_t)
        else:
            td_error = td.q_error(q_tm1, *taken, q_t)
        return losses_of(td_error, config.loss), q_tm1, td_error

    def by_quantiles(
        online: Params, bootstrap: Params, batch: TransitionBatch, noise: Noise
    ) -> tuple[jax.Array, jax.Array, jax.Array]:
        theta_tm1 = network.quantiles(online, batch.o_tm1, noise.tm1)
        theta_t = jax.lax.stop_gradient(network.quantiles(bootstrap, batch.o_t, noise.t))
        taken = td.of_action(theta_tm1, batch.a_tm1)
        best = best_of(theta_t, theta_t.mean(axis=-1), online, batch, noise)
        target = batch.r_t[:, None] + batch.discount_t[:, None] * best
        td_error = target.mean(axis=-1) - taken.mean(axis=-1)
        return td.quantile_loss(taken, target), theta_tm1.mean(axis=-1), td_error

    def by_atoms(
        online: Params, bootstrap: Params, batch: TransitionBatch, noise: Noise
    ) -> tuple[jax.Array, jax.Array, jax.Array]:
        z = network.support
        log_p_tm1 = network.log_probabilities(online, batch.o_tm1, noise.tm1)
        log_p_t = network.log_probabilities(bootstrap, batch.o_t, noise.t)
        p_t = jax.lax.stop_gradient(jnp.exp(log_p_t))
        taken = td.of_action(log_p_tm1, batch.a_tm1)
        best = best_of(p_t, p_t @ z, online, batch, noise)
        target = td.categorical_projection(z, best, batch.r_t, batch.discount_t)
        td_error = target @ z - jnp.exp(taken) @ z
        return td.categorical_loss(taken, target), jnp.exp(log_p_tm1) @ z, td_error

    def best_of(
        outputs: Float[jax.Array, "B A Z"],
        q_t: Float[jax.Array, "B A"],
        online: Params,
        batch: TransitionBatch,
        noise: Noise,
    ) -> Float[jax.Array, "B Z"]:
        """What the bootstrapping network gives the next action; `double` lets the online select."""
        if config.target == "sarsa":
            return td.of_action(outputs, batch.a_t)
        if config.double:
            q_t = network.apply(online, batch.o_t, noise.selection)
        return td.of_action(outputs, jax.lax.stop_gradient(q_t).argmax(axis=-1))

    if network.config.atoms:
        return by_atoms
    return by_quantiles if network.config.quantiles else by_values


def make_update(network: QNetwork, config: LearningConfig) -> Update:
    """A pure update of one minibatch, to be compiled by the caller.

    Its argument `measured` is part of what is compiled: metrics that nobody writes down would cost
    a twentieth of the update.
    """
    optimizer = make_optimizer(config)
    losses_and_q = _losses_by_network(network, config)

    def loss_and_q(
        online: Params,
        bootstrap: Params,
        batch: TransitionBatch,
        weights: Weights | None,
        noise: Noise,
    ) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        scaled = batch._replace(r_t=batch.r_t * config.reward_scale)
        losses, q_tm1, td_error = losses_and_q(online, bootstrap, scaled, noise)
        loss = jnp.mean(losses if weights is None else weights * losses)
        return loss, (q_tm1, td_error)

    def update(
        state: LearnerState,
        words: Batch,
        weights: Weights | None,
        measured: bool,
        noise: PRNGKeyArray | None = None,
    ) -> Updated:
        batch = unpack_transitions(words, network.observation_size)
        online = state.online_params
        bootstrap = online if state.target_params is None else state.target_params
        gradient_of = jax.value_and_grad(loss_and_q, has_aux=True)
        keys = Noise(*((None,) * 3 if noise is None else jax.random.split(noise, 3)))
        (loss, (q_tm1, td_error)), gradient = gradient_of(online, bootstrap, batch, weights, keys)
        step, opt_state = optimizer.update(gradient, state.opt_state, online)
        new_state = state._replace(
            online_params=optax.apply_updates(online, step),
            opt_state=opt_state,
        )
        if config.polyak:
            new_state = follow(new_state, config.polyak)
        if not measured:
            return Updated(new_state, None, td_error)
        metrics = Metrics(loss, q_tm1.mean(), q_tm1.max(), jnp.linalg.norm(gradient))
        return Updated(new_state, metrics, td_error)

    return update


def make_fit(
    network: QNetwork, config: LearningConfig
) -> Callable[
    [LearnerState, Float[jax.Array, "B D"], Int[jax.Array, " B"], Float[jax.Array, " B"]],
    tuple[LearnerState, Metrics],
]:
    """A pure update of Q(s,a) towards targets that are given, to be compiled by the caller."""
    optimizer = make_optimizer(config)

    def loss_and_q(
        online: Params,
        o_tm1: Float[jax.Array, "B D"],
        a_tm1: Int[jax.Array, " B"],
        target: Float[jax.Array, " B"],
    ) -> tuple[jax.Array, jax.Array]:
        q_tm1 = network.apply(online, o_tm1)
        td_error = target - td.of_action(q_tm1, a_tm1)
        return jnp.mean(losses_of(td_error, config.loss)), q_tm1

    def fit(
        state: LearnerState,
        o_tm1: Float[jax.Array, "B D"],
        a_tm1: Int[jax.Array, " B"],
        target: Float[jax.Array, " B"],
    ) -> tuple[LearnerState, Metrics]:
        online = state.online_params
        gradient_of = jax.value_and_grad(loss_and_q, has_aux=True)
        (loss, q_tm1), gradient = gradient_of(online, o_tm1, a_tm1, target)
        step, opt_state = optimizer.update(gradient, state.opt_state, online)
        metrics = Metrics(loss, q_tm1.mean(), q_tm1.max(), jnp.linalg.norm(gradient))
        online = optax.apply_updates(online, step)
        return state._replace(online_params=online, opt_state=opt_state), metrics

    return fit
