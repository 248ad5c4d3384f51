import io
import json

import pytest
from rich.console import Console

from finished_runs import write_run
from single_changes import is_refused_in_a_line, single_changes
from touchdown.config.config import Config
from touchdown.config.toml import to_toml
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.evaluation.table import evaluation_table
from touchdown.runs import provenance
from touchdown.runs.folder import RunFolder
from touchdown.runs.rows import UpdateRow
from touchdown.runs.run import Run, describe, evaluations_of, list_facts, run_facts
from touchdown.studies.run_result import read_run


@pytest.fixture
def run(tmp_path):
    write_run(tmp_path / "runs" / "abc", last=(50.0, 150.0))
    folder = RunFolder(tmp_path / "runs" / "abc")
    folder.config_file.write_text(to_toml(Config()))
    folder.provenance.write_text(files.to_json(provenance.provenance_of(Config())))
    return Run(folder)


def read_all(run):
    """All that is shown of a run."""
    run_facts(run)
    Console(file=io.StringIO()).print(evaluation_table(evaluations_of(run)))
    provenance.read_provenance(run.folder.provenance)
    read_run(run.path, (), 0)


@pytest.mark.parametrize("name", ["evaluation.json", "last.json", "provenance.json"])
def test_one_wrong_value_in_a_record_is_reported_in_one_line(run, name):
    path = run.path / name
    record = json.loads(path.read_text())
    refused = 0
    for other in single_changes(record):
        path.write_text(json.dumps(other))
        refused += is_refused_in_a_line(lambda: read_all(run), str(path))
    assert refused > 100
    path.write_text(json.dumps(record))
    read_all(run)


@pytest.mark.parametrize("name", ["episodes.jsonl", "validations.jsonl"])
def test_one_wrong_value_in_a_line_is_reported_in_one_line(run, name):
    path = run.path / name
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    refused = 0
    for at in (0, len(rows) - 1):
        for other in single_changes(rows[at]):
            lines = [json.dumps(other if index == at else row) for index, row in enumerate(rows)]
            path.write_text("\n".join(lines) + "\n")
            refused += is_refused_in_a_line(lambda: read_all(run), f"{path}: ")
    assert refused > 80


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("episodes.jsonl", "", "episodes.jsonl: has no steps, but its run is finished"),
        ("validations.jsonl", "", "validations.jsonl: is empty, but its run is finished"),
        (
            "evaluation.json",
            '{"format_version": 2}',
            "format_version = 2: must be 1",
        ),
    ],
)
def test_a_finished_run_has_results(run, name, text, said):
    (run.path / name).write_text(text)
    with pytest.raises(UserError, match=said):
        read_run(run.path, (), 0)


def test_an_evaluation_without_episodes_is_refused(run):
    content = json.loads(run.folder.evaluation.read_text())
    content["pilots"][0]["episodes"] = []
    run.folder.evaluation.write_text(json.dumps(content))
    with pytest.raises(UserError, match=r"pilots\[0\]\.episodes = \[\]: must be 1 or more values"):
        evaluations_of(run)
    (facts,) = list_facts(run.path.parent)
    assert facts["status"] == "broken"
    content["pilots"] = []
    run.folder.evaluation.write_text(json.dumps(content))
    with pytest.raises(UserError, match=r"pilots = \[\]: must be 1 or more values"):
        evaluations_of(run)


def test_a_threshold_and_the_share_that_reaches_it_go_together(run):
    content = json.loads(run.folder.evaluation.read_text())
    content["pilots"][0]["summary"]["share_solved"] = None
    run.folder.evaluation.write_text(json.dumps(content))
    with pytest.raises(UserError, match=r"pilots\[0\]\.summary\.share_solved = None: must be a"):
        evaluations_of(run)


def test_a_run_in_short(run):
    facts = describe(run)
    assert (facts.name, facts.episodes, facts.env_steps, facts.seconds) == ("abc", 4, 4_000, 40)
    assert facts.test is not None
    assert facts.test.mean_return == 200
    assert list(run_facts(run)) == [
        "name", "status", "preset", "env_id", "seed", "config_digest",
        "episodes", "observations", "seconds", "test",
    ]  # fmt: skip
    assert run_facts(run)["test"]["iqm"]["value"] == facts.test.iqm.value


def test_the_metrics_of_an_update_are_stored_with_its_counts():
    row = UpdateRow(update=50, env_steps=100, metrics={"loss": 0.5, "mean_q": -1.0})
    assert list(row.to_json().items()) == [
        ("update", 50), ("observations", 100), ("loss", 0.5), ("mean_q", -1.0),
    ]  # fmt: skip
