import polars as pl
import pytest

from touchdown.api.studies import check_statistics
from touchdown.core.errors import UserError
from touchdown.stats import simulation
from touchdown.stats.procedures import PROCEDURES


@pytest.fixture
def fast(monkeypatch):
    """One procedure with two numbers of seeds."""

    def simulate(repetitions, seed, *, on_row):
        fisher = [each for each in PROCEDURES if each.name == "failures (Fisher)"]
        return real(repetitions, seed, counts=(5, 8), procedures=fisher, on_row=on_row)

    real = simulation.simulate
    monkeypatch.setattr(simulation, "simulate", simulate)


@pytest.mark.usefixtures("fast")
def test_the_tables_are_written_with_the_command_that_made_them(tmp_path):
    page = tmp_path / "rates.md"
    rows = check_statistics(repetitions=50, seed=3, out=page)
    text = page.read_text()
    assert "touchdown study check --repetitions 50 --seed 3 --out rates.md" in text
    table = pl.read_csv(page.with_suffix(".csv"))
    assert table["error"].to_list() == pytest.approx([row.error for row in rows], abs=1e-4)
    with pytest.raises(UserError, match="exists"):
        check_statistics(repetitions=50, out=page)
    check_statistics(repetitions=60, out=page, force=True)
    assert "--repetitions 60 --seed 0" in page.read_text()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"repetitions": 0}, "repetitions = 0: must be at least 1"),
        ({"seed": -1}, "seed = -1: must be at least 0"),
        ({"out": "rates.csv"}, r"out = 'rates\.csv': must end with \.md"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_simulated(given, said):
    with pytest.raises(UserError, match=said):
        check_statistics(**given)
