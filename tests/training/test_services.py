"""W&B offline and MLflow into a local SQLite file, through their own readers; no network."""

import io
import json
import socket
import subprocess
import sys
from collections import defaultdict
from collections.abc import Generator
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest
from rich.console import Console

import touchdown
from small_configs import lake
from touchdown.config.toml import to_dict
from touchdown.core import files, installation
from touchdown.core.errors import UserError
from touchdown.runs import folder as folders
from touchdown.training import services
from touchdown.training.listeners import Listeners

# MLflow's own queries, which SQLAlchemy 2.1 calls outdated
pytestmark = pytest.mark.filterwarnings("ignore:The ``noload`` loader strategy:DeprecationWarning")


class Logged(NamedTuple):
    """A run that two services hear of, stopped by a listener and resumed."""

    run: touchdown.Run
    folder: Path
    stopped: str
    shown: str
    """By the resumed one."""


class Stop:
    """Raises an exception when it is told for the thirtieth time."""

    told = 0

    def log(self, _step, _scalars) -> None:
        self.told += 1
        if self.told == 30:
            raise RuntimeError("enough")

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def no_server(tmp_path_factory) -> Generator[Path]:
    """Where the services keep their files; any connection to W&B or through a proxy fails."""
    folder = tmp_path_factory.mktemp("services")
    with socket.create_server(("127.0.0.1", 0)) as server, pytest.MonkeyPatch.context() as patch:
        address = f"http://127.0.0.1:{server.getsockname()[1]}"
        for name in ("WANDB_BASE_URL", "HTTP_PROXY", "HTTPS_PROXY", "http_proxy", "https_proxy"):
            patch.setenv(name, address)
        for name in ("NO_PROXY", "no_proxy", "WANDB_PROJECT", "MLFLOW_EXPERIMENT_NAME"):
            patch.delenv(name, raising=False)
        patch.setenv("WANDB_MODE", "offline")
        patch.setenv("WANDB_DIR", str(folder))
        patch.setenv("MLFLOW_TRACKING_URI", f"sqlite:///{folder}/mlflow.db")
        yield folder
        server.settimeout(0)
        with suppress(BlockingIOError):  # nobody has called
            caller, _ = server.accept()
            with caller:
                caller.settimeout(10)
                pytest.fail(f"called: {caller.recv(200)}")
    import_module("wandb").teardown()


@pytest.fixture
def client(no_server):  # noqa: ARG001 - sets the store
    """Of MLflow's store. Its import takes seconds, so it is not at the top."""
    return import_module("touchdown.training.mlflow_logger").MlflowClient()


@pytest.fixture(scope="module")
def logged(no_server) -> Logged:
    base = lake(seed=3)
    config = replace(
        base,
        training=replace(base.training, checkpoint_seconds=0.0, metrics_period=10, test_episodes=0),
    )
    where = {"runs_dir": no_server / "runs", "logger": ("wandb", "mlflow")}
    with pytest.raises(UserError) as stopped:
        touchdown.train(config, name="run", listeners=[Stop()], **where)
    console = Console(record=True, width=1_000, file=io.StringIO())
    run = touchdown.resume("run", console=console, **where)
    return Logged(run, no_server, str(stopped.value), console.export_text())


def scalars_of(run: touchdown.Run) -> dict[str, set[tuple[int, float]]]:
    """Of a run's own records, those that a line of a file has, as (step, value) by tag."""
    found = defaultdict(set)
    for row in files.read_jsonl(run.folder.episodes):
        found["rollout/ep_rew"].add((row["observations"], row["episode_return"]))
        found["rollout/ep_len"].add((row["observations"], row["steps"]))
    for row in files.read_jsonl(run.folder.updates):
        found["train/loss"].add((row["observations"], row["loss"]))
    for row in files.read_jsonl(run.folder.validations):
        found["eval/mean_reward"].add((row["observations"], row["mean_return"]))
    return dict(found)


