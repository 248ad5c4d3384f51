"""What is exported: a run's policy, or one that comes with touchdown."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.core.seeding import TEST_STARTS
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.policies import weights as policy_weights
from touchdown.runs import provenance
from touchdown.runs import run as runs
from touchdown.runs.provenance import Provenance
from touchdown.runs.run import Run


@dataclass(frozen=True, slots=True)
class Source:
    """A policy with all that its card says."""

    name: str
    weights: Path
    """A file of `save_weights`."""
    config: Config
    made: Provenance
    """Versions and commit that it was trained with, as far as they are known."""
    evaluate: Callable[[], Evaluation | None]
    """Its test episodes; None where it had none."""


def of_run(run: Run) -> Source:
    """A run's best policy, with the run's test episodes.

    Raises:
        UserError: the run has no weights yet, or broken files.
    """
    weights = runs.best_weights(run.folder)
    made = provenance.read_provenance(run.folder.provenance)
    return Source(run.name, weights, run.config, made, lambda: run.evaluation)


def of_shipped(weights: Path) -> Source:
    """A policy that comes with touchdown, evaluated here from its preset's test starts.

    Raises:
        UserError: the file is broken.
    """
    preset, seed = policy_weights.origin_of(weights)
    config = replace(presets.preset(preset), seed=seed)
    starts = TEST_STARTS[: config.training.test_episodes]

    def evaluate() -> Evaluation:
        return evaluations.evaluate_policy(policy_weights.load_weights(weights), starts)

    return Source(weights.stem, weights, config, Provenance(), evaluate)
