"""A finished run for the functions that take one."""

import pytest

import touchdown
from small_configs import tiny


@pytest.fixture(scope="session")
def run(tmp_path_factory) -> touchdown.Run:
    """A finished run of the lander, `pilot-0`."""
    return touchdown.train(tiny(), runs_dir=tmp_path_factory.mktemp("runs"))
