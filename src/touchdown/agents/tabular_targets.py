"""TD targets for a table, one equation per function.

Shapes: B transitions, A actions. As in `td`, γ is inside `discount_t`, which is 0 where the episode
terminated; a truncated step keeps its discount.
"""

import numpy as np

from touchdown.core.types import FloatArray, IntArray

Values = float | FloatArray
"""A number, or one per transition of a batch."""


def q_learning_target(r_t: Values, discount_t: Values, q_t: FloatArray) -> Values:
    """Y = r + γ·maxₐ Q(s′,a)   (Watkins, 1989).

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the episode terminated; or [B].
        q_t: Q(s′,·): [A], or [B, A].
    """
    return r_t + discount_t * q_t.max(axis=-1)


def sarsa_target(r_t: Values, discount_t: Values, q_t: FloatArray, a_t: int | IntArray) -> Values:
    """Y = r + γ·Q(s′,a′), a′ the action taken next   (Rummery & Niranjan, 1994).

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the episode terminated; or [B].
        q_t: Q(s′,·): [A], or [B, A].
        a_t: a′, or [B]; any action where the episode terminated.
    """
    column = np.expand_dims(a_t, -1)
    return r_t + discount_t * np.take_along_axis(q_t, column, axis=-1)[..., 0]


def expected_sarsa_target(
    r_t: Values, discount_t: Values, q_t: FloatArray, epsilon: Values
) -> Values:
    """Y = r + γ·Σₐ π(a|s′)·Q(s′,a), π ε-greedy   (van Seijen et al., 2009).

    Random actions are drawn from all A, including the greedy one, so π = ε / A, plus 1 − ε for the
    greedy action. Which of several best actions counts as greedy does not change this sum.

    Args:
        r_t: reward, or [B].
        discount_t: γ, or 0 where the episode terminated; or [B].
        q_t: Q(s′,·): [A], or [B, A].
        epsilon: ε, or [B].
    """
    expected = (1 - epsilon) * q_t.max(axis=-1) + epsilon * q_t.mean(axis=-1)
    return r_t + discount_t * expected
