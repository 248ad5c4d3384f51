"""The page of promises names tests that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reliability.md").read_text("utf-8")
TESTS = "\n".join(path.read_text("utf-8") for path in ROOT.glob("tests/**/test_*.py"))


def test_each_promise_names_tests_that_exist():
    promises = re.findall(
        r"^\| promise \| test \|\n\| --- \| --- \|\n((?:\|.*\|\n)+)", PAGE, re.MULTILINE
    )
    rows = [row for table in promises for row in table.splitlines()]
    assert len(rows) > 40
    assert len(promises) == PAGE.count("| promise | test |")
    written = set(re.findall(r"def (test_\w+)\(", TESTS))
    for row in rows:
        named = set(re.findall(r"`(test_\w+)`", row))
        assert named, row
        assert named <= written, named - written
