"""The CSV files beside a page have the page's numbers."""

import csv
import re
from html import unescape

import numpy as np
import pytest

from finished_runs import write_run
from touchdown.config import toml
from touchdown.report.study_page import write_study_report
from touchdown.studies.claim_tests import Alike, Greater, Near
from touchdown.studies.claims import Claim
from touchdown.studies.findings import p_text
from touchdown.studies.plan import Factor, Study
from touchdown.studies.store import open_store

RETURNS = {
    "0.9": [12, 25, 31, 18, 22, 28, 15, 27, 20, 24],
    "0.95": [110, 121, 138, 115, 119, 127, 131, 112, 125, 133],
    "0.99": [20, 45, 40, 35, 50, 22, 30, 61, 28, 33],
}
CLAIMS = [
    Claim("0.95 is better.", Greater("0.95", "0.9", margin=20)),
    Claim("0.99 is about 2000.", Near("0.99", 2000, 20), section="7"),
    Claim("Both are alike.", Alike(("0.99", "0.9"), 20), "last_return"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page of a study with made-up runs."""
    folder = tmp_path_factory.mktemp("csv")
    store = open_store(folder / "results", make=True)
    study = Study(
        name="made-up",
        factors=[Factor.of("learning.gamma", [0.9, 0.95, 0.99])],
        seeds=10,
        base_level="0.9",
        claims=CLAIMS,
    )
    for run in study.runs():
        value = RETURNS[run.cell.name][run.seed]
        path = store.runs / run.digest
        write_run(path, (value - 1.0, value + 1.0), (value - 7.0,))
        (path / "config.toml").write_text(toml.to_toml(run.config))
    report = write_study_report(study, 10, store, folder / "out", command="x", linked=False)
    assert list(report.decisions) == ["made-up"]
    return report.page


def rows_of(page, name):
    with (page.parent / "tables" / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table_of(page, first_column):
    """The rows of the page's tables of levels, as texts by column; the first has the answer."""
    found = []
    for table in re.findall(r"<table>.*?</table>", page.read_text(), re.DOTALL):
        head, body = table.split("</thead>")
        names = [unescape(name) for name in re.findall(r"<th[^>]*>(.*?)</th>", head)]
        if names[0] == first_column and "run" not in names:
            lines = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
            cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", line) for line in lines]
            found.append([dict(zip(names, map(unescape, each), strict=True)) for each in cells])
    first, second = found
    assert list(first[0])[1:4] == ["n", "median [95%]", "against base"]
    return [one | other for one, other in zip(first, second, strict=True)]


def shown(row, name):
    """A number with its interval, as the page has it."""
    value, low, high = (float(row[f"{name}{end}"]) for end in ("", "_low", "_high"))
    return f"{value:.0f} [{low:.0f}, {high:.0f}]"


def test_levels_have_the_pages_numbers(page):
    found, on_page = rows_of(page, "made-up-levels"), table_of(page, "level")
    assert [row["level"] for row in found] == ["0.9", "0.95", "0.99"]
    for row, cells in zip(found, on_page, strict=True):
        assert cells["level"] == row["level"] + (" (base)" if row["is_base"] == "true" else "")
        assert cells["n"] == row["n"] == "10"
        assert cells["IQM [95%]"] == shown(row, "iqm")
        assert cells["mean [95%]"] == shown(row, "mean")
        assert cells["median [95%]"] == shown(row, "median")
        band = f"{float(row['band_low']):.0f} to {float(row['band_high']):.0f}"
        assert cells["band of seeds"] == band
        assert cells["final weights"] == f"{float(row['last_weights']):.0f}"
        assert cells["over training"] == f"{float(row['over_training']):.0f}"
        assert cells["env steps to 200"] == f"{float(row['env_steps_to_solved']):,.0f}" == "3,500"
        assert cells["seconds to 200"] == f"{float(row['seconds_to_solved']):.0f}"
        assert row["solved_seeds"] == "10"
    base, *others = zip(found, on_page, strict=True)
    assert {
        base[0][name] for name in ("difference", "improvement_low", "p_raw", "p_corrected")
    } == {""}
    assert {base[1][name] for name in ("against base", "P(more)", "p")} == {"–"}
    for row, cells in others:
        assert cells["against base"] == f"+{shown(row, 'difference')}"
        assert cells["P(more)"] == f"{float(row['improvement']):.0%}"
        assert cells["p"] == p_text(float(row["p_corrected"]))
        assert float(row["p_corrected"]) >= float(row["p_raw"])
    more = np.subtract.outer(RETURNS["0.95"], RETURNS["0.9"])
    assert float(found[1]["difference"]) == pytest.approx(np.median(more))


def test_claims_have_the_pages_verdicts(page):
    found = rows_of(page, "claims")
    assert [row["claim"] for row in found] == [claim.sentence for claim in CLAIMS]
    text = page.read_text()
    badges = re.findall(r'<li><span class="badge ([a-z-]+)">.*?<p class="evidence">(.*?)</p>', text)
    assert [row["verdict"].replace(" ", "-") for row in found] == [kind for kind, _ in badges]
    assert [row["evidence"] for row in found] == [unescape(evidence) for _, evidence in badges]
    assert [row["verdict"] for row in found] == ["holds", "does not hold", "undecided"]
    assert [row["kind"] for row in found] == ["greater", "near", "alike"]
    assert [row["metric"] for row in found] == ["best_return", "best_return", "last_return"]
    assert [row["section"] for row in found] == ["", "7", ""]
    assert {row["seeds"] for row in found} == {"10"}
    for row in found:
        said = re.search(r"; p (?:= )?((?:< )?[\d.]+)", row["evidence"])[1]
        assert said == p_text(float(row["p_corrected"]))
        assert float(row["p_raw"]) <= float(row["p_corrected"])
    more = re.search(r"(\d+) more seeds of each decide it", found[2]["evidence"])[1]
    assert [row["further_seeds"] for row in found] == ["", "", more]
    summary = (page.parent / "summary.md").read_text()
    assert "| 0.99 is about 2000. | 7 | **does not hold** |" in summary


def test_runs_have_their_seeds_numbers(page):
    found = rows_of(page, "made-up")
    assert [float(row["best_return"]) for row in found] == [
        RETURNS[level][seed] for seed in range(10) for level in RETURNS
    ]
