"""Searches hyper-parameters with Optuna: several seeds per trial, pruned by the median."""

import dataclasses
import re
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import sqlalchemy
import sqlalchemy.exc

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.core.errors import UserError, one_line
from touchdown.policies import weights as policy_weights
from touchdown.runs.folder import RunFolder
from touchdown.studies import runner
from touchdown.studies.changes import nested
from touchdown.studies.executors import Executor
from touchdown.studies.plan import FIRST_TUNING_SEED
from touchdown.studies.space import Space
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob

_STARTUP = 5  # trials before median pruning begins
_PATIENCE = 60.0  # seconds to wait for a SQLite file that another process has locked
_OF_STORAGES = (optuna.exceptions.OptunaError, sqlalchemy.exc.SQLAlchemyError)
_OF_URLS = (ValueError, TypeError)  # what a driver raises for an option that it cannot read


@dataclass(frozen=True, slots=True)
class Searched:
    """The result of a search so far."""

    best: Config
    """The best settings, with the preset's seed and test."""
    value: float
    """Mean final validation return over the trial's seeds."""
    changed: Mapping[str, Any]
    """The best values of the searched settings, by dotted name."""
    trials: int
    """Number of complete and pruned trials."""
    pruned: int
    importance: Mapping[str, float]
    """Importance of each setting, summing to 1; empty if there are too few trials."""


def open_study(url: str, name: str, seed: int) -> optuna.Study:
    """Open a search in a storage, or create one.

    Args:
        url: Optuna's storage.
        name: name of the search in it.
        seed: seed of the sampler.

    Raises:
        UserError: the storage cannot be reached, contains something else, or would be lost when
            this process ends.
    """
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    parts = _parsed(url)
    is_sqlite = parts.get_backend_name() == "sqlite"
    if is_sqlite and parts.database in (None, "", ":memory:"):
        raise UserError(
            f"storage = {_shown(parts)!r}: must name a file, such as sqlite:///search.sqlite3, "
            "because a database in memory is lost at the end"
        )
    # another process may hold SQLite's lock for a while
    wait = {"timeout": _PATIENCE} if is_sqlite else {}
    with storage_errors(url):
        try:
            storage = optuna.storages.RDBStorage(url, engine_kwargs={"connect_args": wait})
        except (ImportError, *_OF_URLS) as error:
            raise _refusal(parts, error) from None
        return optuna.create_study(
            study_name=name,
            storage=storage,
            load_if_exists=True,
            direction="maximize",
            sampler=optuna.samplers.TPESampler(seed=seed),
            pruner=optuna.pruners.MedianPruner(n_startup_trials=_STARTUP, n_warmup_steps=0),
        )


@contextmanager
def storage_errors(url: str) -> Generator[None]:
    """Turn an error of a storage in the block into one line without the storage's password.

    Args:
        url: Optuna's storage.

    Raises:
        UserError: the storage raised an error inside.
    """
    try:
        yield
    except _OF_STORAGES as error:
        raise _refusal(_parsed(url), error) from None


def _parsed(url: str) -> sqlalchemy.URL:
    try:
        return sqlalchemy.make_url(url)
    except (sqlalchemy.exc.ArgumentError, *_OF_URLS):
        # nobody knows where in it the password is, so that neither it nor the error is shown
        scheme = re.match(r"[A-Za-z][\w+.-]*:", url)
        shown = f"{scheme[0] if scheme else ''}…" if url else ""
        raise UserError(
            f"storage = {shown!r}: cannot be used: must be a URL that SQLAlchemy can parse, such "
            "as sqlite:///search.sqlite3 or postgresql://USER:PASSWORD@HOST/DATABASE"
        ) from None


def _shown(parts: sqlalchemy.URL) -> str:
    """A URL without its password and its options, one of which may be a password."""
    return parts.set(query={}).render_as_string(hide_password=True)


def _refusal(parts: sqlalchemy.URL, error: BaseException) -> UserError:
    cause = getattr(error.__cause__, "orig", None) or error.__cause__ or error
    said = one_line(cause)
    options = [str(value) for key, value in parts.query.items() if "pass" in key.lower()]
    for secret in filter(None, (str(parts.password or ""), *options)):
        said = said.replace(secret, "***")
    return UserError(f"storage = {_shown(parts)!r}: cannot be used: {said[:200]}")


