"""Fly a policy: many greedy episodes for an evaluation, or a single one to film."""

from pathlib import Path

from rich.console import Console

from touchdown.api.policies import PolicyLike, find_policy
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for
from touchdown.core.seeding import check_seed
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import recorder
from touchdown.envs.flight import Flight
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.render import embedded as embedded  # noqa: PLC0414 - flights show their films
from touchdown.render import film as films
from touchdown.runs.folder import DEFAULT_RUNS


def evaluate(
    policy: PolicyLike,
    *,
    episodes: int = 100,
    seed: int = TEST_STARTS.start,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
    progress: bool | None = None,
    console: Console | None = None,
) -> Evaluation:
    """Fly a policy greedily on stock Gymnasium and summarise its episodes.

    Args:
        policy: a run, its name, or another policy; see `PolicyLike`.
        episodes: number of episodes, each from a start of its own.
        seed: environment seed of the first start; the other starts have the seeds that follow.
            Seeds below 1,000,000 are test starts.
        env_id: the environment for `random`, a `.zip`, and an `.onnx` that names none; other
            policies know theirs.
        runs_dir: folder that holds the runs.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None takes the notebook's output or standard output.

    Raises:
        UserError: there is no such policy, or a number is out of range.
    """
    if episodes < 1:
        raise UserError(f"episodes = {episodes}: must be at least 1")
    check_seed(seed, episodes)
    named = find_policy(policy, Path(runs_dir), env_id)
    shown = console_for(progress, console)
    with Counter(shown, f"flying {named.name}", episodes) as count:
        return evaluations.evaluate_policy(named, range(seed, seed + episodes), on_episode=count)


def fly(
    policy: PolicyLike,
    *,
    seed: int = TEST_STARTS.start,
    out: Path | str | None = None,
    env_id: str = "LunarLander-v3",
    runs_dir: Path | str = DEFAULT_RUNS,
) -> Flight:
    """Fly one episode and, if asked to, film it.

    Args:
        policy: a run, its name, or another policy; see `PolicyLike`.
        seed: environment seed of the start.
        out: a `.gif` or `.mp4` to write, or `window` to watch it live; None makes no film.
        env_id: the environment for `random`, a `.zip`, and an `.onnx` that names none; other
            policies know theirs.
        runs_dir: folder that holds the runs.

    Raises:
        UserError: there is no such policy, no screen for a window, or `out` cannot be written.
    """
    check_seed(seed)
    named = find_policy(policy, Path(runs_dir), env_id)
    if out is not None and str(out) == "window":
        return films.show_window(named.env_id, named.policy, seed, named.name)
    if out is not None:
        films.check_video_path(Path(out))
    flight = recorder.record_flight(named.policy, named.env_id, seed, named.name)
    if out is not None:
        films.write_video(flight, Path(out))
    return flight
