"""A run's learning curve, the last file that a run writes."""

import msgspec

from touchdown.core import records
from touchdown.envs import outcome
from touchdown.figures import curve
from touchdown.policies import weights as policy_weights
from touchdown.runs.rows import EpisodeRow, ValidationRow
from touchdown.runs.run import CURVE, Run


def save(run: Run, title: str) -> None:
    """Draw a run's episodes and validations, and mark the checkpoint that was chosen.

    Args:
        run: trained to its end.
        title: of the figure.

    Raises:
        UserError: the run's files are broken, or the picture cannot be written.
    """
    curve.save_learning_curve(
        run.path / CURVE,
        msgspec.to_builtins(records.decode_jsonl(run.folder.episodes, EpisodeRow)),
        msgspec.to_builtins(records.decode_jsonl(run.folder.validations, ValidationRow)),
        policy_weights.facts_of(run.folder.best).env_steps,
        title,
        threshold=outcome.threshold_of(run.config.env_id),
    )
