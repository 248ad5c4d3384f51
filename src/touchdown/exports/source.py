"""The policy to export: the best of a run, or one shipped with touchdown."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.core import limits, reading
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import recorder
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.policies import weights as policy_weights
from touchdown.render import film as films
from touchdown.runs import provenance
from touchdown.runs import run as runs
from touchdown.runs.provenance import Provenance
from touchdown.runs.run import GIF, Run

_LICENCE = "mit"  # of what comes with touchdown, as its own
_FPS, _SCALE = 12, 0.6  # a card's film is small


@dataclass(frozen=True, slots=True)
class Source:
    """A policy with the facts for its card."""

    name: str
    weights: Path
    """A file written by `policies.weights.save_weights`."""
    config: Config
    made: Provenance
    """Versions and commit that it was trained with, as far as known."""
    evaluate: Callable[[], Evaluation | None]
    """Returns its test flights; None if it has none."""
    film: Callable[[], bytes | None]
    """Returns a GIF of a test flight; None if it has none."""
    resume: str = ""
    """Command that finishes the run that it comes from; "" if it is finished."""
    licence: str = ""
    """Identifier of the weights' licence; "" if their owner has not chosen one."""


def of_run(run: Run) -> Source:
    """The best policy of a run, with the run's test flights.

    Raises:
        UserError: the run has no weights yet, or broken files.
    """
    weights = runs.best_weights(run.folder)
    made = provenance.read_provenance(run.folder.provenance)
    trust = ["--trust"] if run.config.own_code else []
    resume = "" if run.status == "finished" else run.folder.resume_command(*trust)
    return Source(
        run.name,
        weights,
        run.config,
        made,
        evaluate=lambda: run.evaluation,
        film=lambda: _film_of(run),
        resume=resume,
    )


def of_shipped(weights: Path, on_episode: Callable[[], object] = lambda: None) -> Source:
    """A shipped policy, with the config of its preset; it is tested on demand.

    Args:
        weights: its file.
        on_episode: called after each test episode.

    Raises:
        UserError: the file is broken.
    """
    preset, seed = policy_weights.origin_of(weights)
    config = replace(presets.preset(preset), seed=seed)
    starts = TEST_STARTS[: config.training.test_episodes]

    def evaluate() -> Evaluation:
        policy = policy_weights.load_weights(weights)
        return evaluations.evaluate_policy(policy, starts, on_episode=on_episode)

    def film() -> bytes:
        named = policy_weights.load_weights(weights)
        flight = recorder.record_flight(named.policy, named.env_id, starts[0], named.name)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / GIF
            films.write_gif(flight, path, _FPS, _SCALE)
            return path.read_bytes()

    return Source(weights.stem, weights, config, Provenance(), evaluate, film, licence=_LICENCE)


def _film_of(run: Run) -> bytes | None:
    path = run.path / GIF
    return reading.read_bytes(path, limits.PICTURE_BYTES) if path.is_file() else None
