"""Landers used at random, and for long."""

import sys

import endurance
import fuzzer
import pytest


def test_any_call_is_carried_out_or_refused():
    used = fuzzer.Fuzzer(1)
    used.run(450)
    assert min(used.accepted, used.refused) > 100


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads memory from /proc")
def test_ten_million_steps_do_not_grow_in_memory():
    before, after = endurance.growth(10_000_000)
    assert after - before < 4_000_000
