import csv
import re

import pytest

from finished_runs import write_run
from touchdown.config import toml
from touchdown.core.errors import UserError
from touchdown.report.study_page import write_study_report
from touchdown.studies import study_file
from touchdown.studies.claim_tests import Near
from touchdown.studies.claims import Claim
from touchdown.studies.plan import Factor, Level, Study, levels_of
from touchdown.studies.store import open_store

PRESETS = ("pilot", "dqn", "target-dqn", "vector-dqn", "double-dqn", "qr-dqn", "pqn")


def page_of(study, folder, *, returns_of=None, leave_out=lambda _: False, **written):
    store = open_store(folder / "results", make=True)
    for planned in study.runs():
        if leave_out(planned):
            continue
        path = store.runs / planned.digest
        own = {"returns": returns_of(planned)} if returns_of else {}
        write_run(path, **written, **own)
        (path / "config.toml").write_text(toml.to_toml(planned.config))
    report = write_study_report(
        study, study.seeds, store, folder / "out", command="x", note="Mind the gap.", linked=False
    )
    return report.page


def test_levels_that_are_too_many_for_one_picture_are_each_drawn_beside_their_base(tmp_path):
    study = Study(name="many", factors=(Factor("preset", levels_of("preset", PRESETS)),), seeds=2)
    page = page_of(study, tmp_path)
    drawn = {path.stem for path in page.parent.glob("figures/*.png")}
    over = {f"many-over-training-{preset}" for preset in PRESETS}
    assert drawn == {"many", "many-reached", *over}
    legends = [
        re.findall(r"[a-z-]+, 2 seeds", path.with_suffix(".svg").read_text())
        for path in sorted(page.parent.glob("figures/many-over-training-*.png"))
    ]
    # `dqn` builds on a rung that the study does not have, so it is beside the study's own base
    bases = {
        "dqn": "pilot",
        "target-dqn": "dqn",
        "vector-dqn": "pilot",
        **dict.fromkeys(("double-dqn", "qr-dqn", "pqn"), "vector-dqn"),
    }
    beside = [[bases[each], each] if each in bases else [each] for each in sorted(PRESETS)]
    assert legends == [[f"{name}, 2 seeds" for name in names] for names in beside]
    text = page.read_text()
    assert "Mind the gap." in text
    assert (
        "during training: vector-dqn, double-dqn; n = 2 training seeds each; "
        "line: interquartile mean; band: its 95% bootstrap interval." in text
    )


def test_a_study_without_a_test_is_reported_on_validation_starts(tmp_path):
    study = Study(
        name="search",
        factors=(Factor("learning.gamma", levels_of("learning.gamma", [0.9, 0.99])),),
        seeds=2,
        changes={"training": {"test_episodes": 0}},
        metric="validation_return",
    )
    page = page_of(study, tmp_path, returns=None, recorded=False)
    text = page.read_text()
    assert "Validation return of the selected checkpoint" in text
    assert "none: runs are compared on validation starts" in text
    assert not re.search(r"\bnan\b", text)
    with (page.parent / "tables" / "search.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["validation_return"] for row in rows] == ["250.0"] * 4
    assert {row["best_return"] for row in rows} == {""}


def test_a_study_of_an_environment_with_small_returns_shows_their_decimals(tmp_path):
    study = Study(
        name="lake",
        base="tabular-q",
        factors=[Factor.of("learning.target", ["q-learning", "sarsa"])],
        seeds=6,
        claims=[Claim("Both find the way.", Near("sarsa", 0.7, 0.2))],
    )
    page = page_of(study, tmp_path, returns=(0.5, 0.75), recorded=False)
    text = page.read_text()
    assert "sarsa: median 0.62 [0.62, 0.62], 6 seeds, against 0.7 ± 0.2" in text
    assert {path.stem for path in page.parent.glob("figures/*.png")} == {
        "lake",
        "lake-over-training",
        "lake-reached",
    }


def test_a_report_that_cannot_be_written_leaves_no_figures_behind(tmp_path, monkeypatch):
    study = Study(name="one", factors=(Factor("preset", levels_of("preset", ["pilot"])),), seeds=1)

    def full(*_args: object) -> None:
        raise UserError("index.html: cannot be written: No space left on device")

    monkeypatch.setattr("touchdown.report.output.write_page", full)
    with pytest.raises(UserError, match="No space left"):
        page_of(study, tmp_path, recorded=False)
    assert [path.name for path in tmp_path.iterdir()] == ["results"]


def three_factors(**changes):
    factors = (
        Factor("algorithm", levels_of("preset", ["vector-dqn", "double-dqn"])),
        Factor(
            "environment",
            (
                Level("stock"),
                Level("windy", {"env_id": "touchdown/LunarLanderWindy-v3"}),
            ),
        ),
        Factor("settings", levels_of("learning.gamma", [0.9, 0.99])),
    )
    return Study(name="sensitive", factors=factors, **changes)


def test_a_study_of_three_factors_shows_how_much_settings_for_each_environment_matter(tmp_path):
    def returns_of(planned):
        algorithm, environment, gamma = planned.cell.labels
        # double-dqn wants another gamma in the wind, and vector-dqn does not
        wanted = "0.9" if (algorithm, environment) == ("double-dqn", "windy") else "0.99"
        return [100.0 if gamma == wanted else 50.0, 60.0 + planned.seed]

    page = page_of(three_factors(seeds=3), tmp_path, returns_of=returns_of)
    assert {path.name for path in page.parent.glob("figures/*.png")} == {"sensitive.png"}
    text = page.read_text()
    assert "Sensitivity to settings, by algorithm" in text
    with (page.parent / "tables" / "sensitive-sensitivity.csv").open() as file:
        rows = list(csv.DictReader(file))
    found = {(row["level"], row["dimensionality"]) for row in rows}
    assert found == {("vector-dqn", "0"), ("double-dqn", "1")}
    gains = {row["level"]: float(row["sensitivity"]) for row in rows}
    assert gains["vector-dqn"] == 0
    assert gains["double-dqn"] > 0.3


def test_sensitivity_is_of_the_seeds_that_every_cell_has_and_claims_name_cells_by_three_labels(
    tmp_path,
):
    claim = Claim("It lands in the wind.", Near("double-dqn · windy · 0.99", 250, 20))
    study = three_factors(seeds=3, claims=(claim,))
    page = page_of(
        study, tmp_path, leave_out=lambda run: run.cell.labels[1] == "windy" and run.seed == 1
    )
    assert "n = 2 training seeds" in page.read_text()
    assert "4 of 24 runs are not done yet" in page.read_text()
    tables = page.parent / "tables"
    with (tables / "sensitive-sensitivity.csv").open() as file:
        assert {row["seed"] for row in csv.DictReader(file)} == {"0", "2"}
    with (tables / "claims.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert row["seeds"] == "2"
    # cells of other environments are not compared with the base
    with (tables / "sensitive-levels.csv").open() as file:
        assert {row["difference"] for row in csv.DictReader(file)} == {""}


def test_a_study_of_three_factors_comes_back_from_its_file(tmp_path):
    study = three_factors(seeds=3)
    path = tmp_path / "sensitive.toml"
    path.write_text(study_file.to_toml(study))
    assert study_file.from_toml(path) == study


def test_one_seed_shows_no_sensitivity(tmp_path):
    page = page_of(three_factors(seeds=1), tmp_path)
    assert "in every cell: 1; sensitivity needs at least 2" in page.read_text()
    assert not list(page.parent.glob("figures/*.png"))
