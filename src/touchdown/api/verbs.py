"""What the verbs of the command line do, as functions for a notebook."""

from dataclasses import replace
from importlib import resources
from pathlib import Path

from rich.console import Console

from touchdown.agents.registry import check_fits
from touchdown.api.pipeline import complete
from touchdown.api.policies import PolicyLike, find_policy, shipped
from touchdown.config.config import Config
from touchdown.config.presets import preset
from touchdown.control.pid import PIDConfig, Rule
from touchdown.core import device, files, progress
from touchdown.core.errors import UserError
from touchdown.core.seeding import TEST_STARTS
from touchdown.envs import environment
from touchdown.envs import flight as flights
from touchdown.envs.flight import Flight
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.exports import source as sources
from touchdown.exports.export import Export, Format, write_export
from touchdown.lander import engine as engines
from touchdown.policies import baselines
from touchdown.render import film as films
from touchdown.runs import folder as folders
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run
from touchdown.training import pid_tuning
from touchdown.training.selection import stop_threshold


def train(
    config: Config | str = "pilot",
    *,
    name: str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    seed: int | None = None,
    console: Console | None = None,
) -> Run:
    """Train an agent, choose its best checkpoint, test it and draw its pictures.

    Args:
        config: settings, or a preset's name.
        name: of the run; `<preset>-<seed>` if None, with a number behind it if that is taken.
        runs_dir: where runs are kept.
        seed: training seed, if another than the config's.
        console: where to show progress and results; quiet if None.

    Returns:
        The finished run.

    Raises:
        UserError: the config, the name, the folder or the world cannot be used, or something
            could not be written, such as on a full disk; `resume` goes on with what was saved.
        Interrupted: Ctrl-C or SIGTERM; the run was saved and `resume` goes on with it.
    """
    settings = preset(config) if isinstance(config, str) else config
    if seed is not None:
        settings = replace(settings, seed=seed)
    # refuse a world, and settings that do not fit it, before a folder is made
    spaces = environment.spaces_of(settings.env_id, engine=engines.engine_in_use())
    check_fits(settings, spaces)
    stop_threshold(settings)
    return complete(folders.create(Path(runs_dir), settings, name), console)


