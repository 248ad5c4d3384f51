"""Work at the end of a run that a helper process can do: see `core.helper`."""

from collections.abc import Callable, Sequence
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Any

from touchdown.envs import environment, flight
from touchdown.envs.flight import Flight
from touchdown.evaluation.evaluator import Evaluator
from touchdown.policies import weights
from touchdown.render import canvas
from touchdown.render import film as films
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run
from touchdown.training import finish


def prepare(*, env_id: str, tick: Callable[[], object]) -> None:
    """Load what the other functions need, while the run is still training."""
    del tick
    environment.make_env(env_id).env.close()
    canvas.font(10.0)
    for module in ("flights", "curve"):  # with matplotlib, which takes as long as many flights
        import_module(f"touchdown.figures.{module}")


def fly(
    *, path: str, env_id: str, starts: Sequence[int], tick: Callable[[], object]
) -> list[dict[str, Any]]:
    """Episodes of a saved policy on stock Gymnasium, as JSON objects."""
    policy = weights.load_weights(Path(path)).policy
    with closing(Evaluator(env_id)) as evaluator:
        return [episode.to_json() for episode in evaluator.rollout(policy, starts, tick)]


def figure(*, flights: str, out: str, title: str, tick: Callable[[], object]) -> None:
    """Draw all but the first of a file's flights beside each other, in a run's folder."""
    del tick
    from touchdown.figures import flights as figures  # noqa: PLC0415 - it loads matplotlib

    beside: dict[str, list[Flight]] = {}
    for each in flight.load_flights(Path(flights))[1:]:
        beside.setdefault(each.policy, []).append(each)
    figures.save_flights(Path(out), beside, title)


def curve(*, run: str, title: str, tick: Callable[[], object]) -> None:
    """Draw the learning curve of a run's folder."""
    del tick
    finish.save_curve(Run(RunFolder(Path(run))), title)


def film(*, flights: str, out: str, tick: Callable[[], object]) -> None:
    """Film the first of a file's flights, in a run's folder."""
    del tick
    films.write_video(flight.load_flights(Path(flights))[0], Path(out), follow=False)
