"""The notebook of the documentation, executed from its first cell to its last."""

import re
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebooks" / "first-landing.ipynb"
SMALL = "EPISODES, SEEDS, ENV_STEPS = 4, [0], 2_000"


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """The notebook with its outputs, its experiments made small in the cell tagged `parameters`."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    (parameters,) = (
        cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", ())
    )
    assert set(re.findall(r"[A-Z_]{4,}", parameters.source)) == {"EPISODES", "SEEDS", "ENV_STEPS"}
    parameters.source = SMALL
    folder = tmp_path_factory.mktemp("notebook")
    where = {"metadata": {"path": str(folder)}}
    nbclient.NotebookClient(notebook, timeout=600, resources=where).execute()
    return notebook


def outputs(notebook, start: str) -> list[dict]:
    """What a cell displayed, without views that were taken away.

    Args:
        notebook: executed.
        start: of the only cell that begins in this way, or all of a cell.
    """
    sources = [cell.source for cell in notebook.cells]
    (cell,) = (
        cell
        for cell in notebook.cells
        if cell.source == start or (start not in sources and cell.source.startswith(start))
    )
    shown = [output.get("data", output) for output in cell.outputs]
    return [bundle for bundle in shown if bundle.get("text/html") != ""]


def test_the_committed_notebook_has_no_outputs():
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None
        assert "execution" not in cell.metadata


def test_flights_show_their_films(executed):
    for start in ('touchdown.fly("ace"', "flight = touchdown.fly(run"):
        (film,) = outputs(executed, start)
        assert '<img src="data:image/gif;base64,R0lGODlh' in film["text/html"]
        assert film["text/plain"].startswith("<Flight ")


def test_training_leaves_one_output_and_a_policy_that_lands(executed):
    (printed,) = outputs(executed, 'run = touchdown.train("swift"')
    assert "swift-0: trained in" in printed["text/plain"]
    assert "solved after" in printed["text/plain"]
    assert "heuristic" in printed["text/plain"]
    (run,) = outputs(executed, "run")
    assert run["text/plain"].startswith("<Run swift-0: LunarLander-v3, finished, test return ")
    assert '<img src="data:image/png;base64,iVBOR' in run["text/html"]


def test_policies_are_compared_in_a_table(executed):
    (one,) = outputs(executed, "touchdown.evaluate(run")
    assert re.search(r"<td[^>]*>landed</td><td[^>]*>\d+%</td>", one["text/html"])
    (table,) = outputs(executed, "table = ")
    for name in ("swift-0", "ace", "pid", "heuristic", "random"):
        assert f"<td>&quot;{name}&quot;</td>" in table["text/html"]


def test_predictions_and_the_comparison_are_drawn(executed):
    for start in ("seconds = ", "page = "):
        assert [bundle for bundle in outputs(executed, start) if "image/png" in bundle]


def test_a_misspelt_setting_is_answered_and_settings_by_name_are_trained(executed):
    (said,) = outputs(executed, "try:")
    assert said["text"] == "gama: unknown setting; did you mean gamma?\n"
    (runs,) = outputs(executed, "settings = ")
    assert runs["text/plain"].count("finished, test return") == 2
