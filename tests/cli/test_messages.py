import pytest

from touchdown.cli.messages import one_line_of

FRAMED = """
╭─ Parsing error ───────────────────╮
│ Error parsing --gamma: 'x': must  │
│ be a number                       │
│ ───────────────────────────────── │
│ For full helptext, run --help     │
╰───────────────────────────────────╯
"""
PLAIN = """
Parsing error
----------------------------
Error parsing --gamma: 'x': must be a number
----------------------------
For full helptext, run --help
"""


@pytest.mark.parametrize("complaint", [FRAMED, PLAIN])
def test_a_complaint_of_several_lines_becomes_one(complaint):
    assert one_line_of(complaint) == "--gamma: 'x': must be a number"


def test_the_section_of_a_refused_setting_is_left_out():
    complaint = PLAIN.replace("--gamma: 'x'", "learning: gamma = 2.0")
    assert one_line_of(complaint) == "gamma = 2.0: must be a number"
