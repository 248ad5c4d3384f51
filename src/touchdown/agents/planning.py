"""Planning with a known model of the environment: value iteration, one sweep at a time.

Shapes: S states, A actions.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from touchdown.config.config import Config
from touchdown.core.errors import UserError, one_line
from touchdown.core.types import FloatArray, Spaces

Transitions = Mapping[int, Mapping[int, Sequence[tuple[float, int, float, bool]]]]
"""The outcomes of each state and action: (probability, next state, reward, terminated)."""


class TransitionModel(NamedTuple):
    """An environment whose rewards and transition probabilities are known."""

    reward: FloatArray
    """Expected reward, [S, A]."""
    continues: FloatArray
    """Probability that the next state follows and the episode does not terminate, [S, A, S].

    A row sums to 1 less the probability of termination, so that only termination stops
    bootstrapping, and the values of terminal states are never used.
    """


def read_model(transitions: Transitions) -> TransitionModel:
    """The model in the table of a Gymnasium toy-text environment, `env.unwrapped.P`.

    Raises:
        ValueError: states or actions are not numbered from 0, or probabilities do not sum to 1.
    """
    num_states = len(transitions)
    if num_states == 0 or sorted(transitions) != list(range(num_states)):
        raise ValueError(f"states must be numbered from 0 without gaps, got {num_states} states")
    num_actions = len(transitions[0])
    reward = np.zeros((num_states, num_actions))
    continues = np.zeros((num_states, num_actions, num_states))
    for state, actions in transitions.items():
        if num_actions == 0 or sorted(actions) != list(range(num_actions)):
            raise ValueError(f"state {state}: actions must be 0 to A - 1, got {list(actions)}")
        for action, outcomes in actions.items():
            total = 0.0
            for probability, next_state, r_t, terminated in outcomes:
                if probability < 0 or not 0 <= next_state < num_states:
                    raise ValueError(f"state {state}, action {action}: {probability}, {next_state}")
                total += probability
                reward[state, action] += probability * r_t
                # added up, because at a wall of the slippery lake two slips lead to the same state
                continues[state, action, next_state] += probability * (not terminated)
            if not np.isclose(total, 1.0):
                raise ValueError(f"state {state}, action {action}: probabilities sum to {total}")
    return TransitionModel(reward, continues)


def sweep(q: FloatArray, model: TransitionModel, gamma: float) -> FloatArray:
    """Q′(s,a) = r(s,a) + γ·Σ p(s′|s,a)·maxₐ′ Q(s′,a′)   (Bellman, 1957; the paper's Eq. 1).

    Args:
        q: Q(s,a): [S, A].
        model: the environment's model.
        gamma: γ.

    Returns:
        Q′, all states and actions backed up at once: [S, A].
    """
    return model.reward + gamma * (model.continues @ q.max(axis=1))


def value_iteration(
    model: TransitionModel, gamma: float, tolerance: float = 1e-10, max_sweeps: int = 100_000
) -> FloatArray:
    """Q*, the fixed point of `sweep`, starting from Q = 0   (Bellman, 1957).

    Args:
        model: the environment's model.
        gamma: γ, from 0 to 1; at 1 there is a fixed point only if every optimal path terminates.
        tolerance: largest change in the last sweep; Q* is within γ / (1 − γ) times it.
        max_sweeps: largest number of sweeps.

    Returns:
        Q*: [S, A].

    Raises:
        ValueError: γ is not in [0, 1], or the sweeps did not converge.
    """
    if not 0 <= gamma <= 1:
        raise ValueError(f"gamma must be in [0, 1], got {gamma}")
    q = np.zeros_like(model.reward)
    for _ in range(max_sweeps):
        before, q = q, sweep(q, model, gamma)
        if np.abs(q - before).max() <= tolerance:
            return q
    raise ValueError(f"no fixed point within {max_sweeps} sweeps at gamma {gamma}")


def plan_of(config: Config, spaces: Spaces) -> TransitionModel | None:
    """The environment's model for value iteration; None for an algorithm that learns from steps.

    Raises:
        UserError: the config selects value iteration and the model is not known.
    """
    if config.algorithm != "value-iteration":
        return None
    if spaces.transitions is None:
        raise UserError(
            f"env_id {config.env_id!r}: its model is not known; value iteration needs "
            "an environment with a model, such as FrozenLake-v1, CliffWalking-v1 or Taxi-v4"
        )
    try:
        return read_model(spaces.transitions)
    except ValueError as error:
        raise UserError(
            f"env_id {config.env_id!r}: its model cannot be read: {one_line(error)}"
        ) from None
