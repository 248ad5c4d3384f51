"""Q as a table: value iteration on a known model, TD targets for learning without one.

Shapes: S states, A actions, B transitions, N observations of D numbers. As in `td`, γ is inside
`discount_t`, which is 0 where the world ended; a truncated step keeps its discount.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, prod
from typing import NamedTuple, Protocol

import numpy as np

from touchdown.core.types import FloatArray, IntArray

Transitions = Mapping[int, Mapping[int, Sequence[tuple[float, int, float, bool]]]]
"""What may follow a state and an action: (probability, next state, reward, terminated)."""

Values = float | FloatArray
"""One number, or one for each transition of a batch."""


class Model(NamedTuple):
    """A world whose probabilities are known."""

    reward: FloatArray
    """Expected reward: [S, A]."""
    continues: FloatArray
    """Probability that the next state follows and the world has not ended: [S, A, S].

    A row that sums to less than 1 ends the world with the rest, so that only termination stops
    bootstrapping and a terminal state's own row is never read.
    """


def read_model(transitions: Transitions) -> Model:
    """The model in a Gymnasium toy text world's table, `env.unwrapped.P`.

    Raises:
        ValueError: states or actions are not numbered from 0, or probabilities do not sum to 1.
    """
    num_states = len(transitions)
    if num_states == 0 or sorted(transitions) != list(range(num_states)):
        raise ValueError(f"states must be numbered from 0 without gaps, got {num_states} of them")
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
                # summed: at a wall of the slippery lake two slips lead to the same state
                continues[state, action, next_state] += probability * (not terminated)
            if not np.isclose(total, 1.0):
                raise ValueError(f"state {state}, action {action}: probabilities sum to {total}")
    return Model(reward, continues)


def sweep(q: FloatArray, model: Model, gamma: float) -> FloatArray:
    """Q′(s,a) = r(s,a) + γ·Σ p(s′|s,a)·maxₐ′ Q(s′,a′)   (Bellman, 1957; the paper's Eq. 1).

    Args:
        q: Q(s,a): [S, A].
        model: of the world.
        gamma: γ.

    Returns:
        Q′, all states and actions backed up at once: [S, A].
    """
    return model.reward + gamma * (model.continues @ q.max(axis=1))


def value_iteration(
    model: Model, gamma: float, tolerance: float = 1e-10, max_sweeps: int = 100_000
) -> FloatArray:
    """Q*, the fixed point of `sweep`, from Q = 0   (Bellman, 1957).

    Args:
        model: of the world.
        gamma: γ; 1 has a fixed point only where every best path ends.
        tolerance: largest change of the last sweep; Q* is within γ / (1 − γ) times it.
        max_sweeps: sweeps after which it gives up.

    Returns:
        Q*: [S, A].

    Raises:
        ValueError: γ is not in [0, 1], or the sweeps did not settle.
    """
    if not 0 <= gamma <= 1:
        raise ValueError(f"gamma must be in [0, 1], got {gamma}")
    q = np.zeros_like(model.reward)
    for _ in range(max_sweeps):
        before, q = q, sweep(q, model, gamma)
        if np.abs(q - before).max() <= tolerance:
            return q
    raise ValueError(f"no fixed point within {max_sweeps} sweeps at gamma {gamma}")


def q_learning_target(r_t: Values, discount_t: Values, q_t: FloatArray) -> Values:
    """Y = r + γ·maxₐ Q(s′,a)   (Watkins, 1989).

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the world ended; or [B].
        q_t: Q(s′,·): [A], or [B, A].
    """
    return r_t + discount_t * q_t.max(axis=-1)


def sarsa_target(r_t: Values, discount_t: Values, q_t: FloatArray, a_t: int | IntArray) -> Values:
    """Y = r + γ·Q(s′,a′), a′ the action that is taken next   (Rummery & Niranjan, 1994).

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the world ended; or [B].
        q_t: Q(s′,·): [A], or [B, A].
        a_t: a′, or [B]; any action where the world ended.
    """
    column = np.expand_dims(a_t, -1)
    return r_t + discount_t * np.take_along_axis(q_t, column, axis=-1)[..., 0]


def expected_sarsa_target(
    r_t: Values, discount_t: Values, q_t: FloatArray, epsilon: Values
) -> Values:
    """Y = r + γ·Σₐ π(a|s′)·Q(s′,a), π ε-greedy   (van Seijen et al., 2009).

    A random action is drawn from all A, the greedy one among them: π = ε / A, and 1 − ε more for
    the greedy action, the first of the best as argmax takes it. (Which of them it is changes π but
    not this sum: they are worth the same.)

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the world ended; or [B].
        q_t: Q(s′,·): [A], or [B, A].
        epsilon: ε, or [B].
    """
    expected = (1 - epsilon) * q_t.max(axis=-1) + epsilon * q_t.mean(axis=-1)
    return r_t + discount_t * expected


class States(Protocol):
    """Whatever numbers the states that observations show, so that a table has a row for each."""

    @property
    def num_states(self) -> int:
        """S, rows of the table."""
        ...

    def states(self, observations: FloatArray) -> IntArray:
        """The state of each observation, from 0 to S − 1: [N, D] to [N]."""
        ...


@dataclass(frozen=True, slots=True)
class OneHot:
    """States of a Discrete world, which Gymnasium flattens to a 1 among zeros.

    Raises:
        ValueError: there is no state.
    """

    num_states: int

    def __post_init__(self) -> None:
        if self.num_states < 1:
            raise ValueError(f"need 1 state or more, got {self.num_states}")

    def states(self, observations: FloatArray) -> IntArray:
        """Where the 1 is: [N, S] to [N].

        Raises:
            ValueError: an observation is not one-hot, or not of S numbers.
        """
        observations = _rows(observations, self.num_states)
        states = observations.argmax(axis=1)
        ones = observations[np.arange(len(states)), states] == 1
        if not (ones.all() and np.count_nonzero(observations) == len(states)):
            raise ValueError("observations must be one-hot: a single 1 among zeros")
        return states


@dataclass(frozen=True, slots=True)
class Grid:
    """States of a Box world: uniform bins between `low` and `high` in each dimension.

    The last dimension varies fastest. What lies outside goes to the bins at the ends.

    Raises:
        ValueError: lengths differ, there is no bin, or a `low` is not below its `high`.
    """

    bins: tuple[int, ...]  # in each dimension
    low: tuple[float, ...]  # in the observation's units
    high: tuple[float, ...]  # in the observation's units

    def __post_init__(self) -> None:
        if not len(self.bins) == len(self.low) == len(self.high) > 0:
            raise ValueError(f"bins, low and high must be of one length, 1 or more, got {self}")
        if min(self.bins) < 1:
            raise ValueError(f"need 1 bin or more in each dimension, got {self.bins}")
        for low, high in zip(self.low, self.high, strict=True):
            if not (low < high and isfinite(high - low)):
                raise ValueError(f"need a finite low below a finite high, got {low} and {high}")

    @property
    def num_states(self) -> int:
        """S, cells of the grid."""
        return prod(self.bins)

    def states(self, observations: FloatArray) -> IntArray:
        """The cell that each observation lies in: [N, D] to [N].

        Raises:
            ValueError: an observation is not of D numbers, or has one that is not a number.
        """
        observations = _rows(observations, len(self.bins))
        if np.isnan(observations).any():
            raise ValueError("observations must be numbers, got NaN")
        low, high, bins = np.array(self.low), np.array(self.high), np.array(self.bins)
        # clipped before it is scaled, so that infinity is an end and nothing overflows
        share = (np.clip(observations, low, high) - low) / (high - low)
        cells = np.minimum((share * bins).astype(np.intp), bins - 1)  # `high` is in the last bin
        return np.asarray(np.ravel_multi_index(tuple(cells.T), self.bins))


def _rows(observations: FloatArray, size: int) -> FloatArray:
    """Observations, once they are seen to be [N, `size`]."""
    if observations.ndim != 2 or observations.shape[1] != size:
        raise ValueError(f"observations must be [N, {size}], got {list(observations.shape)}")
    return observations