def search(
    study: optuna.Study,
    base: Config,
    space: Space,
    store: Store,
    executor: Executor,
    *,
    trials: int,
    seeds: int,
    alone: bool = True,
    on_trial: Callable[[int, float | None], object] = lambda _count, _best: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Searched:
    """Run trials until there are enough, counting earlier ones.

    Args:
        study: the Optuna study.
        base: settings, some of which the search changes.
        space: what it changes.
        store: the store for the trials' runs.
        executor: runs a trial's seeds in parallel.
        trials: total number of trials.
        seeds: training seeds per trial.
        alone: whether no other machine runs trials of this search.
        on_trial: called after each with the number of trials and the best value.
        should_stop: called regularly.

    Raises:
        Interrupted: `should_stop` returned True.
        UserError: nothing can be written, or no trial was completed.
    """
    if alone:
        _take_up_again(study)
    while len(_over(study)) < trials:
        trial = study.ask()
        changed = {name: of.suggest(trial, name) for name, of in space.items()}
        value = _value_of(trial, _changed(base, changed), store, executor, seeds, should_stop)
        if value is None:
            study.tell(trial, state=optuna.trial.TrialState.PRUNED)
        else:
            study.tell(trial, value)
        on_trial(len(_over(study)), _best_value(study))
    return _found(study, base, space)


def _take_up_again(study: optuna.Study) -> None:
    """Retry the trials that were running when the search was stopped; finished runs are kept."""
    for left in study.get_trials(states=[optuna.trial.TrialState.RUNNING]):
        study.tell(left.number, state=optuna.trial.TrialState.FAIL)
        study.enqueue_trial(left.params)


def _over(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    states = [optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED]
    return study.get_trials(deepcopy=False, states=states)


def _best_value(study: optuna.Study) -> float | None:
    complete = study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])
    return max((t.value for t in complete if t.value is not None), default=None)


def _changed(base: Config, changed: Mapping[str, Any]) -> Config:
    config = base
    for name, value in changed.items():
        config = toml.replace_fields(config, nested({name: value}), name)
    return config


def _value_of(
    trial: optuna.Trial,
    config: Config,
    store: Store,
    executor: Executor,
    seeds: int,
    should_stop: Callable[[], bool],
) -> float | None:
    """Mean final validation return over seeds; None if the trial is pruned."""
    values: list[float] = []
    training = replace(config.training, test_episodes=0)
    for first in range(0, seeds, executor.workers):
        jobs = [
            TrainJob(replace(config, seed=FIRST_TUNING_SEED + seed, training=training))
            for seed in range(first, min(seeds, first + executor.workers))
        ]
        state = runner.run_jobs(jobs, store, executor, should_stop=should_stop)
        values += [_return_of(job, store, failed=job.digest in state.failed) for job in jobs]
        trial.report(float(np.mean(values)), len(values))
        if len(values) < seeds and trial.should_prune():
            return None
    return float(np.mean(values))


def _return_of(job: TrainJob, store: Store, *, failed: bool) -> float:
    """A run's final validation return; a very low one for a run that diverged."""
    if failed:
        return -1_000.0
    return policy_weights.final_return_of(RunFolder(store.runs / job.digest).best)


def _found(study: optuna.Study, base: Config, space: Space) -> Searched:
    complete = study.get_trials(deepcopy=False, states=[optuna.trial.TrialState.COMPLETE])
    if not complete:
        raise UserError("trials: none was completed; increase their number")
    best = study.best_trial
    fixed = optuna.trial.FixedTrial(best.params)
    changed = {name: of.suggest(fixed, name) for name, of in space.items()}
    over = _over(study)
    return Searched(
        dataclasses.replace(_changed(base, changed), preset=f"{base.preset}-tuned"),
        float(best.value or 0.0),
        changed,
        len(over),
        len(over) - len(complete),
        _importance(study, complete),
    )


def _importance(
    study: optuna.Study, complete: Sequence[optuna.trial.FrozenTrial]
) -> dict[str, float]:
    if len(complete) < 2 * _STARTUP:
        return {}
    with warnings.catch_warnings():
        # the only evaluator without another package; Optuna calls it experimental
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        evaluator = optuna.importance.PedAnovaImportanceEvaluator()
    return dict(optuna.importance.get_param_importances(study, evaluator=evaluator))


def storage_url(store: Store) -> str:
    """The URL of a SQLite file in the results folder."""
    return f"sqlite:///{(store.path / 'search.sqlite3').resolve()}"


def comment_of(found: Searched, preset: str, seeds: int) -> str:
    """How the best settings were found, as TOML comments."""
    settings = "\n".join(f"#   {name} = {value}" for name, value in found.changed.items())
    first, last = FIRST_TUNING_SEED, FIRST_TUNING_SEED + seeds - 1
    over = f"seed {first}" if seeds == 1 else f"seeds {first} to {last}"
    return (
        f"# touchdown tune agent {preset}: {found.trials} trials, {found.pruned} of them pruned\n"
        f"# mean validation return {found.value:.1f} over training {over}\n"
        f"# found:\n{settings}\n"
    )


def path_beside(path: Path, ending: str) -> Path:
    """A file next to another one, with the same stem and another ending."""
    return path.with_name(f"{path.stem}{ending}")
