"""Exports a policy for use outside touchdown."""

from importlib import resources
from pathlib import Path

from rich.console import Console

from touchdown.api.policies import shipped
from touchdown.api.runs import RunLike, find_run
from touchdown.config import presets
from touchdown.core import device, plugins
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for
from touchdown.exports import source as sources
from touchdown.exports.export import Export, Format, write_export
from touchdown.policies import lookup
from touchdown.policies.names import BASELINES
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run


def export(
    run: RunLike,
    format: Format = "onnx",  # noqa: A002 - as the flag
    *,
    out: Path | str | None = None,
    force: bool = False,
    runs_dir: Path | str = DEFAULT_RUNS,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> Export:
    """Export a policy for use outside touchdown, with a model card.

    Args:
        run: a run, its name or its folder, or the name of a policy that comes with touchdown. A run
            takes precedence over a shipped policy of the same name, and its card reports the run's
            own test episodes; a shipped policy is tested for its card.
        format: `onnx`, for any ONNX runtime and checked against the policy before it is written, or
            `safetensors`, touchdown's own format.
        out: folder to create; None uses `<run>-<format>` in the current folder.
        force: whether to replace the files of an earlier export in an existing folder.
        runs_dir: folder of the runs.
        trust: whether to import code that the run names: its environment's module, its agent.
        progress: True shows the progress of a test, False shows nothing; None shows it in a
            notebook and on a terminal.
        console: where to show it; None uses the notebook's output or standard output.

    Raises:
        UserError: there is no such run, it has no weights yet or broken files, the folder exists
            already or cannot be written, a library is not installed, or the model does not act
            like the policy.
    """
    device.use_default()
    folder = None if out is None else Path(out)
    if not isinstance(run, Run):
        if str(run) in BASELINES:
            known = ", ".join(lookup.shipped_names())
            raise UserError(
                f"run {str(run)!r}: is no network, so nothing can be exported; must be a run, "
                f"or a policy that comes with touchdown: {known}"
            )
        weights = shipped(str(run), Path(runs_dir))
        if weights is not None:
            episodes = presets.preset(str(run)).training.test_episodes
            with (
                resources.as_file(weights) as path,
                Counter(console_for(progress, console), f"testing {run}", episodes) as count,
            ):
                source = sources.of_shipped(path, count)
                return write_export(source, format, folder, force=force)
    with plugins.trusting(everything=trust):
        return write_export(sources.of_run(find_run(run, runs_dir)), format, folder, force=force)
