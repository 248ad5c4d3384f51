"""What the verbs of the command line do, as functions for a notebook."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from rich.console import Console

from touchdown import device, files, progress, tables
from touchdown.config import Config
from touchdown.control.pid import PIDConfig, Rule
from touchdown.errors import Interrupted, UserError, one_line
from touchdown.figures import curve
from touchdown.figures import flights as flight_figure
from touchdown.lander import env as lander
from touchdown.lander import flight as flights
from touchdown.lander import render
from touchdown.lander.flight import Flight
from touchdown.presets import SECTIONS_OF_THE_PAPER, preset
from touchdown.runs import evaluation as evaluations
from touchdown.runs import folder as folders
from touchdown.runs import pilots, tune
from touchdown.runs.evaluate import Fleet
from touchdown.runs.evaluation import Evaluation
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.runs.pilots import NamedPilot
from touchdown.runs.train import Trainer
from touchdown.seeding import TEST_STARTS

OVERLAID = 6  # starts whose flights are drawn over each other: more hide each other


@dataclass(frozen=True, slots=True)
class Run:
    """A run on disk, finished or not."""

    folder: RunFolder

    @property
    def name(self) -> str:
        """The run's name."""
        return self.folder.name

    @property
    def path(self) -> Path:
        """The run's folder."""
        return self.folder.path

    @property
    def config(self) -> Config:
        """The run's settings."""
        return self.folder.config()

    @property
    def pilot(self) -> NamedPilot:
        """The best pilot found so far."""
        return pilots.load_run(self.folder)

    @property
    def evaluation(self) -> Evaluation | None:
        """The pilot's test flights; None while the run is not finished."""
        return next(iter(evaluations_of(self)), None)

    @property
    def pictures(self) -> list[Path]:
        """The run's pictures and films."""
        found = [self.path / name for name in _PICTURES]
        return [path for path in found if path.is_file()]

    @property
    def status(self) -> Literal["finished", "unfinished"]:
        """Whether the run has come to its end."""
        return "finished" if (self.path / _DONE).is_file() else "unfinished"


PilotLike = str | Path | NamedPilot | Run
"""A run, its name, `pid`, `heuristic`, `random`, or a file of weights or gains."""

_CURVE, _FLIGHTS, _GIF, _MP4 = "learning-curve.png", "flights.png", "landing.gif", "landing.mp4"
_FLIGHT_RECORDS = "flights.safetensors"
_DONE = _CURVE  # the last file that a run writes
_PICTURES = (_CURVE, _FLIGHTS, _GIF, _MP4)


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
    lander.make(settings.env_id).env.close()  # refuse a world before a folder is made for it
    return _complete(folders.create(Path(runs_dir), settings, name), console)


def resume(run: str, *, runs_dir: Path | str = DEFAULT_RUNS, console: Console | None = None) -> Run:
    """Go on with a run that was stopped, from its last checkpoint to its end.

    Raises:
        UserError: there is no such run, its files are broken, or something could not be written.
        Interrupted: stopped again; the run was saved.
    """
    return _complete(folders.find(run, Path(runs_dir)), console)


def _complete(folder: RunFolder, console: Console | None) -> Run:
    """Whatever a run still lacks: training, choice, test, pictures."""
    device.use_default()
    where = folder.path.parent
    place = "" if where == DEFAULT_RUNS else f" --runs-dir {where}"
    go_on = f"go on with: touchdown train --resume {folder.name}{place}"
    try:
        return _completed(folder, console or Console(quiet=True))
    except Interrupted:
        raise Interrupted(f"stopped and saved; {go_on}") from None
    except OSError as error:
        path = error.filename or folder.path
        raise UserError(
            f"{path}: cannot be written: {one_line(error)}; what was saved before is whole; {go_on}"
        ) from None
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "RESOURCE_EXHAUSTED" not in str(error):
            raise  # only JAX's way to say that there is no memory left
        raise UserError(
            f"{folder.path}: out of memory ({one_line(error)[:120]}); "
            "a smaller capacity, batch_size or hidden_sizes would fit"
        ) from None


