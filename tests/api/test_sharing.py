import json
import math

import pytest

from finished_runs import write_run, write_validations
from touchdown.api import studies
from touchdown.cli import app
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.runs.provenance import Provenance
from touchdown.studies import store as stores
from touchdown.studies import study_file
from touchdown.studies.plan import Factor, Study
from touchdown.studies.results import read_study

STUDY = Study(
    name="gammas",
    base="cartpole",
    seeds=2,
    factors=[Factor.of("learning.gamma", [0.9, 0.99])],
)


@pytest.fixture
def made(tmp_path):
    """A study with three of its four runs, which somebody else will have."""
    store = stores.open_store(tmp_path / "there", make=True)
    file = tmp_path / "gammas.toml"
    file.write_text(study_file.to_toml(STUDY))
    for number, planned in enumerate(STUDY.runs()[:3]):
        path = store.runs / planned.digest
        write_run(path, (100.0, 180.0 + number), (0.0, 300.0))
        write_validations(path, [(0, 0.0), (3_500, 100.0)])  # it never reaches its threshold
        origin = Provenance(git_commit="abc", cpu="a processor", simd="avx2", seed=planned.seed)
        files.write_atomic(path / "provenance.json", files.to_json(origin))
    return file, store


def numbers_of(store):
    known = {}
    for run in read_study(STUDY, 2, store).runs:
        values = {name: getattr(run, name) for name in type(run).__slots__ if name != "path"}
        known[run.name] = json.dumps(values, default=str)  # in which a NaN equals itself
    return known


def test_a_study_goes_on_elsewhere_with_the_runs_that_are_missing(made, tmp_path, capsys):
    file, there = made
    out = tmp_path / "results.jsonl"
    argv = ["study", "export", str(file), "--out", str(out), "--results-dir", str(there.path)]
    app.main(argv)
    here = tmp_path / "here"
    app.main(["study", "import", str(out), "--results-dir", str(here)])
    assert "3 runs added, 0 were there already" in capsys.readouterr().out
    store = stores.open_store(here)
    assert numbers_of(store) == numbers_of(there)
    run = read_study(STUDY, 2, store).runs[0]
    assert math.isnan(run.overestimation)
    assert run.env_steps_to_solved == run.seconds_to_solved == math.inf
    estimated = studies.find_study(str(file))
    assert [job.digest for job in store.missing(estimated.jobs)] == [STUDY.runs()[3].digest]
    (progress,) = studies.study_status(str(file), results_dir=here)
    assert (progress.done, progress.runs) == (3, 4)
    report = studies.study_report(str(file), results_dir=here)
    assert "1 of 4 runs are not done yet" in report.page.read_text()
    again = tmp_path / "again.jsonl"
    assert studies.export_results(str(file), again, results_dir=here) == 3
    assert again.read_bytes() == out.read_bytes()


def test_runs_that_are_here_already_stay(made, tmp_path):
    file, there = made
    out = tmp_path / "results.jsonl"
    studies.export_results(str(file), out, results_dir=there.path)
    assert studies.import_results(out, results_dir=there.path) == studies.Imported(0, 3)
    assert not there.imported_file.exists()
    here = tmp_path / "here"
    assert studies.import_results(out, results_dir=here).added == 3
    before = (here / "imported.jsonl").read_bytes()
    assert studies.import_results(out, results_dir=here) == studies.Imported(0, 3)
    assert (here / "imported.jsonl").read_bytes() == before


PARTS = {"ends": [1.0], "hovering": [0.0], "returns": [0.0], "steps": [1.0]}


def altered(text, **fields):
    first, second, *rest = text.splitlines()
    line = json.loads(second) | fields
    return "\n".join((first, json.dumps(line), *rest)) + "\n"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda _: "", "line 1"),
        (lambda _: "a,b\n1,2\n", "line 1: not JSON"),
        (lambda text: text.replace('"format_version": 1', '"format_version": 7'), "format_version"),
        (lambda text: text[:-20], "truncated"),
        (
            lambda text: altered(text, run="../../etc"),
            "line 2: run = '../../etc': must be 12 hex digits",
        ),
        (lambda text: altered(text, env_steps=-1), "line 2: env_steps"),
        (lambda text: altered(text, speed=3), "line 2"),
        (lambda text: altered(text, validations=[[], []]), "line 2: validations: must be as many"),
        (lambda text: altered(text, validations=[[2, 1], [0, 0]]), "line 2: validations: must"),
        (lambda text: altered(text, parts=PARTS | {"steps": []}), "line 2: parts.steps: must be"),
        (lambda text: text.partition("\n")[2], "line 1"),
        (lambda text: text.rpartition('{"run"')[0], "has 2 of 3 runs; it is truncated"),
    ],
)
def test_a_damaged_file_is_refused_and_changes_nothing(change, said, made, tmp_path, capsys):
    file, there = made
    out = tmp_path / "results.jsonl"
    studies.export_results(str(file), out, results_dir=there.path)
    out.write_text(change(out.read_text()))
    here = tmp_path / "here"
    with pytest.raises(SystemExit, match="2"):
        app.main(["study", "import", str(out), "--results-dir", str(here)])
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"touchdown: {out}")
    assert said in line
    assert not here.exists()


def test_a_line_without_a_number_is_refused(made, tmp_path):
    file, there = made
    out = tmp_path / "results.jsonl"
    studies.export_results(str(file), out, results_dir=there.path)
    out.write_text(altered(out.read_text(), numbers={"best_return": 1.0}))
    with pytest.raises(UserError, match="numbers: 'last_return' is missing"):
        studies.import_results(out, results_dir=tmp_path / "here")
    studies.export_results(str(file), out, force=True, results_dir=there.path)
    numbers = json.loads(out.read_text().splitlines()[1])["numbers"] | {"area": None}
    out.write_text(altered(out.read_text(), numbers=numbers))
    with pytest.raises(UserError, match="numbers: area = None: must be a number"):
        studies.import_results(out, results_dir=tmp_path / "here")


def test_a_line_of_an_earlier_version_lacks_what_was_added_later(made, tmp_path):
    file, there = made
    out = tmp_path / "results.jsonl"
    studies.export_results(str(file), out, results_dir=there.path)
    numbers = json.loads(out.read_text().splitlines()[1])["numbers"]
    assert numbers.pop("last_share_solved") == 0.5  # of 0 and 300, with a threshold between them
    out.write_text(altered(out.read_text(), numbers=numbers))
    here = tmp_path / "here"
    studies.import_results(out, results_dir=here)
    runs = read_study(STUDY, 2, stores.open_store(here)).runs
    assert [math.isnan(run.last_share_solved) for run in runs] == [True, False, False]


def test_a_study_without_finished_runs_has_nothing_to_export(made, tmp_path):
    file, _ = made
    empty = stores.open_store(tmp_path / "empty", make=True)
    with pytest.raises(UserError, match="none of its runs is done; start it with"):
        studies.export_results(str(file), tmp_path / "x.jsonl", results_dir=empty.path)
