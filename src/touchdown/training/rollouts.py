"""Greedy rollouts in C++: many steps of a fused network and landers in one call.

The slow twin is the loop in `evaluation.evaluator`: both give the same bytes.
"""

from typing import TYPE_CHECKING

import numpy as np

from touchdown.agents.greedy import GreedyPolicy
from touchdown.agents.learners.fused_network import FusedNetwork
from touchdown.core.types import IntArray, Policy, StepResult
from touchdown.envs.episodes import Underway
from touchdown.envs.pool import EnvPool, ExactEnvPool
from touchdown.lander import rules
from touchdown.training.arrays import episode_arrays, pool_arrays

if TYPE_CHECKING:
    from touchdown.training import _train

_MOST_STEPS = 100  # in one call, so that Ctrl-C is seen soon


class CompiledSteps:
    """Steps of landers of the exact engine with the greedy policy of a fused network.

    An `evaluation.evaluator.Steps`, which leaves other policies and environments to single steps.
    """

    def __init__(self) -> None:
        self._made: tuple[FusedNetwork, ExactEnvPool, _train.Rollout] | None = None

    def __call__(
        self, policy: Policy, pool: EnvPool, underway: Underway, flying: IntArray
    ) -> StepResult | None:
        """Step until an episode ends, or a hundred times; see `Steps`."""
        if not isinstance(policy, GreedyPolicy) or not isinstance(pool, ExactEnvPool):
            return None
        if not isinstance(policy.network, FusedNetwork):
            return None
        tasks = np.full(len(pool.actions), rules.NOTHING, np.uint8)
        tasks[flying] = rules.STEP
        steps = self._rollout(policy.network, pool).advance(
            _MOST_STEPS,
            np.ascontiguousarray(policy.params, np.float32),
            tasks,
            pool_arrays(pool),
            episode_arrays(underway),
        )
        # none if a value is not finite, which a single step will complain about
        return pool.results(flying) if steps else None

    def _rollout(self, network: FusedNetwork, pool: ExactEnvPool) -> "_train.Rollout":
        from touchdown.training import _train  # noqa: PLC0415 - if it was built

        if self._made is None or self._made[0] is not network or self._made[1] is not pool:
            rollout = _train.Rollout(
                pool.batch,
                network.perceptron.network,
                rules.MAX_EPISODE_STEPS,
            )
            self._made = network, pool, rollout
        return self._made[2]
