"""Tunes hyper-parameters with Optuna, and writes the best ones to a file."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from touchdown.config import presets, toml
from touchdown.core import files, installation
from touchdown.core.errors import Interrupted, UserError
from touchdown.core.progress import Counter, console_for, stop_on_signals
from touchdown.studies import space as spaces
from touchdown.studies import store as stores
from touchdown.studies.executors import Executor, LocalExecutor
from touchdown.studies.store import DEFAULT_RESULTS


@dataclass(frozen=True, slots=True)
class TunedAgent:
    """The result of a search, and its files."""

    value: float
    trials: int
    pruned: int
    changed: Mapping[str, Any]
    files: tuple[Path, ...]

    def __str__(self) -> str:
        """A sentence with the result."""
        settings = ", ".join(
            f"{name.split('.')[-1]} {_text_of(value)}" for name, value in self.changed.items()
        )
        return (
            f"best of {self.trials} trials ({self.pruned} pruned): validation return "
            f"{self.value:.1f} with {settings}"
        )


def _text_of(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def tune_agent(
    preset: str,
    *,
    trials: int = 30,
    seeds: int = 3,
    env_steps: int | None = None,
    seed: int = 0,
    space: Path | str | None = None,
    storage: str | None = None,
    out: Path | str | None = None,
    force: bool = False,
    executor: Executor | None = None,
    results_dir: Path | str = DEFAULT_RESULTS,
    progress: bool | None = None,
    console: Console | None = None,
) -> TunedAgent:
    """Tune a preset's hyper-parameters with Optuna; the same call resumes a stopped search.

    A trial trains with several seeds that no study reports; its value is their mean return on
    validation starts. A trial below the median after some of its seeds is pruned.

    Args:
        preset: preset to start from.
        trials: total number of trials, including earlier ones.
        seeds: training seeds per trial.
        env_steps: environment steps per run; None uses the preset's limit.
        seed: seed of the sampler.
        space: TOML file of the settings to search, with a list of values or a range for each; None
            uses a built-in choice. A setting with a single value has it in all trials.
        storage: Optuna storage, such as `postgresql://…` for many machines; None uses SQLite in the
            results folder.
        out: TOML file for the best settings, with a plot of their importance in the same
            folder; None writes neither.
        force: whether to replace existing files.
        executor: runs a trial's seeds; None uses worker processes on this machine.
        results_dir: folder that holds the trials' runs.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Raises:
        UserError: a number is out of range, the space is broken, Optuna is not installed, the
            storage cannot be reached, `out` exists already, or nothing can be written.
        Interrupted: Ctrl-C, SIGTERM or SIGHUP; finished trials are kept.
    """
    for name, value in (("trials", trials), ("seeds", seeds), ("env_steps", env_steps)):
        if value is not None and value < 1:
            raise UserError(f"{name} = {value}: must be at least 1")
    base = presets.preset(preset)
    try:
        from touchdown.studies import search  # noqa: PLC0415 - an extra
    except ImportError:
        raise installation.missing("tune agent", "Optuna", "optuna") from None
    if env_steps is not None:
        training = dataclasses.replace(base.training, max_env_steps=env_steps, episodes=1_000_000)
        base = dataclasses.replace(base, training=training)
    if space is None:
        searched = spaces.space_of(base)
    else:
        base, searched = spaces.read_space(Path(space), base)
    if out is not None:
        files.check_file(Path(out), "out")
        files.check_new(Path(out), force=force)
    store = stores.open_store(Path(results_dir), make=True)
    url = search.storage_url(store) if storage is None else storage
    name = f"{preset}-{base.digest}-{seeds}"
    if space is not None:
        name += f"-{spaces.digest_of(searched)}"
    shown = console_for(progress, console)
    try:
        with (
            stores.held(store),
            search.storage_errors(url),
            Counter(shown, f"searching {preset}", trials) as count,
            stop_on_signals(shown) as stop,
        ):

            def on_trial(number: int, best: float | None) -> None:
                best_text = "" if best is None else f", best {best:.1f}"
                count.describe(f"tuning {preset}{best_text}", number)

            found = search.search(
                search.open_study(url, name, seed),
                base,
                searched,
                store,
                executor or LocalExecutor(),
                trials=trials,
                seeds=seeds,
                alone=storage is None,
                on_trial=on_trial,
                should_stop=stop,
            )
    except Interrupted:
        raise Interrupted(
            "stopped; finished trials are kept, and the same command resumes the search"
        ) from None
    written: list[Path] = []
    if out is not None:
        path = Path(out)
        text = search.comment_of(found, preset, seeds) + toml.to_toml(found.best)
        with files.refusing(f"out {str(out)!r}"):
            files.write_atomic(path, text)
        written.append(path)
        if found.importance:
            from touchdown.figures import importance  # noqa: PLC0415 - it loads matplotlib

            plot = search.path_beside(path, "-importance.png")
            importance.save_importance(plot, found.importance)
            written.append(plot)
    return TunedAgent(found.value, found.trials, found.pruned, found.changed, tuple(written))
