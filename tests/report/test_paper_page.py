import csv
import re
import shutil

import pytest

from finished_runs import evaluation, record, write_run
from touchdown.core import files
from touchdown.evaluation.evaluation import write_evaluations
from touchdown.policies.facts import WeightsFacts
from touchdown.report.builder import STEPS
from touchdown.report.paper_page import write_paper_report
from touchdown.runs.folder import RunFolder
from touchdown.studies import paper
from touchdown.studies.claim_tests import KINDS
from touchdown.studies.store import Store, open_store
from touchdown.studies.tuners import Tuned
from touchdown.studies.work import GAINS
from touchdown.training.pid_tuning import HAND_PICKED

PLANTED = {"dqn": 0, "target-dqn": 170, "preferential-dqn": 172, "paper-best": 240}
"""Mean returns of the ladder's rungs."""
SEEDS = 12
"""Of the ladder and of the PID; the others have fewer, and no verdicts."""


def mean_of(study: str, label: str, seed: int) -> float:
    wobble = 4.0 * ((seed * 7) % 5 - 2)
    return PLANTED.get(label, 150.0) + wobble if study == "ladder" else 150.0 + wobble


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """All of the paper's runs at the quick scale, made up, with one that failed, one not done."""
    made = open_store(tmp_path_factory.mktemp("paper") / "results", make=True)
    for name, study in paper.studies("quick").items():
        for planned in study.runs(SEEDS if name == "ladder" else 2):
            if (made.runs / planned.digest).exists():
                continue
            mean = mean_of(name, planned.cell.labels[0], planned.seed)
            path = made.runs / planned.digest
            write_run(path, (mean - 20, mean + 20), (mean - 40, mean))
            record(RunFolder(path), height=1 + planned.seed % 5 / 10)
    for job in paper.pid_jobs("quick", SEEDS):
        folder = made.runs / job.digest
        folder.mkdir()
        found = Tuned(HAND_PICKED, 215.0, (100.0, 215.0))
        files.write_atomic(folder / "tuning.json", files.to_json(found.to_json()))
        files.write_atomic(folder / GAINS, found.to_toml())
        better = 0 if job.tuning.tuner == "hand" else 50
        returns = [170.0 + better + job.tuning.seed, 180.0 + better]
        write_evaluations(folder / "evaluation.json", [evaluation(returns)], WeightsFacts())
        record(RunFolder(folder))
    for job, mean in zip(paper.baseline_jobs(), (222.0, -190.0, 250.0), strict=True):
        folder = RunFolder(made.runs / job.digest)
        folder.path.mkdir()
        record(folder, height={"pid": 2.0, "random": 9.0, "heuristic": 2.3}[job.name])
        write_evaluations(folder.evaluation, [evaluation([mean])], WeightsFacts())
    broken, missing = paper.studies("quick")["size"].runs()[:2]
    made.note_failure(broken.digest, "it diverged")
    for each in (broken, missing):
        (made.runs / each.digest / "learning-curve.png").unlink()
    return made


@pytest.fixture(scope="module")
def written(store, tmp_path_factory):
    """The page of all of them."""
    out = tmp_path_factory.mktemp("page")
    steps: list[str] = []
    report = write_paper_report(
        "quick", SEEDS, store, out, command="make it so", linked=False, on_step=steps.append
    )
    return report, steps


def test_every_topic_has_a_section_its_figures_and_its_table(written):
    report, steps = written
    topics = paper.topics("quick")
    text = report.page.read_text()
    assert re.findall(r'<section id="([a-z-]+)">', text) == list(topics)
    assert steps == [name for name in topics for _ in range(STEPS)]
    folder = report.page.parent
    for name in topics:
        for suffix in ("svg", "png"):
            assert (folder / "figures" / f"{name}.{suffix}").stat().st_size > 1_000
    studies = {topic.study.name for topic in topics.values() if topic.study}
    tables = {path.stem for path in (folder / "tables").iterdir()}
    levels = {f"{name}-levels" for name in topics if name not in ("alike", "pid")}
    assert tables == studies | levels | {"claims", "alike", "pid"}
    assert "make it so" in text


