"""The engine is stock Gymnasium, to the last bit of every observation and reward."""

import re
import shutil
import subprocess
from collections import Counter

import oracle
import pytest

from touchdown.lander.engine import _engine


@pytest.mark.parametrize("configuration", oracle.CONFIGURATIONS)
def test_every_step_of_every_policy_equals_stock(configuration):
    report = oracle.Report()
    for policy in oracle.POLICIES:
        oracle.compare(report, oracle.CONFIGURATIONS[configuration], policy, seed=0)
    assert report.difference is None
    assert report.episodes == 2 * len(oracle.POLICIES)


def paths_missed(coverage: Counter[str], unless: tuple[str, ...] = ()) -> list[str]:
    return [name for name, count in coverage.items() if count == 0 and name not in unless]


def test_a_few_seeds_meet_nearly_every_path():
    report = oracle.Report()
    for seed in range(2):
        for policy in oracle.POLICIES:
            oracle.compare(report, {}, policy, seed)
    assert report.difference is None
    rare = (
        *("steps_with_impacts[3]", "steps_with_impacts[4]", "impacts_undone", "block_cases[4]"),
        *("steps_with_contacts[4]", "steps_with_contacts[5]", "steps_with_contacts[6]"),
    )
    assert paths_missed(report.coverage, unless=rare) == []
    assert {"came to rest", "crashed", "out of bounds", "timed out"} == set(report.outcomes)


@pytest.mark.slow
def test_four_hundred_thousand_steps_equal_stock_and_meet_every_path():
    reports = oracle.survey(400_000, first_seed=1000)
    assert [r.difference for r in reports.values() if r.difference] == []
    coverage: Counter[str] = Counter()
    for report in reports.values():
        coverage.update(report.coverage)
    crowded = ("steps_with_contacts[5]", "steps_with_contacts[6]")
    assert paths_missed(coverage, unless=crowded) == []


@pytest.mark.skipif(shutil.which("objdump") is None, reason="needs objdump")
def test_the_build_fuses_no_multiplication_with_an_addition():
    listing = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", _engine.__file__],
        capture_output=True,
        check=True,
        text=True,
    ).stdout
    assert "mulss" in listing  # the search would find what it looks for
    assert re.findall(r"\bvf(?:n?m(?:add|sub)|maddsub|msubadd)\w*", listing) == []
