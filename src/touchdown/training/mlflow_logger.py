"""Logs scalars to MLflow; importing this module needs the extra `mlflow`."""

import os
import time
from collections.abc import Mapping
from typing import cast

# MLflow sends usage data to its developers as soon as it is imported, even for a local store
os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")

from mlflow.entities import Metric, Param
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.core.version import __version__

_EXPERIMENT = "touchdown"
_MOST_METRICS, _MOST_PARAMS = 1_000, 100  # the most that MLflow accepts in one request
_SECONDS_BETWEEN_CALLS = 5.0  # a request takes milliseconds, a training step microseconds


class MlflowLogger:
    """An MLflow run, written through the client, so that the user's own active run is not affected.

    MLflow's own environment variables are respected, such as MLFLOW_TRACKING_URI and
    MLFLOW_EXPERIMENT_NAME.

    Args:
        name: name of the run.
        config: logged completely, as parameters such as `learning.gamma`.
        run_id: id of the run to continue; None, or an id that does not exist, starts a new run.

    Raises:
        MlflowException: MLflow refuses, for example because its server does not answer.
    """

    def __init__(self, name: str, config: Config, run_id: str | None) -> None:
        self._metrics: list[Metric] = []
        self._last_call = time.monotonic()
        self._client = MlflowClient()
        self.run_id = self._continued(run_id) or self._begun(name, config)

    @property
    def where(self) -> str:
        """The run's page, or its store if that has none."""
        uri = cast(str, self._client.tracking_uri)
        if uri.startswith(("http://", "https://")):
            return f"{uri.rstrip('/')}/#/experiments/{self._experiment_id}/runs/{self.run_id}"
        return f"{uri}, run {self.run_id}"

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Buffer scalars for the next request to MLflow, at most a few seconds later."""
        now = int(time.time() * 1_000)
        self._metrics += [Metric(tag, value, now, step) for tag, value in scalars.items()]
        due = time.monotonic() - self._last_call > _SECONDS_BETWEEN_CALLS
        if due or len(self._metrics) >= _MOST_METRICS:
            self._send()

    def close(self) -> None:
        """Send the remaining scalars, and mark the run as finished."""
        self._send()
        self._client.set_terminated(self.run_id)

    def _send(self) -> None:
        while self._metrics:
            self._client.log_batch(self.run_id, metrics=self._metrics[:_MOST_METRICS])
            del self._metrics[:_MOST_METRICS]
        self._last_call = time.monotonic()

    def _continued(self, run_id: str | None) -> str | None:
        """The existing run, set to running again; None if there is no such run."""
        if run_id is None:
            return None
        try:
            run = self._client.get_run(run_id)
        except MlflowException as error:
            if error.error_code != "RESOURCE_DOES_NOT_EXIST":
                raise
            return None
        self._experiment_id = run.info.experiment_id
        self._client.update_run(run_id, status="RUNNING")
        return run_id

    def _begun(self, name: str, config: Config) -> str:
        """A new run, with the config as its parameters."""
        experiment = os.environ.get("MLFLOW_EXPERIMENT_NAME") or _EXPERIMENT
        found = self._client.get_experiment_by_name(experiment)
        self._experiment_id = (
            found.experiment_id if found else self._client.create_experiment(experiment)
        )
        tags = {
            "preset": config.preset,
            "seed": str(config.seed),
            "env_id": config.env_id,
            "digest": config.digest,
            "touchdown": __version__,
        }
        run_id = self._client.create_run(self._experiment_id, run_name=name, tags=tags).info.run_id
        params = [Param(name, str(value)) for name, value in flat(config).items()]
        for first in range(0, len(params), _MOST_PARAMS):
            self._client.log_batch(run_id, params=params[first : first + _MOST_PARAMS])
        return run_id