def test_the_quick_scale_has_evidence_on_every_claim_and_no_verdict(written):
    report, _ = written
    with (report.page.parent / "tables" / "claims.csv").open() as file:
        rows = list(csv.DictReader(file))
    claims = [claim for topic in paper.topics("quick").values() for claim in topic.claims]
    assert [row["claim"] for row in rows] == [claim.sentence for claim in claims]
    assert {row["verdict"] for row in rows} == {"preview"}
    assert {row["kind"] for row in rows} == set(KINDS)
    text = report.page.read_text()
    assert text.count('class="evidence"') == len(claims)
    assert f'<li class="preview"><b>{len(claims)}</b>' in text
    assert '<li class="holds"><b>' not in text
    assert "its clocks are not the paper&#39;s, so it decides no claim" in text


def test_the_summary_has_every_claim_and_every_figure_for_where_html_is_not_shown(written):
    report, _ = written
    folder = report.page.parent
    text = (folder / "summary.md").read_text()
    claims = [claim for topic in paper.topics("quick").values() for claim in topic.claims]
    assert all(f"| {claim.sentence} | {claim.section} | **" in text for claim in claims)
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", text)
    assert len(pictures) >= len(paper.topics("quick"))
    assert all((folder / picture).is_file() for picture in pictures)
    assert "](index.html)" in text
    assert "- made by: `make it so`" in text


def test_what_failed_and_what_is_missing_is_said(written):
    report, _ = written
    results = report.results["size"]
    assert (len(results.failed), results.missing) == (1, 71)
    text = report.page.read_text()
    assert "71 of 96 runs are not done yet." in text
    assert "1 runs failed: it diverged." in text


def test_the_best_run_of_each_section_is_filmed_once_on_a_page(written):
    report, _ = written
    films = {path.stem for path in (report.page.parent / "figures").glob("*.gif")}
    # the best runs of the other sections are the same, as studies share their bases
    assert films == {"ladder", "hover", "pid"}


def test_distances_come_from_recorded_paths(written):
    report, _ = written
    # at heights of 1 to 1.4, 2 and 9 half viewports
    first, second = report.decisions["alike"]
    assert "medians to random: 52.333, to the PID: 5.667" in first.evidence
    assert first.p_raw < 0.05
    assert "0 of" in second.evidence
    with (report.page.parent / "tables" / "alike.csv").open() as file:
        rows = list(csv.DictReader(file))
    levels = [cell.name for cell in paper.studies("quick")["ladder"].cells()]
    assert {row["level"] for row in rows} == {*levels, "heuristic"}
    assert float(rows[-1]["to_pid"]) == pytest.approx(0.3 * 20 / 3, abs=1e-5)
    with (report.page.parent / "tables" / "pid.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 4 * SEEDS


def test_the_ladder_is_shown_beside_the_baselines(written):
    report, _ = written
    drawing = (report.page.parent / "figures" / "ladder.svg").read_text()
    assert "PID" in drawing
    assert "random" in drawing


def test_runs_without_recorded_flights_have_a_page_without_films_and_distances(store, tmp_path):
    old = Store(tmp_path / "old")
    shutil.copytree(store.path, old.path)
    for path in (*old.runs.glob("*/flights.safetensors"), *old.runs.glob("*/paths.safetensors")):
        path.unlink()
    for job in paper.baseline_jobs():
        shutil.rmtree(old.runs / job.digest)
    report = write_paper_report(
        "quick",
        None,
        old,
        tmp_path / "out",
        names=["ladder", "alike"],
        command="x",
        note="To record flights, make it so.",
        linked=False,
    )
    text = report.page.read_text()
    assert re.findall(r'<section id="([a-z-]+)">', text) == ["ladder"]
    assert "data:image/gif" not in text
    assert "To record flights, make it so." in text
    assert len(report.decisions["ladder"]) == len(paper.topics("quick")["ladder"].claims)


def test_a_topic_without_runs_is_left_out(tmp_path):
    store = open_store(tmp_path / "results", make=True)
    report = write_paper_report("quick", None, store, tmp_path / "out", command="x", linked=False)
    assert report.decisions == {}
    assert not list((tmp_path / "out" / "tables").iterdir())
