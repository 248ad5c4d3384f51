"""Runs a policy greedily: many episodes for an evaluation, or one for a film."""

from pathlib import Path

from rich.console import Console

from touchdown.api.policies import PolicyLike, find_policy
from touchdown.core import files, notebook, plugins
from touchdown.core.errors import UserError
from touchdown.core.progress import Counter, console_for
from touchdown.core.seeding import check_seed
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import custom, recorder
from touchdown.envs.custom import EnvLike
from touchdown.envs.flight import Flight
from touchdown.envs.frames import NotDrawable
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.policies.named import NamedPolicy
from touchdown.render import embedded as embedded  # noqa: PLC0414 - flights show their films
from touchdown.render import film as films
from touchdown.runs.folder import DEFAULT_RUNS


def evaluate(
    policy: PolicyLike,
    *,
    episodes: int = 100,
    seed: int = TEST_STARTS.start,
    env_id: EnvLike | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    vecnormalize: Path | str | None = None,
    trust: bool = False,
    progress: bool | None = None,
    console: Console | None = None,
) -> Evaluation:
    """Run greedy episodes of a policy on stock Gymnasium and summarise them.

    Args:
        policy: a run, its name, or another policy; see `PolicyLike`.
        episodes: number of episodes, each from a different start.
        seed: environment seed of the first start; the others have the following seeds.
            Seeds below 1,000,000 are test starts.
        env_id: the environment for `random` and for a file of another library that does not name
            one. Other policies name theirs and refuse another, but a policy for the lander acts in
            any of its variants. An id, an environment, or a function that makes one; None is
            LunarLander-v3.
        runs_dir: folder of the runs.
        vecnormalize: for a Stable-Baselines3 `.zip`: the file that `VecNormalize.save` wrote, or
            `none` if observations were not normalised in training. With None, the archive tells.
        trust: whether to import code that a file names: an environment's module or an agent.
        progress: True shows progress and results, False shows nothing; None shows them in a
            notebook and on a terminal.
        console: where to show them; None uses the notebook's output or standard output.

    Raises:
        UserError: there is no such policy, or a number is out of range.
    """
    if episodes < 1:
        raise UserError(f"episodes = {episodes}: must be at least 1")
    check_seed(seed, episodes)
    starts = range(seed, seed + episodes)
    with plugins.trusting(everything=trust):
        statistics = None if vecnormalize is None else str(vecnormalize)
        env_name = None if env_id is None else custom.name_of(env_id)
        named = find_policy(policy, Path(runs_dir), env_name, statistics)
        with Counter(console_for(progress, console), f"evaluating {named.name}", episodes) as count:
            return evaluations.evaluate_policy(named, starts, on_episode=count)


def fly(
    policy: PolicyLike,
    *,
    seed: int = TEST_STARTS.start,
    out: Path | str | None = None,
    force: bool = False,
    env_id: EnvLike | None = None,
    runs_dir: Path | str = DEFAULT_RUNS,
    vecnormalize: Path | str | None = None,
    trust: bool = False,
) -> Flight:
    """Run one greedy episode and optionally film it.

    Args:
        policy: a run, its name, or another policy; see `PolicyLike`.
        seed: environment seed of the start.
        out: a `.gif` or `.mp4` file to write, or `window` to watch it live; None makes no film.
        force: whether to replace an existing file.
        env_id: the environment for `random` and for a file of another library that does not name
            one. Other policies name theirs and refuse another, but a policy for the lander acts in
            any of its variants. An id, an environment, or a function that makes one; None is
            LunarLander-v3.
        runs_dir: folder of the runs.
        vecnormalize: for a Stable-Baselines3 `.zip`: the file that `VecNormalize.save` wrote, or
            `none` if observations were not normalised in training. With None, the archive tells.
        trust: whether to import code that a file names: an environment's module or an agent.

    Raises:
        UserError: there is no such policy, no display for a window, or `out` exists already or
            cannot be written.
    """
    check_seed(seed)
    in_window = str(out) == "window"
    if out is not None and not in_window:
        films.check_video_path(Path(out))
        files.check_new(Path(out), force=force)
    with plugins.trusting(everything=trust):
        statistics = None if vecnormalize is None else str(vecnormalize)
        env_name = None if env_id is None else custom.name_of(env_id)
        named = find_policy(policy, Path(runs_dir), env_name, statistics)
        if in_window:
            return films.show_window(named.env_id, named.policy, seed, named.name)
        drawn = out is not None or notebook.in_notebook()  # which shows the flight as a film
        try:
            flight = _flown(named, seed, drawn=drawn)
        except NotDrawable:
            if out is not None:
                raise
            flight = _flown(named, seed, drawn=False)
    if out is not None:
        films.write_video(flight, Path(out))
    return flight


def _flown(named: NamedPolicy, seed: int, *, drawn: bool) -> Flight:
    return recorder.record_flight(named.policy, named.env_id, seed, named.name, drawn=drawn)
