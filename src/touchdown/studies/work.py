"""The jobs of a study: training runs with their tests, PID tunings, and baseline flights."""

import hashlib
import json
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from touchdown.config.config import Config
from touchdown.core import device, files, plugins
from touchdown.core.errors import Interrupted
from touchdown.core.starts import TEST_STARTS
from touchdown.envs import flight as flights
from touchdown.envs import recorder
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.paths import NUM_PATHS, PathRecorder, save_paths
from touchdown.lander import rules
from touchdown.policies import baselines, lookup
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run
from touchdown.studies import value_error
from touchdown.studies.job import JobProgress
from touchdown.studies.tuners import Tuning, tune
from touchdown.training import checkpoint, finish
from touchdown.training.checkpoint import DamagedError
from touchdown.training.trainer import Trainer

LAST = finish.LAST
GAINS = "pid.toml"
_TUNED = "tuning.json"
_BASELINE_EPISODES = 100  # as many as in the paper's runs


@dataclass(frozen=True, slots=True)
class TrainJob:
    """A training run with its test, recorded flights and learning curve."""

    config: Config
    needs_flights: bool = False
    """Whether its flights are needed, which the results of a run elsewhere do not have."""

    @property
    def digest(self) -> str:
        """The config's."""
        return self.config.digest

    def has_results(self, store: Path) -> bool:
        """Whether the run is trained and tested."""
        return Run(RunFolder(store / self.digest)).status == "finished"

    def is_done(self, store: Path) -> bool:
        """Whether the run is finished and the flights for the report are recorded."""
        if not self.has_results(store):
            return False
        if not self.config.training.test_episodes:
            return True
        folder = RunFolder(store / self.digest)
        has_paths = folder.paths.is_file() or not rules.is_lander(self.config.env_id)
        return folder.flights.is_file() and has_paths

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[JobProgress], object],
    ) -> None:
        """Train to the end, run the test, and record flights; see `Job`.

        A run finished by a version that did not record flights is not trained again.
        """
        device.use_default()
        # when the study was planned, the user named this code or trusted the file
        plugins.allow(*self.config.own_code.values())
        folder = RunFolder(store / self.digest)
        run = Run(folder)
        if run.status == "finished":
            with folders.lock(folder):
                _test(run, None, should_stop)
            return
        if not folder.config_file.is_file():
            folders.create(store, self.config, self.digest)
        with closing(_trainer(folder, should_stop, on_progress)) as trainer:
            trainer.run()
            last = NamedPolicy(f"{folder.name}, last", trainer.last_policy, self.config.env_id)
            _test(run, last, should_stop)
            value_error.record(run, last.policy, should_stop)
        config = self.config
        finish.save_curve(run, f"{config.preset}, seed {config.seed}, on {config.env_id}")


def _trainer(
    folder: RunFolder,
    should_stop: Callable[[], bool],
    on_progress: Callable[[JobProgress], object],
) -> Trainer:
    """The trainer of a run; a run that was damaged, as by a power loss, starts anew."""

    def trainer() -> Trainer:
        return Trainer(
            folder,
            should_stop=should_stop,
            on_status=lambda s: on_progress(JobProgress(s.share_done, s.recent_return)),
        )

    try:
        return trainer()
    except DamagedError as error:
        sys.stderr.write(f"{error}; the run starts anew\n")
    with folders.lock(folder):
        checkpoint.set_aside_checkpoints(folder.checkpoints)
    return trainer()


def _test(run: Run, last: NamedPolicy | None, should_stop: Callable[[], bool]) -> None:
    """Run the test and record the flight with the median return."""
    tested = finish.fly_test(run, last=last, keep_paths=True, on_episode=_stopping(should_stop))
    if tested and not run.folder.flights.is_file():
        finish.record_flights(run, tested[0])


@dataclass(frozen=True, slots=True)
class PidJob:
    """PID gains from a tuner, and their test flights."""

    tuning: Tuning

    @property
    def needs_flights(self) -> bool:
        """No: results of such jobs are never from elsewhere."""
        return False

    @property
    def digest(self) -> str:
        """`pid-` and 12 hex digits of everything that determines the gains."""
        return f"pid-{_digest_of(self.tuning.to_dict())}"

    def has_results(self, store: Path) -> bool:
        """Whether the gains have been tested."""
        return RunFolder(store / self.digest).evaluation.is_file()

    def is_done(self, store: Path) -> bool:
        """Whether the gains have been tested and their flight recorded."""
        return self.has_results(store) and RunFolder(store / self.digest).flights.is_file()

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[JobProgress], object],
    ) -> None:
        """Tune, run the test, and record the flight with the median return; see `Job`."""
        folder = RunFolder(store / self.digest)
        gains = folder.path / GAINS
        if not self.has_results(store):
            folder.path.mkdir(parents=True, exist_ok=True)

            def on_trial(share: float, best: float) -> None:
                on_progress(JobProgress(share, best))
                if should_stop():
                    raise Interrupted

            found = tune(self.tuning, on_trial)
            files.write_atomic(folder.path / _TUNED, files.to_json(found.to_json()), follow=False)
            files.write_atomic(gains, found.to_toml(), follow=False)
            starts = TEST_STARTS[: self.tuning.test_episodes]
            tested = evaluations.evaluate_policy(lookup.load(str(gains)), starts)
            evaluations.write_evaluations(folder.evaluation, [tested], WeightsFacts())
        policy = lookup.load(str(gains))
        start = evaluations.median_start(evaluations.read_evaluations(folder.evaluation)[0])
        recorded = recorder.record_flight(policy.policy, policy.env_id, start, policy.name)
        flights.save_flights(folder.flights, [recorded])


@dataclass(frozen=True, slots=True)
class BaselineJob:
    """Test flights of an untrained policy, as a baseline."""

    name: Literal["pid", "random", "heuristic"]

    @property
    def needs_flights(self) -> bool:
        """No: results of such jobs are never from elsewhere."""
        return False

    @property
    def digest(self) -> str:
        """`baseline-`, the name, and 12 hex digits of everything that determines the flights."""
        decides: dict[str, Any] = {"env_id": rules.LANDER_ID, "episodes": _BASELINE_EPISODES}
        if self.name == "pid":
            decides["gains"] = asdict(baselines.shipped_pid())
        return f"baseline-{self.name}-{_digest_of(decides)}"

    def has_results(self, store: Path) -> bool:
        """Whether the test is done."""
        return RunFolder(store / self.digest).evaluation.is_file()

    def is_done(self, store: Path) -> bool:
        """The same as `has_results`, because the paths are written before the evaluation."""
        return self.has_results(store)

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[JobProgress], object],
    ) -> None:
        """Run the test; see `Job`."""
        del on_progress  # it takes a second
        folder = RunFolder(store / self.digest)
        folder.path.mkdir(parents=True, exist_ok=True)
        starts = TEST_STARTS[:_BASELINE_EPISODES]
        recorder = PathRecorder(starts, NUM_PATHS)
        tested = evaluations.evaluate_policy(
            lookup.load(self.name), starts, on_episode=_stopping(should_stop), observer=recorder
        )
        save_paths(folder.paths, recorder.paths)
        evaluations.write_evaluations(folder.evaluation, [tested], WeightsFacts())


def _stopping(should_stop: Callable[[], bool]) -> Callable[[], None]:
    """A function to call after each flight, so that a job can stop between two flights."""

    def check() -> None:
        if should_stop():
            raise Interrupted

    return check


def _digest_of(decides: dict[str, Any]) -> str:
    """12 hex digits of plain values."""
    return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:12]
