import csv
from pathlib import Path

import pytest

from finished_runs import write_run
from touchdown.report.readings_page import write_readings_report
from touchdown.studies.multiverse import paper_distances, read_claims
from touchdown.studies.paper.readings import Reading, reading_studies, readings
from touchdown.studies.results import read_study
from touchdown.studies.store import Store, open_store

SEEDS = 10


def planted(reading: Reading, level: str, seed: int) -> float:
    """Means that are near the paper's where the time limit ends the episode, and 250 elsewhere."""
    wobble = 2.0 * ((seed * 7) % 5 - 2)
    if reading.by_axis["time limit"] == "bootstraps":
        return 250.0 + wobble
    paper = {"dqn": 20.0, "target-dqn": 170.0, "preferential-dqn": 199.0, "paper-best": 221.0}
    off = 0.0 if reading.by_axis["learner"] == "literal-2.5e-4" else 3.0
    return paper.get(level, 150.0) + off + wobble


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The ladder's runs in every reading but one, made up."""
    made = open_store(tmp_path_factory.mktemp("readings") / "results", make=True)
    for reading, studies in list(reading_studies("quick").items())[:-1]:
        (ladder,) = (study for study in studies if study.name.startswith("ladder."))
        for planned in ladder.runs(SEEDS):
            mean = planted(reading, planned.cell.labels[0], planned.seed)
            shown = (mean - 20, mean + 20)
            # what is not compared in a reading is far off
            best, last = (shown, (-400.0, -400.0)) if reading.is_preset else ((400.0, 400.0), shown)
            path = made.runs / planned.digest
            if not path.exists():
                write_run(path, best, last, recorded=False)
    return made


@pytest.fixture(scope="module")
def page(store: Store, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    steps: list[str] = []
    out = tmp_path_factory.mktemp("page")
    report = write_readings_report(
        "quick", SEEDS, store, out, command="make it so", on_step=steps.append
    )
    return report.page, steps


def test_the_page_counts_in_how_many_readings_a_claim_holds_and_names_what_turns_it(page):
    path, steps = page
    text = path.read_text()
    assert steps == [reading.name for reading in readings()]
    assert "time limit: bootstraps 0%, ends 100%" in text
    assert (path.parent / "figures" / "verdicts.png").stat().st_size > 1_000
    assert "runs are not done yet" in text


def test_the_table_has_every_claim_in_every_reading_with_runs(page):
    path, _ = page
    with (path.parent / "tables" / "readings.csv").open() as file:
        rows = list(csv.DictReader(file))
    claim = "With a target network the return is about 170."
    found = {(row["learner"], row["time limit"]): row for row in rows if row["claim"] == claim}
    assert found["literal-1e-3", "ends"]["verdict"] == "holds"
    assert found["literal-1e-3", "ends"]["metric"] == "last_return"
    assert found["shipped", "ends"]["metric"] == "best_return"
    assert found["shipped", "bootstraps"]["verdict"] == "reached and exceeded"
    assert len([row for row in rows if row["claim"] == claim]) == 11
    shares = {
        row["learner"]: row["metric"] for row in rows if "is always above 200" in row["claim"]
    }
    literal = dict.fromkeys(("literal-1e-3", "literal-2.5e-4"), "last_share_solved")
    assert shares == {"shipped": "share_solved"} | literal


def test_the_nearest_reading_is_first(store):
    results = {
        study.name: read_study(study, SEEDS, store)
        for studies in reading_studies("quick").values()
        for study in studies
        if study.name.startswith("ladder.")
    }
    distances = paper_distances(results)
    assert len(distances) == 11
    nearest = distances[0].reading.by_axis
    assert (nearest["learner"], nearest["time limit"]) == ("literal-2.5e-4", "ends")
    assert distances[0].points == pytest.approx(0.0)
    assert distances[-1].points == pytest.approx((80 + 51 + 29) / 3)
    # where the positive reward is not varied, it cannot turn a claim
    topics = {each.topic.name: each for each in read_claims("quick", results, lambda _: None)}
    assert "positive reward" in [turn.axis for turn in topics["resaves"].turns]
    assert "positive reward" not in [turn.axis for turn in topics["discount"].turns]
    (always,) = (
        each
        for each in read_claims("quick", results, lambda _: None)
        if each.claim.sentence.startswith("Plain DQN ends below")
    )
    assert always.share == pytest.approx(5 / 11)
    assert always.turns[0].axis == "time limit"
    assert always.turns[0].spread == 1.0
