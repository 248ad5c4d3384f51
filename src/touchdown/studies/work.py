"""What one job of a study is: a training run to its test flights, or a tuning of the PID."""

import hashlib
import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from touchdown.config.config import Config
from touchdown.core import device, files
from touchdown.core.errors import Interrupted
from touchdown.core.seeding import TEST_STARTS
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluator import Evaluator
from touchdown.policies import lookup
from touchdown.policies import weights as policy_weights
from touchdown.policies.facts import WeightsFacts
from touchdown.policies.named import NamedPolicy
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run, evaluations_of
from touchdown.studies.job import Progress
from touchdown.studies.tuners import Tuning, tune
from touchdown.training import finish
from touchdown.training.trainer import Trainer

LAST = "last.json"
"""The test flights of the weights that training ended with, beside those of the chosen ones."""
GAINS = "pid.toml"


@dataclass(frozen=True, slots=True)
class TrainJob:
    """A training run, its test flights, and its learning curve."""

    config: Config

    @property
    def digest(self) -> str:
        """The config's."""
        return self.config.digest

    def is_done(self, store: Path) -> bool:
        """Whether the run's last file is there."""
        return Run(RunFolder(store / self.digest)).status == "finished"

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[Progress], object],
    ) -> None:
        """Train to the end, then fly the test starts; see `Job`."""
        device.use_default()
        folder = RunFolder(store / self.digest)
        if not folder.config_file.is_file():
            folder = folders.create(store, self.config, self.digest)
        run = Run(folder)
        with closing(
            Trainer(
                folder,
                should_stop=should_stop,
                on_status=lambda s: on_progress(Progress(s.share_done, s.recent_return)),
            )
        ) as trainer:
            trainer.run()
            last = NamedPolicy(f"{folder.name}, last", trainer.last_policy, self.config.env_id)
            _test(run, last, should_stop)
        config = self.config
        finish.save(run, f"{config.preset}, seed {config.seed}, on {config.env_id}")


def _test(run: Run, last: NamedPolicy, should_stop: Callable[[], bool]) -> None:
    """Fly the chosen weights and the last ones from the test starts, on stock Gymnasium."""
    starts = TEST_STARTS[: run.config.training.test_episodes]
    if not starts:
        return
    chosen = policy_weights.facts_of(run.folder.best)
    with closing(Evaluator(run.config.env_id)) as evaluator:
        if not evaluations_of(run):
            flown = evaluations.evaluate_policy(run.policy, starts, evaluator=evaluator)
            evaluations.write_evaluations(run.folder.evaluation, [flown], chosen)
        if should_stop():
            raise Interrupted
        if not (run.path / LAST).is_file():
            flown = evaluations.evaluate_policy(last, starts, evaluator=evaluator)
            evaluations.write_evaluations(run.path / LAST, [flown], WeightsFacts())


@dataclass(frozen=True, slots=True)
class PidJob:
    """A PID's gains from a tuner, and their test flights."""

    tuning: Tuning

    @property
    def digest(self) -> str:
        """12 hex digits of all that decides the gains."""
        told = json.dumps(self.tuning.to_dict(), sort_keys=True)
        return "pid-" + hashlib.sha256(told.encode()).hexdigest()[:12]

    def is_done(self, store: Path) -> bool:
        """Whether the gains' test flights are there."""
        return (store / self.digest / "evaluation.json").is_file()

    def perform(
        self,
        store: Path,
        should_stop: Callable[[], bool],
        on_progress: Callable[[Progress], object],
    ) -> None:
        """Tune, then fly the test starts; see `Job`."""
        folder = store / self.digest
        folder.mkdir(parents=True, exist_ok=True)

        def told(share: float, best: float) -> None:
            on_progress(Progress(share, best))
            if should_stop():
                raise Interrupted

        found = tune(self.tuning, told)
        files.write_atomic(folder / "tuning.json", files.to_json(found.to_json()))
        files.write_atomic(folder / GAINS, found.to_toml())
        policy = lookup.load(str(folder / GAINS))
        flown = evaluations.evaluate_policy(policy, TEST_STARTS[: self.tuning.test_episodes])
        evaluations.write_evaluations(folder / "evaluation.json", [flown], WeightsFacts())
