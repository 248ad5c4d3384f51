"""A run keeps the digest that it was stored under, so that its study finds it again."""

import csv
from pathlib import Path

import pytest

from touchdown.studies import paper, run_lines
from touchdown.studies.study_file import from_toml

ROOT = Path(__file__).parents[2]
FIRST = {
    "ace": "a493e980c9a4",
    "classic-control": "034709f468ff",
    "frugal": "a871eb8692d4",
    "presets": "f06942102590",
    "rungs": "bd27ae9dd28c",
    "search-paper-best": "8e1f8417d12f",
    "search-pilot": "87a2e38a8b7e",
    "search-quick": "bf99e8e4c988",
    "swift": "e9348d809c61",
}
"""The digest of each study file's first run."""
PUBLISHED = sorted(
    path
    for path in (ROOT / "docs/results/tables").glob("*.csv")
    if path.stem in paper.studies("full")
)


@pytest.mark.parametrize("name", FIRST)
def test_the_first_run_of_a_study_file_has_its_digest(name):
    assert from_toml(ROOT / "studies" / f"{name}.toml").runs()[0].digest == FIRST[name]


@pytest.mark.parametrize("table", PUBLISHED, ids=lambda path: path.stem)
def test_the_published_runs_of_the_paper_are_those_that_its_studies_plan(table):
    with table.open(encoding="utf-8") as file:
        published = [row["run"] for row in csv.DictReader(file)]
    study = paper.studies("full")[table.stem]
    planned = [run.digest for run in study.runs(study.looks[-1])]
    assert published == [digest for digest in planned if digest in set(published)]


def test_the_exported_runs_of_the_paper_are_those_that_its_studies_plan():
    exported = run_lines.read(ROOT / "studies" / "paper-results.jsonl")
    studies = paper.studies("full").values()
    planned = {run.digest for study in studies for run in study.runs(study.looks[-1])}
    assert exported
    assert exported.keys() <= planned
