"""Saves the policy at each validation, and thins them out."""

from collections.abc import Iterable, Sequence

from touchdown.agents.agent import Agent
from touchdown.config.config import Config
from touchdown.core import files
from touchdown.core.types import Tensors
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.weights import save_weights
from touchdown.runs.folder import RunFolder
from touchdown.runs.over_training import path_at, policies_over_training

MOST_POLICIES = 100
"""Policies that a run keeps at most."""


class PolicySaver:
    """The policies of one run, from before training to the latest validation.

    What is kept depends on the validations alone, so that a resumed run ends with the same files.

    Args:
        folder: the run's folder.
        config: the run's config.
        validated: environment steps at each validation so far, in increasing order. Files of later
            ones are deleted, because training writes them again.

    Raises:
        UserError: the folder of the policies cannot be read, or is a symbolic link.
    """

    def __init__(self, folder: RunFolder, config: Config, validated: Iterable[int]) -> None:
        self._folder = folder
        self._config = config
        self._at = [0, *validated]
        self._thin_out()

    def save(
        self, agent: Agent, weights: Tensors, env_steps: int, validation_return: float | None = None
    ) -> None:
        """Save the policy of these weights.

        Args:
            agent: the agent in training.
            weights: the policy's, by name.
            env_steps: environment steps of training so far; 0 before training.
            validation_return: mean return of the validation; None before training.

        Raises:
            OSError: the file cannot be written.
        """
        facts = WeightsFacts(env_steps=env_steps, validation_return=validation_return)
        files.make_folder(self._folder.over_training)
        path = path_at(self._folder, env_steps)
        save_weights(path, weights, agent.policy(weights), facts, self._config)
        if env_steps > self._at[-1]:
            self._at.append(env_steps)
            self._thin_out()

    def _thin_out(self) -> None:
        wanted = kept(self._at)
        for policy in policies_over_training(self._folder):
            if policy.env_steps not in wanted:
                policy.path.unlink()


def kept(env_steps: Sequence[int]) -> set[int]:
    """Which policies to keep: all, or every second, fourth, eighth, ... and the last.

    Args:
        env_steps: environment steps at each policy, in increasing order.
    """
    stride = 1
    while len(env_steps[::stride]) >= MOST_POLICIES:
        stride *= 2
    return {*env_steps[::stride], env_steps[-1]}
