import io

import pytest

from touchdown.cli.tables import runs_table
from touchdown.core.terminal import SafeConsole

FACTS = {
    "name": "a-very-long-name-of-a-run-with-many-words-0",
    "status": "finished",
    "preset": "tabular-expected-sarsa",
    "env_id": "LunarLander-v3",
    "seed": 0,
    "episodes": 1_234,
    "observations": 180_000,
    "seconds": 75.0,
    "test": {"mean": 264.12, "sd": 101.5},
}
BROKEN = {"name": "half", "status": "broken", "error": "x"}


def shown(width: int) -> str:
    console = SafeConsole(file=io.StringIO(), width=width)
    console.print(runs_table([FACTS, BROKEN], width))
    return console.file.getvalue()


@pytest.mark.parametrize("width", [60, 80, 100, 120, 200])
def test_the_table_of_runs_keeps_names_status_and_result_whole_at_any_width(width):
    text = shown(width)
    assert max(map(len, text.splitlines())) <= width
    for word in ("finished", "broken", "264.1 ± 101.5", "half"):
        assert word in text
    first = "".join(line[:60].split("  ")[0].strip() for line in text.splitlines()[3:6])
    assert FACTS["name"].startswith(first[:20])
    assert "…" not in text


def test_a_wide_terminal_shows_every_column():
    heading = shown(200).splitlines()[1].split()
    assert heading == [
        "run",
        "preset",
        "env",
        "seed",
        "status",
        "episodes",
        "env",
        "steps",
        "minutes",
        "test",
    ]


def test_an_80_column_terminal_goes_without_the_less_important_columns():
    heading = shown(80).splitlines()[1].split()
    assert heading[0] == "run"
    assert "preset" not in heading
    assert heading[-1] == "test"
