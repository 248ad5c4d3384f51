"""Completes one run, from its config or last checkpoint to its pictures."""

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np
from rich.console import Console, RenderableType
from rich.text import Text

from touchdown.api import views
from touchdown.config.config import Config
from touchdown.config.presets import DESCRIPTIONS
from touchdown.core import device, progress
from touchdown.core.errors import Interrupted, UserError, is_out_of_memory, one_line
from touchdown.core.helper import Helper, second_core
from touchdown.core.types import ValuePolicy
from touchdown.envs import environment
from touchdown.evaluation import table
from touchdown.evaluation.evaluation import Evaluation
from touchdown.figures.grid import grid_of
from touchdown.lander import rules
from touchdown.policies import weights as policy_weights
from touchdown.render import film as films
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import FLIGHTS, GIF, MP4, POLICY, Run, evaluations_of
from touchdown.training import finish, services
from touchdown.training.checkpoint import DamagedError
from touchdown.training.listeners import ListenerError, Listeners
from touchdown.training.services import LoggerName
from touchdown.training.trainer import Trainer

OVERLAID = 6  # number of starts whose flights are overlaid; more would hide each other


def complete(
    folder: RunFolder,
    console: Console,
    listeners: Listeners,
    loggers: Sequence[LoggerName] = (),
) -> Run:
    """Do the missing parts of a run: training, selection of a checkpoint, test, pictures.

    Args:
        folder: the run's folder.
        console: where to show progress and results.
        listeners: receive every scalar of training; closed by the caller.
        loggers: names of logging services, which are added to the listeners.
    """
    device.use_default()
    flags = [
        *(["--logger", *loggers] if loggers else []),
        *(["--trust"] if folder.config().own_code else []),
    ]
    continuing = f"resume with: {folder.resume_command(*flags)}"
    try:
        return _completed(folder, console, listeners, loggers)
    except Interrupted:
        raise Interrupted(f"stopped and saved; {continuing}") from None
    except ListenerError as error:
        raise ListenerError(
            f"{error}; the last saved state is intact; {continuing}"
        ) from error.__cause__
    except DamagedError as error:
        raise UserError(
            f"{error}; no checkpoint of the run is whole, so it cannot continue; train it anew: "
            f"{folder.restart_command(*flags)}"
        ) from None
    except OSError as error:
        path = error.filename or folder.path
        # chained, because the user's own environment or agent may have raised it
        raise UserError(
            f"{path}: cannot be written: {one_line(error)}; the last saved state is intact; "
            f"{continuing}"
        ) from error
    except (MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        raise UserError(
            f"{folder.path}: out of memory ({one_line(error)[:120]}); "
            "try a smaller capacity, batch_size or hidden_sizes"
        ) from None


def _completed(
    folder: RunFolder, shown: Console, listeners: Listeners, loggers: Sequence[LoggerName]
) -> Run:
    config = folder.config()
    for name, where in services.open_loggers(loggers, folder, listeners).items():
        shown.print(f"logger {name}: {where}", soft_wrap=True, markup=False, highlight=False)
    run = Run(folder)
    if run.status == "finished" and _has_pictures(run):
        shown.print(
            Text(f"{folder.name}: finished already"),
            *_results(run, evaluations_of(run), "", ()),
            sep="\n",
            crop=False,
        )
        return run
    began = time.monotonic()
    with (
        views.TrainingView(shown, folder.name) as view,
        progress.stop_on_signals(shown) as stop,
        # stays open to the end, because it holds the lock on the run
        closing(
            Trainer(
                folder,
                should_stop=stop,
                on_status=view.status,
                on_phase=view.phase,
                on_episode=view.advance,
                on_scalars=listeners.log,
                replayable=True,
            )
        ) as trainer,
        _helping(config) as helper,
    ):

        def advance() -> None:
            view.advance()
            stop.check()

        trainer.run()
        trained = time.monotonic()
        tested = finish.fly_test(
            run,
            baselines=_baselines(config.env_id),
            helper=helper,
            on_phase=view.phase,
            on_episode=advance,
        )
        view.phase("drawing pictures", 4 if tested else 1)
        text = _draw_policy(run)
        notes: list[str] = []
        if tested:
            _draw(run, tested[0], helper, advance, notes.append)
        _draw_curve(run, helper)
        view.advance()
    seconds = f"trained in {progress.clock(trained - began)}"
    total = progress.clock(time.monotonic() - began)
    # all at once, because a notebook separates the outputs of several prints
    shown.print(
        Text(f"{folder.name}: {seconds}, {total} in total"),
        *_results(run, tested, text, notes),
        sep="\n",
        crop=False,
    )
    return run


def _has_pictures(run: Run) -> bool:
    """Whether a finished run has lost none of its pictures."""
    env_id = run.config.env_id
    needed = [GIF, MP4]
    if rules.is_lander(env_id):
        needed.append(FLIGHTS)
    elif environment.spaces_of(env_id).num_states is not None:
        needed.append(POLICY)
    return all((run.path / name).is_file() for name in needed)


def _results(
    run: Run, tested: Sequence[Evaluation], learned: str, notes: Sequence[str]
) -> Iterator[RenderableType]:
    """Show the results of a finished run: whether it was solved, its test, policy and pictures."""
    config = run.config
    if config.training.stop_when_solved:
        yield Text(_how_it_was_solved(run))
    if tested:
        note = DESCRIPTIONS.get(config.preset)
        yield table.evaluation_table(
            tested,
            paper=tested[0].env_id == rules.LANDER_ID,
            note=f"{run.name} uses the preset {config.preset}: {note}." if note else "",
        )
    if learned:
        yield Text(f"learned policy:\n{learned}")
    yield from map(Text, notes)
    for path in run.pictures:
        yield Text(f"  {path}", no_wrap=True, overflow="ignore")


@contextmanager
def _helping(config: Config) -> Generator[Helper | None]:
    """A helper that loads what the end of a lander's run needs; None where it would be no help."""
    lander = rules.is_lander(config.env_id) and not config.own_code
    helper = second_core() if lander else None
    if helper is None:
        yield None
        return
    with closing(helper):
        helper.start("touchdown.training.chores:prepare", env_id=config.env_id)
        yield helper


def _baselines(env_id: str) -> tuple[str, ...]:
    """The baselines of an environment."""
    return ("pid", "heuristic", "random") if rules.is_lander(env_id) else ("random",)


def _how_it_was_solved(run: Run) -> str:
    """A sentence about the end of a run with `stop_when_solved`."""
    facts = policy_weights.facts_of(run.folder.best)
    mean = f"{policy_weights.final_return_of(run.folder.best):.1f}"
    if facts.solved_seconds is None:
        return f"not solved within its budget: mean return {mean} on validation starts"
    return (
        f"solved after {facts.solved_seconds:.1f} s and {facts.env_steps:,} environment steps: "
        f"mean return {mean} on {run.config.training.final_validation_episodes} validation starts"
    )


def _draw(
    run: Run,
    tested: Evaluation,
    helper: Helper | None,
    on_picture: Callable[[], object],
    on_note: Callable[[str], object],
) -> None:
    """Draw the overlaid flights, and film the flight with the median test return.

    A helper draws what needs matplotlib, which it has loaded already, and one of the films.
    """
    recorded = finish.record_flights(run, tested, OVERLAID, on_note)
    title = "Flights of the agent and the PID from the same starts"
    figure = gif = 0
    if recorded is not None and helper is not None:
        flights = str(run.folder.flights)
        if recorded.beside:
            out = str(run.path / FLIGHTS)
            chore = "touchdown.training.chores:figure"
            figure = helper.start(chore, flights=flights, out=out, title=title)
        out = str(run.path / GIF)
        gif = helper.start("touchdown.training.chores:film", flights=flights, out=out)
    if recorded is not None:
        films.write_video(recorded.median, run.path / MP4, follow=False)
    on_picture()
    if recorded is not None and recorded.beside and not (helper and helper.has_done(figure)):
        from touchdown.figures import flights as figures  # noqa: PLC0415 - it loads matplotlib

        figures.save_flights(run.path / FLIGHTS, recorded.beside, title)
    on_picture()
    if recorded is not None and not (helper and helper.has_done(gif)):
        films.write_video(recorded.median, run.path / GIF, follow=False)
    on_picture()


def _draw_curve(run: Run, helper: Helper | None) -> None:
    """Draw the learning curve, the last file of a run."""
    title = f"{run.name} on {run.config.env_id}"
    arguments = {"run": str(run.path), "title": title}
    if helper is None or not helper.has_done(
        helper.start("touchdown.training.chores:curve", **arguments)
    ):
        finish.save_curve(run, title)


def _draw_policy(run: Run) -> str:
    """Draw the greedy policy of a gridworld and return it as text; "" for other environments."""
    policy = run.policy
    env, spaces = environment.make_env(policy.env_id)
    env.close()
    grid, num_states = grid_of(env), spaces.num_states
    if grid is None or num_states is None or not isinstance(policy.policy, ValuePolicy):
        return ""
    q = policy.policy.values(np.eye(num_states, dtype=np.float32))
    from touchdown.figures import policy_map  # noqa: PLC0415 - it loads matplotlib

    policy_map.save_policy(run.path / POLICY, grid, q, f"{run.name} on {policy.env_id}")
    return policy_map.policy_text(grid, q)
