"""After training: the test, the recorded flights for the pictures, and the learning curve."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

import msgspec

from touchdown.core import records
from touchdown.core.errors import UserError
from touchdown.core.helper import Helper, HelperError
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import custom, recorder
from touchdown.envs import flight as flights
from touchdown.envs.flight import Flight
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation import kept
from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.evaluator import EpisodeResult, Evaluator
from touchdown.evaluation.paths import NUM_PATHS, PathRecorder, save_paths
from touchdown.lander import rules
from touchdown.policies import lookup
from touchdown.policies import weights as policy_weights
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy
from touchdown.runs.rows import EpisodeRow, ValidationRow
from touchdown.runs.run import CURVE, Run, evaluations_of

LAST = "last.json"
"""Paths of the test flights with the final weights."""


def fly_test(
    run: Run,
    *,
    baselines: Sequence[str] = (),
    last: NamedPolicy | None = None,
    keep_paths: bool = False,
    helper: Helper | None = None,
    on_phase: Callable[[str, int], object] = lambda _text, _count: None,
    on_episode: Callable[[], object] = lambda: None,
) -> list[Evaluation]:
    """Fly the test starts on stock Gymnasium with each policy, unless results are already on disk.

    Args:
        run: a run whose training is finished.
        baselines: names of policies to compare with the selected checkpoint.
        last: policy with the final weights, recorded in `LAST`; None skips it.
        keep_paths: whether to write `paths.safetensors`; for the lander only.
        helper: flies a part of the selected checkpoint's starts; not with `keep_paths`.
        on_phase: called before the first flight with a description and the number of flights.
        on_episode: called after each flight; an exception from it ends the test.

    Returns:
        The selected checkpoint's evaluation, then the baselines'; empty without a test.

    Raises:
        UserError: the run's files are broken.
    """
    starts = TEST_STARTS[: run.config.training.test_episodes]
    if not starts:
        return []
    env_id = run.config.env_id
    tested = evaluations_of(run)
    keep_paths &= rules.is_lander(env_id) and not run.folder.paths.is_file()
    if (run.path / LAST).is_file():
        last = None
    if tested and last is None and not keep_paths:
        return tested
    chosen = run.policy
    others = [] if tested else [kept.read(name, env_id, starts) or name for name in baselines]
    unknown = sum(isinstance(each, str) for each in others)
    count = (not tested) + unknown + (last is not None)
    on_phase(f"testing on {len(starts)} starts, policies: {count}", count * len(starts))
    with closing(Evaluator(env_id)) as evaluator:
        recorder = PathRecorder(starts)
        if not tested:
            observer = recorder if keep_paths else None
            tested = [_fly_chosen(run, starts, evaluator, helper, on_episode, observer)]
            for each in others:
                if isinstance(each, str):
                    policy = lookup.load(each, env_id=env_id)
                    flown = evaluations.evaluate_policy(
                        policy, starts, evaluator=evaluator, on_episode=on_episode
                    )
                    kept.keep(flown, starts)
                    tested.append(flown)
                else:
                    tested.append(each)
        elif keep_paths:  # tested by a version that did not keep paths
            evaluator.rollout(chosen.policy, starts[:NUM_PATHS], on_episode, recorder)
        # before the evaluation, so that an evaluation on disk always has its paths
        if keep_paths:
            save_paths(run.folder.paths, recorder.paths)
        if not run.folder.evaluation.is_file():
            facts = policy_weights.facts_of(run.folder.best)
            evaluations.write_evaluations(run.folder.evaluation, tested, facts)
        if last is not None:
            flown = evaluations.evaluate_policy(
                last, starts, evaluator=evaluator, on_episode=on_episode
            )
            evaluations.write_evaluations(run.path / LAST, [flown], WeightsFacts())
    return tested


def _fly_chosen(
    run: Run,
    starts: range,
    evaluator: Evaluator,
    helper: Helper | None,
    on_episode: Callable[[], object],
    observer: PathRecorder | None,
) -> Evaluation:
    """The evaluation of the selected checkpoint; a helper flies the last of the starts."""
    chosen = run.policy
    if helper is None or observer is not None:
        return evaluations.evaluate_policy(
            chosen, starts, evaluator=evaluator, on_episode=on_episode, observer=observer
        )
    count = len(starts) // 2
    rest = starts[count:]
    arguments = {"path": str(run.folder.best), "env_id": run.config.env_id, "starts": [*rest]}
    call = helper.start("touchdown.training.chores:fly", **arguments)
    episodes = evaluator.rollout(chosen.policy, starts[:count], on_episode)
    try:
        episodes += msgspec.convert(helper.result(call, on_episode), list[EpisodeResult])
    except HelperError:
        episodes += evaluator.rollout(chosen.policy, rest, on_episode)
    return evaluations.summarised(chosen, episodes)


@dataclass(frozen=True, slots=True)
class RecordedFlights:
    """Recorded flights for the pictures of a run."""

    median: Flight
    """The flight with the median test return."""
    beside: dict[str, list[Flight]]
    """Flights of the agent and of the PID from the same starts, by policy name; lander only."""


def record_flights(
    run: Run,
    tested: Evaluation,
    num_beside: int = 0,
    on_note: Callable[[str], object] = lambda _: None,
) -> RecordedFlights | None:
    """Record the flights for the pictures in `flights.safetensors`, the median one first.

    Args:
        run: a run whose test is finished.
        tested: evaluation of the selected checkpoint.
        num_beside: test starts that the agent and the PID both fly.
        on_note: called with a line that says why there is no film, if there is none.

    Returns:
        The flights; None if the environment cannot be drawn, in which case the file has no flights.

    Raises:
        UserError: the run's files are broken, or the file cannot be written.
    """
    policy = run.policy
    start = evaluations.median_start(tested)
    try:
        median = recorder.record_flight(policy.policy, policy.env_id, start, policy.name)
    except UserError as error:  # the run has its results: a film is no reason to lose them
        on_note(f"no film: {error}")
        flights.save_flights(run.folder.flights, [])
        return None
    beside: dict[str, list[Flight]] = {}
    if num_beside and rules.is_lander(policy.env_id):
        for each in (policy, lookup.load("pid", env_id=policy.env_id)):
            beside[each.name] = [
                recorder.record_flight(each.policy, each.env_id, start, each.name)
                for start in TEST_STARTS[:num_beside]
            ]
    recorded = [median, *(flight for group in beside.values() for flight in group)]
    flights.save_flights(run.folder.flights, recorded)
    return RecordedFlights(median, beside)


def save_curve(run: Run, title: str) -> None:
    """Draw a run's episodes and validations, and mark the selected checkpoint.

    The learning curve is the last file that a run writes, so a run that has it is finished.

    Args:
        run: a run whose training is finished.
        title: title of the figure.

    Raises:
        UserError: the run's files are broken, or the picture cannot be written.
    """
    from touchdown.figures import curve  # noqa: PLC0415 - it loads matplotlib

    curve.save_learning_curve(
        run.path / CURVE,
        msgspec.to_builtins(records.decode_jsonl(run.folder.episodes, EpisodeRow)),
        msgspec.to_builtins(records.decode_jsonl(run.folder.validations, ValidationRow)),
        policy_weights.facts_of(run.folder.best).env_steps,
        title,
        threshold=custom.threshold_of(run.config.env_id),
    )
