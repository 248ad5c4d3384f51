"""How far a run's final weights overestimate what they will get (section 6 of the paper)."""

import math
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct

from touchdown.agents.greedy import GreedyPolicy
from touchdown.core import files, records
from touchdown.core.errors import Interrupted
from touchdown.core.records import Count
from touchdown.core.starts import TEST_STARTS
from touchdown.core.types import Policy
from touchdown.envs import environment, recorder
from touchdown.lander import engine as engines
from touchdown.lander import rules
from touchdown.runs.run import Run

FORMAT_VERSION = 1
FILE = "values.json"
"""Name of the record in a run's folder."""
NUM_STARTS = 30


class _Episode(Struct, frozen=True):
    """One greedy episode."""

    seed: Count
    expected: float
    """Largest value of its first observation, in return points."""
    discounted_return: float


class _Values(Struct, frozen=True):
    """`values.json`."""

    gamma: float
    episodes: Annotated[list[_Episode], Meta(min_length=1)]
    format_version: Literal[1] = FORMAT_VERSION


def record(run: Run, policy: Policy, should_stop: Callable[[], bool]) -> None:
    """Record the values at the first test starts, and the discounted returns from there.

    Nothing is recorded without a test, of a policy without a network, or a second time.

    Args:
        run: a run whose training is finished.
        policy: its policy with the final weights.
        should_stop: called after each episode.

    Raises:
        Interrupted: `should_stop` returned True.
        UserError: the file cannot be written, or the policy has values that are not finite.
    """
    config = run.config
    starts = TEST_STARTS[: min(NUM_STARTS, config.training.test_episodes)]
    path = run.path / FILE
    if not starts or not isinstance(policy, GreedyPolicy) or path.is_file():
        return
    engine = engines.engine_in_use() if rules.is_lander(config.env_id) else "gymnasium"
    made = environment.make_env(config.env_id, engine=engine)
    gamma = config.learning.gamma
    episodes: list[_Episode] = []
    with closing(made.env):
        for start in starts:
            flight = recorder.fly(made, policy, config.env_id, start, run.folder.name)
            expected = policy.values(flight.observations[:1]).max()
            got = float(flight.rewards @ gamma ** np.arange(flight.steps))
            scale = config.learning.reward_scale
            episodes.append(_Episode(start, float(expected) / scale, got))
            if should_stop():
                raise Interrupted
    with files.refusing(str(path)):
        files.write_atomic(path, files.to_json(_Values(gamma, episodes)), follow=False)


def read_overestimation(folder: Path) -> float:
    """The mean of expected minus discounted return in return points; NaN without a record.

    Args:
        folder: the run's.

    Raises:
        UserError: the record is damaged.
    """
    path = folder / FILE
    if not path.is_file():
        return math.nan
    found = records.decode_json(path, _Values, FORMAT_VERSION)
    return float(np.mean([each.expected - each.discounted_return for each in found.episodes]))