def resume(run: str, *, runs_dir: Path | str = DEFAULT_RUNS, console: Console | None = None) -> Run:
    """Go on with a run that was stopped, from its last checkpoint to its end.

    Raises:
        UserError: there is no such run, its files are broken, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    return complete(folders.find(run, Path(runs_dir)), console)


def evaluate(
    policy: PolicyLike,
    *,
    episodes: int = 100,
    seed: int = TEST_STARTS.start,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
    console: Console | None = None,
) -> Evaluation:
    """Fly a policy greedily on stock Gymnasium and count.

    Args:
        policy: a run, its name, or another policy; see `PilotLike`.
        episodes: starts to fly.
        seed: environment seed of the first start; the others follow it one by one. Seeds below
            1,000,000 are test starts.
        env_id: the world for `random`, a `.zip`, and an `.onnx` that names none; the others know
            theirs.
        runs_dir: where runs are kept.
        console: where to show progress; quiet if None.

    Raises:
        UserError: there is no such policy, or a number is out of range.
    """
    if episodes < 1:
        raise UserError(f"episodes = {episodes}: must be at least 1")
    _check_seed(seed, episodes)
    named = find_policy(policy, Path(runs_dir), env_id)
    shown = console or Console(quiet=True)
    with progress.counting(shown, f"flying {named.name}", episodes) as count:
        return evaluations.evaluate_policy(named, range(seed, seed + episodes), on_episode=count)


def fly(
    policy: PolicyLike,
    *,
    seed: int = TEST_STARTS.start,
    out: Path | str | None = None,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
) -> Flight:
    """Fly one episode and, if wanted, film it.

    Args:
        policy: a run, its name, or another policy; see `PilotLike`.
        seed: environment seed of the start.
        out: a `.gif` or `.mp4` to write, or `window` to watch it live; None only flies.
        env_id: the world for `random`, a `.zip`, and an `.onnx` that names none; the others know
            theirs.
        runs_dir: where runs are kept.

    Raises:
        UserError: there is no such policy, no screen for a window, or `out` cannot be written.
    """
    _check_seed(seed, 1)
    named = find_policy(policy, Path(runs_dir), env_id)
    if out is not None and str(out) == "window":
        return films.show_window(named.env_id, named.policy, seed, named.name)
    if out is not None:
        films.check_video_path(Path(out))
    flight = flights.record_flight(named.policy, named.env_id, seed, named.name)
    if out is not None:
        films.write_video(flight, Path(out))
    return flight


def tune_pid(
    *,
    rule: Rule = "signed",
    starts: int = 200,
    seed: int = 0,
    tolerance: float = 0.2,
    begin: PIDConfig | Path | str | None = None,
    out: Path | str | None = None,
    console: Console | None = None,
) -> PIDConfig:
    """Tune the PID's gains and dead band by Twiddle on training starts.

    Args:
        rule: the action rule to tune for: `signed` or `absolute`.
        starts: training starts that each trial flies.
        seed: chooses the starts.
        tolerance: relative step at which to stop, between 0 and 1.
        begin: gains to begin from, or a TOML file of them, such as an earlier tuning's; None
            begins from gains picked by hand.
        out: a TOML file to save the gains in; None only gives them back.
        console: where to show progress; quiet if None.

    Raises:
        UserError: a number is out of range, `begin` is broken, or `out` cannot be written.
    """
    if starts < 1:
        raise UserError(f"starts = {starts}: must be at least 1")
    if not 0 < tolerance < 1:
        raise UserError(f"tolerance = {tolerance}: must be between 0 and 1")
    _check_seed(seed, 1)
    if out is not None and not Path(out).absolute().parent.is_dir():
        raise UserError(f"out {str(out)!r}: its folder does not exist")
    if out is not None and (not Path(out).name or Path(out).is_dir()):
        raise UserError(f"out {str(out)!r}: must be a file, such as pid.toml")
    if begin is None:
        first = pid_tuning.HAND_PICKED
    else:
        first = begin if isinstance(begin, PIDConfig) else baselines.read_pid(Path(begin))
    shown = console or Console(quiet=True)
    step = None
    with (
        progress.stop_on_signals(shown) as stop,
        progress.counting(shown, "tuning the PID", 1.0) as count,
    ):
        for step in pid_tuning.tune_pid(rule, starts, seed, tolerance, first):
            done = pid_tuning.share_done(step.step, tolerance)
            count.describe(f"trial {step.trial}, best mean return {step.best_return:.1f}", done)
            if stop():
                break
    if step is None:
        raise UserError("tuning was stopped before its first trial")
    if out is not None:
        with files.refusing(f"{step.best}: found, but out {str(out)!r}"):
            files.write_atomic(Path(out), pid_tuning.to_toml(step, starts, seed, first))
    return step.best


def export(
    run: str | Run,
    format: Format = "onnx",  # noqa: A002 - as the flag
    *,
    out: Path | str | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
) -> Export:
    """Write a policy for others to fly, with a card that says what it is.

    Args:
        run: a run, its name or its folder, or the name of a policy that comes with touchdown. A run
            goes before a policy of the same name, and its own test flights are on its card; a
            policy that comes with touchdown is flown from the test starts for it.
        format: `onnx`, flown by any ONNX runtime and checked against the policy before it is
            written, or `safetensors`, our own.
        out: the folder to make; `<run>-<format>` in the current one if None.
        runs_dir: where runs are kept.

    Raises:
        UserError: there is no such run, it has no weights yet or broken files, the folder is there
            already or cannot be written, something is not installed, or the model does not fly as
            the policy does.
    """
    device.use_default()
    folder = None if out is None else Path(out)
    if not isinstance(run, Run):
        weights = shipped(run, Path(runs_dir))
        if weights is not None:
            with resources.as_file(weights) as path:
                return write_export(sources.of_shipped(path), format, folder)
        run = show(run, runs_dir)
    return write_export(sources.of_run(run), format, folder)


def show(run: str, runs_dir: Path | str = DEFAULT_RUNS) -> Run:
    """The run of that name.

    Raises:
        UserError: there is no such run.
    """
    return Run(folders.find(run, Path(runs_dir)))


def _check_seed(seed: int, count: int) -> None:
    if not 0 <= seed <= 2**31 - count:
        raise UserError(f"seed = {seed}: must be from 0 to {2**31 - count}")
