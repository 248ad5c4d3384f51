"""A run's learning curve, the last file that a run writes."""

from touchdown import files
from touchdown.figures import curve
from touchdown.runs import evaluation as evaluations
from touchdown.runs import pilots
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
        files.read_jsonl(run.folder.episodes),
        files.read_jsonl(run.folder.validations),
        int(pilots.facts_of(run.folder.best)["observations"]),
        title,
        threshold=evaluations.threshold_of(run.config.env_id),
    )
