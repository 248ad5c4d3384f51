"""The engine is stock Gymnasium, to the last bit of every observation and reward."""

import itertools
import os
import re
import shutil
import subprocess
import sys
from collections import Counter

import oracle
import pytest

from touchdown.lander import _engine

STEPS_EACH = 50_000  # so 400 thousand in all eight configurations
SEEDS_AT_ONCE = 4


@pytest.mark.parametrize("configuration", oracle.CONFIGURATIONS)
def test_fifty_thousand_steps_of_every_policy_equal_stock(configuration):
    report = oracle.Report()
    for seed in itertools.count(24, SEEDS_AT_ONCE):
        seeds = range(seed, seed + SEEDS_AT_ONCE)
        report.add(oracle.compare(oracle.CONFIGURATIONS[configuration], seeds))
        assert report.difference is None
        if report.steps >= STEPS_EACH:
            break
    if configuration == "default":
        rare = (
            *("steps_with_impacts[4]", "impacts_undone", "block_cases[4]"),
            *("steps_with_contacts[5]", "steps_with_contacts[6]"),
        )
        assert paths_missed(report.coverage, unless=rare) == []
        assert {"came to rest", "crashed", "out of bounds", "timed out"} == set(report.outcomes)


def paths_missed(coverage: Counter[str], unless: tuple[str, ...] = ()) -> list[str]:
    return [name for name, count in coverage.items() if count == 0 and name not in unless]


@pytest.mark.slow
def test_a_million_steps_equal_stock_and_cover_every_path():
    reports = oracle.survey(1_000_000, first_seed=1000)
    assert [r.difference for r in reports.values() if r.difference] == []
    coverage: Counter[str] = Counter()
    for report in reports.values():
        coverage.update(report.coverage)
    assert paths_missed(coverage, unless=("steps_with_contacts[6]",)) == []


def test_threads_change_nothing():
    for threads in (2, 3):
        report = oracle.compare(
            {}, range(8), num_threads=threads
        )  # 88 landers, enough for two threads
        assert report.difference is None


def test_every_instruction_set_gives_the_same_bytes():
    """Each flies the same landers in its own process; those that the machine lacks are skipped."""
    flight = """
import hashlib
import numpy as np
from touchdown.lander._engine import simd
from touchdown.lander.vector import LanderVectorEnv
env = LanderVectorEnv(150)
digest = hashlib.sha256(env.reset(seed=0)[0])
rng = np.random.default_rng(0)
for _ in range(400):
    pushes = rng.integers(0, 4, 150)
    for part in env.step(np.where(np.arange(150) < 75, pushes, 2 * (pushes == 2)))[:4]:
        digest.update(part)
print(simd(), digest.hexdigest())
"""
    digests = {}
    for name in ("baseline", "avx2", "avx512"):
        done = subprocess.run(
            [sys.executable, "-c", flight],
            env={**os.environ, "TOUCHDOWN_SIMD": name},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            assert f"TOUCHDOWN_SIMD = '{name}': must be" in done.stderr
            continue
        used, digest = done.stdout.split()
        assert used == name
        digests[name] = digest
    assert "baseline" in digests
    assert len(set(digests.values())) == 1


@pytest.mark.skipif(shutil.which("objdump") is None, reason="needs objdump")
def test_the_build_fuses_no_multiplication_with_an_addition():
    listing = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", _engine.__file__],
        capture_output=True,
        check=True,
        text=True,
    ).stdout
    assert "mulss" in listing  # the listing holds floating-point instructions
    assert re.findall(r"\bvf(?:n?m(?:add|sub)|maddsub|msubadd)\w*", listing) == []