def _completed(folder: RunFolder, shown: Console) -> Run:
    config = folder.config()
    began = time.monotonic()
    training = config.training
    with (
        progress.TrainingView(shown, folder.name) as view,
        progress.stop_on_signals(shown) as stop,
        # open to the end: it holds the right to write to the run
        closing(
            Trainer(
                folder,
                should_stop=stop,
                on_status=view.status,
                on_phase=view.phase,
                on_flight=view.advance,
            )
        ) as trainer,
    ):

        def advance() -> None:
            view.advance()
            stop.check()

        trainer.run()
        trained = time.monotonic()
        run = Run(folder)
        tested = _test(run, view.phase, advance) if training.test_episodes else []
        view.phase("drawing", len(_PICTURES) if tested else 1)
        _draw(run, tested, advance)
    seconds = f"trained in {progress.clock(trained - began)}"
    total = progress.clock(time.monotonic() - began)
    shown.print(f"{folder.name}: {seconds}, {total} in all", markup=False)
    if tested:
        note = SECTIONS_OF_THE_PAPER.get(config.preset)
        shown.print(
            tables.evaluation_table(
                tested,
                paper=evaluations.is_lander(tested[0]),
                note=f"{folder.name} is of the preset {config.preset}: {note}." if note else "",
            )
        )
    for path in run.pictures:
        shown.print(f"  {path}", soft_wrap=True, markup=False)
    return run


def _test(
    run: Run, on_phase: Callable[[str, int], object], on_episode: Callable[[], object]
) -> list[Evaluation]:
    """Fly the chosen checkpoint and the baselines from the test starts, once."""
    already = evaluations_of(run)
    if already:
        return already
    pilot = run.pilot
    names = ("pid", "heuristic", "random") if lander.is_lander(pilot.env_id) else ("random",)
    flown = [pilot, *(pilots.load(name, env_id=pilot.env_id) for name in names)]
    starts = TEST_STARTS[: run.config.training.test_episodes]
    on_phase(f"flying {len(starts)} test starts with {len(flown)} pilots", len(flown) * len(starts))
    fleet = Fleet(pilot.env_id)
    try:
        results = [
            evaluations.evaluate_pilot(each, starts, fleet=fleet, on_episode=on_episode)
            for each in flown
        ]
    finally:
        fleet.close()
    evaluations.write_evaluations(run.folder.evaluation, results, pilots.facts_of(run.folder.best))
    return results


def _draw(run: Run, tested: Sequence[Evaluation], on_picture: Callable[[], object]) -> None:
    """The learning curve, the overlaid flights and the film of the test flight in the middle."""
    if tested:
        pilot = run.pilot
        own = tested[0]
        shown = flights.record_flight(
            pilot.pilot, pilot.env_id, evaluations.median_start(own), pilot.name
        )
        recorded = [shown]
        if lander.is_lander(pilot.env_id):
            groups = _overlaid(pilot)
            flight_figure.save_flights(
                run.path / _FLIGHTS, groups, "The same starts, flown by the agent and by the PID"
            )
            recorded += [flight for group in groups.values() for flight in group]
        flights.save_flights(run.path / _FLIGHT_RECORDS, recorded)
        on_picture()
        for film in (_GIF, _MP4):
            render.write_video(shown, run.path / film)
            on_picture()
    curve.save_learning_curve(
        run.path / _CURVE,
        files.read_jsonl(run.folder.episodes),
        files.read_jsonl(run.folder.validations),
        _chosen_observations(run),
        f"{run.name} on {run.config.env_id}",
        threshold=evaluations.threshold_of(run.config.env_id),
    )


def _chosen_observations(run: Run) -> int:
    return int(pilots.facts_of(run.folder.best)["observations"])


def _overlaid(pilot: NamedPilot) -> dict[str, list[Flight]]:
    pid = pilots.load("pid")
    return {
        each.name: [
            flights.record_flight(each.pilot, each.env_id, start, each.name)
            for start in TEST_STARTS[:OVERLAID]
        ]
        for each in (pilot, pid)
    }


def evaluate(
    pilot: PilotLike,
    *,
    episodes: int = 100,
    seed: int = TEST_STARTS.start,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
    console: Console | None = None,
) -> Evaluation:
    """Fly a pilot greedily on stock Gymnasium and count.

    Args:
        pilot: a run, its name, `pid`, `heuristic`, `random`, or a file of weights or gains.
        episodes: starts to fly.
        seed: environment seed of the first start; the others follow it one by one. Seeds below
            1,000,000 are test starts.
        env_id: the world for `random`; the others know theirs.
        runs_dir: where runs are kept.
        console: where to show progress; quiet if None.

    Raises:
        UserError: there is no such pilot, or a number is out of range.
    """
    if episodes < 1:
        raise UserError(f"episodes = {episodes}: must be at least 1")
    _check_seed(seed, episodes)
    named = _pilot_of(pilot, Path(runs_dir), env_id)
    shown = console or Console(quiet=True)
    with progress.counting(shown, f"flying {named.name}", episodes) as count:
        return evaluations.evaluate_pilot(named, range(seed, seed + episodes), on_episode=count)


