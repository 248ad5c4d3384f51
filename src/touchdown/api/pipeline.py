"""One run from its config, or from where it was stopped, to its last picture."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing

import numpy as np
from rich.console import Console

from touchdown.api import views
from touchdown.config.presets import SECTIONS_OF_THE_PAPER
from touchdown.core import device, progress
from touchdown.core.errors import Interrupted, UserError, one_line
from touchdown.core.seeding import TEST_STARTS
from touchdown.core.types import ValuePolicy
from touchdown.envs import environment
from touchdown.envs import flight as flights
from touchdown.envs.flight import Flight
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation import table
from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.evaluator import Evaluator
from touchdown.figures import flights as flight_figure
from touchdown.figures import policy_map
from touchdown.figures.grid import grid_of
from touchdown.lander import rules
from touchdown.policies import lookup
from touchdown.policies import weights as policy_weights
from touchdown.policies.named import NamedPolicy
from touchdown.render import film as films
from touchdown.runs.folder import DEFAULT_RUNS, RunFolder
from touchdown.runs.run import FLIGHTS, GIF, MP4, PICTURES, POLICY, Run, evaluations_of
from touchdown.training import finish
from touchdown.training.trainer import Trainer

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
        views.TrainingView(shown, folder.name) as view,
        progress.stop_on_signals(shown) as stop,
        # open to the end: it holds the right to write to the run
        closing(
            Trainer(
                folder,
                should_stop=stop,
                on_status=view.status,
                on_phase=view.phase,
                on_episode=view.advance,
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
            table.evaluation_table(
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
    facts = policy_weights.facts_of(run.folder.best)
    mean = f"{policy_weights.final_return_of(run.folder.best):.1f}"
    if facts.solved_seconds is None:
        return f"not solved within its budget: {mean} on validation starts"
    return (
        f"solved after {facts.solved_seconds:.1f} s and {facts.env_steps:,} observations: "
        f"{mean} on {run.config.training.final_validation_episodes} validation starts"
    )


def _test(
    run: Run, on_phase: Callable[[str, int], object], on_episode: Callable[[], object]
) -> list[Evaluation]:
    """Fly the chosen checkpoint and the baselines from the test starts, once."""
    already = evaluations_of(run)
    if already:
        return already
    policy = run.policy
    names = ("pid", "heuristic", "random") if rules.is_lander(policy.env_id) else ("random",)
    flown = [policy, *(lookup.load(name, env_id=policy.env_id) for name in names)]
    starts = TEST_STARTS[: run.config.training.test_episodes]
    on_phase(f"flying {len(starts)} test starts with {len(flown)} pilots", len(flown) * len(starts))
    evaluator = Evaluator(policy.env_id)
    try:
        results = [
            evaluations.evaluate_policy(each, starts, evaluator=evaluator, on_episode=on_episode)
            for each in flown
        ]
    finally:
        evaluator.close()
    evaluations.write_evaluations(
        run.folder.evaluation, results, policy_weights.facts_of(run.folder.best)
    )
    return results


def _draw(run: Run, tested: Sequence[Evaluation], on_picture: Callable[[], object]) -> None:
    """The learning curve, the overlaid flights and the film of the test flight in the middle."""
    if tested:
        policy = run.policy
        own = tested[0]
        shown = flights.record_flight(
            policy.policy, policy.env_id, evaluations.median_start(own), policy.name
        )
        recorded = [shown]
        if rules.is_lander(policy.env_id):
            groups = _overlaid(policy)
            flight_figure.save_flights(
                run.path / FLIGHTS, groups, "The same starts, flown by the agent and by the PID"
            )
            recorded += [flight for group in groups.values() for flight in group]
        flights.save_flights(run.path / _FLIGHT_RECORDS, recorded)
        on_picture()
        for film in (GIF, MP4):
            films.write_video(shown, run.path / film)
            on_picture()
    finish.save(run, f"{run.name} on {run.config.env_id}")


def _draw_policy(run: Run) -> str:
    """Draw what is done in each cell of a world of cells; gives it as text, nothing of others."""
    policy = run.policy
    env, spaces = environment.make_env(policy.env_id)
    env.close()
    grid, num_states = grid_of(env), spaces.num_states
    if grid is None or num_states is None or not isinstance(policy.policy, ValuePolicy):
        return ""
    q = policy.policy.values(np.eye(num_states, dtype=np.float32))
    policy_map.save_policy(run.path / POLICY, grid, q, f"{run.name} on {policy.env_id}")
    return policy_map.policy_text(grid, q)


def _overlaid(policy: NamedPolicy) -> dict[str, list[Flight]]:
    pid = lookup.load("pid")
    return {
        each.name: [
            flights.record_flight(each.policy, each.env_id, start, each.name)
            for start in TEST_STARTS[:OVERLAID]
        ]
        for each in (policy, pid)
    }