def wandb_records(path: Path) -> dict[str, list[dict]]:
    """What W&B's own reader finds in a file, by the kind of record."""
    done = subprocess.run(
        [sys.executable, "-m", "wandb", "leet", "inspect", "--json", str(path)],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    found = defaultdict(list)
    for line in done.stdout.splitlines():
        record = json.loads(line)
        found[record["type"]].append(record[record["type"]])
    return found


def test_wandb_has_each_scalar_in_one_run_of_two_parts(logged):
    parts = sorted(logged.folder.glob("wandb/offline-run-*/*.wandb"))
    assert len(parts) == 2
    read = [wandb_records(part) for part in parts]
    runs = [records["run"][0] for records in read]
    run_id = services.read_logger_runs(logged.run.folder.loggers).run_ids["wandb"]
    assert [run["run_id"] for run in runs] == [run_id, run_id]
    assert {(run["project"], run["display_name"]) for run in runs} == {("touchdown", "run")}
    assert runs[0]["tags"] == ["tabular-q", "FrozenLake-v1"]
    settings = runs[0]["config"]["update"]
    config = logged.run.config
    for name, value in to_dict(config).items():
        assert settings[name] == json.loads(json.dumps(value))
    assert (settings["seed"], settings["digest"]) == (3, config.digest)
    found = defaultdict(set)
    for records in read:
        assert {"name": "env_steps", "options": {"defined": True}} in records["metric"]
        assert [each["exit_code"] for each in records["exit"]] == [0]  # closed
        for row in (record["item"] for record in records["history"]):
            for tag, value in row.items():
                found[tag].add((row["env_steps"], value))
    expected = scalars_of(logged.run)
    assert {tag: found[tag] for tag in expected} == expected


def test_mlflow_has_each_scalar_in_one_run(logged, client):
    run_id = services.read_logger_runs(logged.run.folder.loggers).run_ids["mlflow"]
    experiment = client.get_experiment_by_name("touchdown")
    (run,) = client.search_runs([experiment.experiment_id])
    assert (run.info.run_id, run.info.run_name, run.info.status) == (run_id, "run", "FINISHED")
    config = logged.run.config
    assert run.data.params["training.max_env_steps"] == "300"
    assert run.data.params["seed"] == run.data.tags["seed"] == "3"
    sections = [value for value in to_dict(config).values() if isinstance(value, dict)]
    fields = sum(map(len, sections)) + len(to_dict(config)) - len(sections)
    assert len(run.data.params) == fields
    assert (run.data.tags["preset"], run.data.tags["digest"]) == ("tabular-q", config.digest)
    expected = scalars_of(logged.run)
    found = {
        tag: {(each.step, each.value) for each in client.get_metric_history(run_id, tag)}
        for tag in expected
    }
    assert found == expected


def test_the_places_are_shown_and_so_is_how_to_continue(logged):
    run_ids = services.read_logger_runs(logged.run.folder.loggers).run_ids
    newest = max(logged.folder.glob("wandb/offline-run-*"))
    assert logged.shown.splitlines()[:2] == [
        f"logger wandb: {newest}",
        f"logger mlflow: sqlite:///{logged.folder}/mlflow.db, run {run_ids['mlflow']}",
    ]
    assert logged.stopped.startswith("listener Stop: log raised RuntimeError: enough; ")
    assert logged.stopped.endswith(
        f"touchdown train --resume run --runs-dir {logged.folder / 'runs'} --logger wandb mlflow"
    )


def test_many_scalars_come_to_mlflow_in_few_calls(client, tmp_path, monkeypatch):
    folder = folders.create(tmp_path, lake(), "many")
    calls = []
    real = type(client).log_batch

    def counted(self, run_id, metrics=(), **options) -> None:
        calls.append(len(metrics))
        real(self, run_id, metrics=metrics, **options)

    with Listeners([]) as told:
        services.open_loggers(["mlflow"], folder, told)
        monkeypatch.setattr(type(client), "log_batch", counted)
        for step in range(3):
            told.log(step, {f"tag/{number}": float(step) for number in range(400)})
    assert calls == [1_000, 200]
    run_id = services.read_logger_runs(folder.loggers).run_ids["mlflow"]
    history = client.get_metric_history(run_id, "tag/399")
    assert [(each.step, each.value) for each in history] == [(0, 0.0), (1, 1.0), (2, 2.0)]


def test_a_run_that_mlflow_does_not_have_begins_anew_under_a_given_experiment(
    client, tmp_path, monkeypatch
):
    monkeypatch.setenv("MLFLOW_EXPERIMENT_NAME", "mine")
    folder = folders.create(tmp_path, lake(), "lost")
    kept = services.LoggerRuns(run_ids={"mlflow": "0" * 32, "wandb": "abc"})
    folder.loggers.write_text(files.to_json(kept))
    with Listeners([]) as told:
        services.open_loggers(["mlflow"], folder, told)
    run_ids = services.read_logger_runs(folder.loggers).run_ids
    assert run_ids["wandb"] == "abc"
    run = client.get_run(run_ids["mlflow"])
    assert client.get_experiment(run.info.experiment_id).name == "mine"


def test_wandb_that_refuses_is_one_line_that_says_why(tmp_path, monkeypatch):
    wandb = import_module("wandb")
    wandb.teardown()  # it reads the environment once
    monkeypatch.setenv("WANDB_MODE", "online")
    monkeypatch.setenv("WANDB_BASE_URL", "http://127.0.0.1:9")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    monkeypatch.delenv("WANDB_API_KEY", raising=False)
    with pytest.raises(UserError) as refused:
        touchdown.train(lake(), runs_dir=tmp_path, name="run", logger="wandb")
    assert str(refused.value) == (
        "logger 'wandb': cannot be opened: No API key configured. Use `wandb login` to log in; "
        "the last saved state is intact; resume with: touchdown train --resume run --runs-dir "
        f"{tmp_path} --logger wandb"
    )
    wandb.teardown()


def test_mlflow_that_refuses_is_one_line_that_says_why(tmp_path, monkeypatch):
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://127.0.0.1:9")
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    folder = folders.create(tmp_path, lake(), "run")
    said = r"^logger 'mlflow': cannot be opened: API request to http://127.0.0.1:9/.* failed"
    with pytest.raises(UserError, match=said) as refused, Listeners([]) as told:
        services.open_loggers(["mlflow"], folder, told)
    assert "\n" not in str(refused.value)
    assert not folder.loggers.exists()


@pytest.mark.parametrize(("name", "module"), [("wandb", "wandb"), ("mlflow", "mlflow.entities")])
def test_a_service_that_is_not_installed_is_refused_before_a_folder_is_made(
    tmp_path, monkeypatch, name, module
):
    monkeypatch.delitem(sys.modules, f"touchdown.training.{name}_logger", raising=False)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(UserError) as refused:
        touchdown.train(lake(), runs_dir=tmp_path / "runs", logger=name)
    assert str(refused.value) == (
        f"logger {name!r}: needs {name}, which is not installed; "
        f"install it: {installation.command_for(name)}"
    )
    assert not list(tmp_path.iterdir())


def test_a_broken_record_of_the_services_runs_is_named(tmp_path):
    folder = folders.create(tmp_path, lake(), "run")
    folder.loggers.write_text('{"format_version": 1, "run_ids": {"wandb": 7}}')
    with pytest.raises(UserError, match=r"loggers.json: .*wandb") as refused, Listeners([]) as told:
        services.open_loggers(["wandb"], folder, told)
    assert "\n" not in str(refused.value)


def test_no_service_hears_of_a_run_that_another_process_trains(tmp_path):
    folder = folders.create(tmp_path, lake(), "run")
    with (
        folders.lock(folder),
        pytest.raises(UserError, match="another process is training it"),
        Listeners([]) as told,
    ):
        services.open_loggers(["mlflow"], folder, told)
    assert not folder.loggers.exists()


def test_a_name_given_twice_is_one_logger():
    assert services.check_names("mlflow") == ("mlflow",)
    assert services.check_names(["mlflow", "mlflow"]) == ("mlflow",)
    assert services.check_names(None) == ()


@pytest.mark.parametrize("wrong", ["tensorbord", ("mlflow", "W&B"), 5])
def test_an_unknown_name_is_refused_with_the_known_ones(wrong):
    with pytest.raises(UserError, match="must be one of wandb, mlflow"):
        services.check_names(wrong)
