"""One run from its config, or from where it was stopped, to its last picture."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing

import numpy as np
from rich.console import Console

from touchdown import device, learning_curve, progress, tables
from touchdown.errors import Interrupted, UserError, one_line
from touchdown.figures import flights as flight_figure
from touchdown.figures import policy
from touchdown.figures.grid_world import grid_of
from touchdown.lander import env as lander
from touchdown.lander import flight as flights
from touchdown.lander import render
from touchdown.lander.flight import Flight
from touchdown.presets import SECTIONS_OF_THE_PAPER
from touchdown.runs import evaluation as evaluations
from touchdown.runs import pilots
from touchdown.runs.evaluate import Fleet
from touchdown.runs.evaluation import Evaluation
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.runs.pilots import NamedPilot
from touchdown.runs.run import FLIGHTS, GIF, MP4, PICTURES, POLICY, Run, evaluations_of
from touchdown.runs.train import Trainer
from touchdown.seeding import TEST_STARTS
from touchdown.types import ValuePilot

OVERLAID = 6  # starts whose flights are drawn over each other: more hide each other
_FLIGHT_RECORDS = "flights.safetensors"


def complete(folder: RunFolder, console: Console | None) -> Run:
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
        view.phase("drawing", len(PICTURES) if tested else 1)
        text = _draw_policy(run)
        _draw(run, tested, advance)
    seconds = f"trained in {progress.clock(trained - began)}"
    total = progress.clock(time.monotonic() - began)
    shown.print(f"{folder.name}: {seconds}, {total} in all", markup=False)
    if training.stop_when_solved:
        shown.print(_verdict(run), markup=False)
    if tested:
        note = SECTIONS_OF_THE_PAPER.get(config.preset)
        shown.print(
            tables.evaluation_table(
                tested,
                paper=evaluations.is_lander(tested[0]),
                note=f"{folder.name} is of the preset {config.preset}: {note}." if note else "",
            )
        )
    if text:
        shown.print(f"the policy learnt:\n{text}", markup=False, highlight=False)
    for path in run.pictures:
        shown.print(f"  {path}", soft_wrap=True, markup=False)
    return run


def _verdict(run: Run) -> str:
    """How a run that was to stop when its world is solved came to its end."""
    facts = pilots.facts_of(run.folder.best)
    mean = f"{facts['final_validation_return']:.1f}"
    if "solved_seconds" not in facts:
        return f"not solved within its budget: {mean} on validation starts"
    return (
        f"solved after {facts['solved_seconds']:.1f} s and {facts['observations']:,} observations: "
        f"{mean} on {run.config.training.final_validation_episodes} validation starts"
    )


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
                run.path / FLIGHTS, groups, "The same starts, flown by the agent and by the PID"
            )
            recorded += [flight for group in groups.values() for flight in group]
        flights.save_flights(run.path / _FLIGHT_RECORDS, recorded)
        on_picture()
        for film in (GIF, MP4):
            render.write_video(shown, run.path / film)
            on_picture()
    learning_curve.save(run, f"{run.name} on {run.config.env_id}")


def _draw_policy(run: Run) -> str:
    """Draw what is done in each cell of a world of cells; gives it as text, nothing of others."""
    pilot = run.pilot
    world = lander.make(pilot.env_id)
    world.env.close()
    grid, num_states = grid_of(world.env), world.spaces.num_states
    if grid is None or num_states is None or not isinstance(pilot.pilot, ValuePilot):
        return ""
    q = pilot.pilot.values(np.eye(num_states, dtype=np.float32))
    policy.save_policy(run.path / POLICY, grid, q, f"{run.name} on {pilot.env_id}")
    return policy.policy_text(grid, q)


def _overlaid(pilot: NamedPilot) -> dict[str, list[Flight]]:
    pid = pilots.load("pid")
    return {
        each.name: [
            flights.record_flight(each.pilot, each.env_id, start, each.name)
            for start in TEST_STARTS[:OVERLAID]
        ]
        for each in (pilot, pid)
    }
