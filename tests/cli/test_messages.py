import pytest

from touchdown.cli.messages import one_line_of

FRAMED = """
╭─ Parsing error ──────────────────╮
│ Unrecognized options: --gama=0.9 │
│ ──────────────────────────────── │
│ For full helptext, run --help    │
╰──────────────────────────────────╯
"""
PLAIN = """
Parsing error
----------------------------
Unrecognized options: --gama=0.9
----------------------------
For full helptext, run --help
"""


@pytest.mark.parametrize("complaint", [FRAMED, PLAIN])
def test_an_unknown_flag_is_answered_with_the_nearest_one(complaint):
    flags = ["--alpha", "--gamma", "--game-over"]
    line = one_line_of(complaint, "train", dict(zip(flags, flags, strict=True)))
    assert line == "--gama: unknown option; did you mean --gamma?"


def test_a_misspelt_former_flag_is_answered_with_the_present_one():
    flags = {"--discount": "--discount", "--gamma": "--discount"}
    line = one_line_of(FRAMED, "train", flags)
    assert line == "--gama: unknown option; did you mean --discount?"


def test_without_a_near_flag_the_verbs_help_is_named():
    line = one_line_of(FRAMED, "train", {"--seed": "--seed"})
    assert line == "--gama: unknown option; `touchdown train --help` lists them"


def test_without_a_verb_the_complaint_is_left_as_it_is():
    assert one_line_of(FRAMED, "", {}) == "Unrecognized options: --gama=0.9"


def test_a_long_complaint_becomes_one_line():
    complaint = (
        "╭─ e ─╮\n│ Error parsing --bins: not a  │\n│   number                      │\n╰─────╯"
    )
    assert one_line_of(complaint, "train", {"--bins": "--bins"}) == "--bins: not a number"