def fly(
    pilot: PilotLike,
    *,
    seed: int = TEST_STARTS.start,
    out: Path | str | None = None,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
) -> Flight:
    """Fly one episode and, if wanted, film it.

    Args:
        pilot: a run, its name, `pid`, `heuristic`, `random`, or a file of weights or gains.
        seed: environment seed of the start.
        out: a `.gif` or `.mp4` to write, or `window` to watch it live; None only flies.
        env_id: the world for `random`; the others know theirs.
        runs_dir: where runs are kept.

    Raises:
        UserError: there is no such pilot, no screen for a window, or `out` cannot be written.
    """
    _check_seed(seed, 1)
    named = _pilot_of(pilot, Path(runs_dir), env_id)
    if out is not None and str(out) == "window":
        return render.show_window(named.env_id, named.pilot, seed, named.name)
    if out is not None:
        render.check_video_path(Path(out))
    flight = flights.record_flight(named.pilot, named.env_id, seed, named.name)
    if out is not None:
        render.write_video(flight, Path(out))
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
        first = tune.HAND_PICKED
    else:
        first = begin if isinstance(begin, PIDConfig) else pilots.read_pid(Path(begin))
    shown = console or Console(quiet=True)
    step = None
    with (
        progress.stop_on_signals(shown) as stop,
        progress.counting(shown, "tuning the PID", 1.0) as count,
    ):
        for step in tune.tune_pid(rule, starts, seed, tolerance, first):
            done = tune.share_done(step.step, tolerance)
            count.describe(f"trial {step.trial}, best mean return {step.best_return:.1f}", done)
            if stop():
                break
    if step is None:
        raise UserError("tuning was stopped before its first trial")
    if out is not None:
        with files.refusing(f"{step.best}: found, but out {str(out)!r}"):
            files.write_atomic(Path(out), tune.to_toml(step, starts, seed, first))
    return step.best


def list_runs(runs_dir: Path | str = DEFAULT_RUNS) -> list[Run]:
    """Every run in a folder, oldest first.

    Raises:
        UserError: there is no such folder.
    """
    if not Path(runs_dir).is_dir():
        raise UserError(f"runs_dir {str(runs_dir)!r}: no such folder; `touchdown train` makes it")
    return [Run(folder) for folder in folders.list_runs(Path(runs_dir))]


def show(run: str, runs_dir: Path | str = DEFAULT_RUNS) -> Run:
    """The run of that name.

    Raises:
        UserError: there is no such run.
    """
    return Run(folders.find(run, Path(runs_dir)))


def evaluations_of(run: Run) -> list[Evaluation]:
    """The test flights of a run and of the baselines; none while it is not finished.

    Raises:
        UserError: `evaluation.json` is broken.
    """
    path = run.folder.evaluation
    return evaluations.read_evaluations(path) if path.is_file() else []


def run_facts(run: Run) -> dict[str, Any]:
    """A run in one JSON object: what `runs` and `show` print.

    Raises:
        UserError: the run's files are broken.
    """
    config = run.config
    path = run.folder.episodes
    episodes = files.read_jsonl(path, ("observations", "seconds")) if path.is_file() else []
    last = episodes[-1] if episodes else {"observations": 0, "seconds": 0.0}
    evaluation = run.evaluation
    return {
        "name": run.name,
        "status": run.status,
        "preset": config.preset,
        "env_id": config.env_id,
        "seed": config.seed,
        "config_digest": config.digest,
        "episodes": len(episodes),
        "observations": last["observations"],
        "seconds": last["seconds"],
        "test": evaluation.summary.to_json() if evaluation else None,
    }


def list_facts(runs_dir: Path | str = DEFAULT_RUNS) -> list[dict[str, Any]]:
    """`run_facts` of every run, oldest first; of a broken one its name, and what is the matter.

    Raises:
        UserError: there is no such folder.
    """
    facts: list[dict[str, Any]] = []
    for run in list_runs(runs_dir):
        try:
            facts.append(run_facts(run))
        except UserError as error:
            facts.append({"name": run.name, "status": "broken", "error": str(error)})
    return facts


def _pilot_of(pilot: PilotLike, runs_dir: Path, env_id: str) -> NamedPilot:
    device.use_default()
    if isinstance(pilot, NamedPilot):
        return pilot
    if isinstance(pilot, Run):
        return pilot.pilot
    return pilots.load(str(pilot), runs_dir, env_id)


def _check_seed(seed: int, count: int) -> None:
    if not 0 <= seed <= 2**31 - count:
        raise UserError(f"seed = {seed}: must be from 0 to {2**31 - count}")
