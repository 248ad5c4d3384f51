"""Films what a run learned: its saved policies fly one start."""

from pathlib import Path

import numpy as np

from touchdown.api.policies import shipped
from touchdown.api.runs import RunLike, find_run
from touchdown.core import files, plugins
from touchdown.core.errors import UserError
from touchdown.core.seeding import check_seed
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import recorder
from touchdown.envs.flight import Flight
from touchdown.lander.rules import is_lander
from touchdown.policies import lookup
from touchdown.policies.weights import load_weights
from touchdown.render import film as films
from touchdown.render import learning
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.over_training import SavedPolicy


def fly_over_training(
    run: RunLike,
    *,
    seed: int = TEST_STARTS.start,
    out: Path | str | None = None,
    force: bool = False,
    runs_dir: Path | str = DEFAULT_RUNS,
    trust: bool = False,
) -> list[Flight]:
    """Fly one start with policies that a run saved over its training, and film them.

    Up to nine policies fly greedily, from the one before training to the last one. The film of the
    lander shows them side by side, that of another environment one after the other.

    Args:
        run: a run, its name or its folder.
        seed: environment seed of the start.
        out: a `.gif` or `.mp4` file to write; None makes no film.
        force: whether to replace an existing file.
        runs_dir: folder of the runs.
        trust: whether to import code that the run's files name.

    Returns:
        The flights, the earliest policy's first.

    Raises:
        UserError: there is no such run, it saved no policies over its training, or `out` exists
            already or cannot be written.
    """
    check_seed(seed)
    if out is not None:
        films.check_video_path(Path(out))
        files.check_new(Path(out), force=force)
    if isinstance(run, str) and lookup.is_known(run):
        raise UserError(f"policy {run!r}: was not saved over training; must be a run")
    if isinstance(run, str) and shipped(run, Path(runs_dir)) is not None:
        raise UserError(
            f"policy {run!r}: comes without its policies over training; train it: touchdown train "
            f"{run}"
        )
    found = find_run(run, runs_dir)
    saved = _chosen(found.policies_over_training)
    if not saved:
        raise UserError(
            f"run {found.name!r}: saved no policies over its training; runs of studies and of "
            "earlier versions have none, train it anew"
        )
    env_id = found.config.env_id
    with plugins.trusting(everything=trust):
        flights = [
            recorder.record_flight(
                load_weights(policy.path).policy, env_id, seed, _name(policy), drawn=out is not None
            )
            for policy in saved
        ]
    if out is not None:
        write = learning.write_learning if is_lander(env_id) else films.write_video
        write(flights, Path(out))
    return flights


def _chosen(saved: list[SavedPolicy]) -> list[SavedPolicy]:
    """All, or as many as a film shows, evenly from the first to the last."""
    count = min(len(saved), learning.MOST_PANELS)
    places = np.linspace(0, len(saved) - 1, count).round().astype(int)
    return [saved[place] for place in places] if count else []


def _name(policy: SavedPolicy) -> str:
    return f"{policy.env_steps:,} steps" if policy.env_steps else "before training"
