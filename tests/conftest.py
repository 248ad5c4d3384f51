"""JAX on the CPU, reproducible hypothesis, and small environments and agents for tests."""

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis
import numpy as np
import pytest

from touchdown.core import device

device.start()  # before anything below computes
os.environ["OMP_NUM_THREADS"] = "1"  # tests run side by side
os.environ.pop("COLUMNS", None)  # xdist sets it, and output to a file would obey it

import jax  # noqa: E402

from touchdown.agents.dqn import DQNAgent  # noqa: E402
from touchdown.agents.learners.factory import make_learner  # noqa: E402
from touchdown.agents.networks import QNetwork  # noqa: E402
from touchdown.config.config import Config  # noqa: E402
from touchdown.config.sections import (  # noqa: E402
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    TrainingConfig,
)
from touchdown.core.seeding import streams  # noqa: E402
from touchdown.core.types import Spaces  # noqa: E402
from touchdown.testing import chain as testing  # noqa: E402

# the same examples every time, however slow or busy the machine
hypothesis.settings.register_profile(
    "touchdown",
    derandomize=True,
    deadline=None,
    max_examples=50,
    suppress_health_check=[hypothesis.HealthCheck.too_slow],
)
hypothesis.settings.load_profile("touchdown")

HIDDEN_SIZES = (16, 16)  # one network for all agents here: each new shape costs seconds to compile
SPACES = Spaces(observation_size=5, num_actions=2)


@pytest.fixture(scope="session", autouse=True)
def _flush_nothing() -> Iterator[None]:
    """No file of a test has to survive a power cut, and thousands of flushes take minutes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _descriptor: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def _compile_once(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Agents with the same arithmetic share one compilation, forgotten after the session."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # of all workers
    jax.config.update("jax_compilation_cache_dir", str(folder / "jax"))
    jax.config.update("jax_compilation_cache_max_size", 1 << 40)  # with a limit, JAX locks it
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


@pytest.fixture(scope="session")
def network() -> QNetwork:
    """The network of the agents here."""
    return QNetwork(*SPACES[:2], NetworkConfig(hidden_sizes=HIDDEN_SIZES))


@pytest.fixture(scope="session")
def new_agent() -> Callable[..., DQNAgent]:
    """Makes agents of one small network; arguments are the fields of the config's sections."""

    def make(
        seed: int = 0,
        *,
        network: dict[str, Any] | None = None,
        replay: dict[str, Any] | None = None,
        exploration: dict[str, Any] | None = None,
        learning: dict[str, Any] | None = None,
        training: dict[str, Any] | None = None,
    ) -> DQNAgent:
        config = Config(
            seed=seed,
            network=NetworkConfig(**{"hidden_sizes": HIDDEN_SIZES} | (network or {})),
            replay=ReplayConfig(**{"capacity": 1_000, "min_size": 8} | (replay or {})),
            exploration=ExplorationConfig(**exploration or {}),
            learning=LearningConfig(**{"batch_size": 16} | (learning or {})),
            training=TrainingConfig(**{"metrics_period": 1} | (training or {})),
        )
        return DQNAgent(config, SPACES, streams(seed), make_learner(config, SPACES))

    return make


class Chain(testing.Chain):
    """The five-state chain, with what else tests ask of it."""

    @classmethod
    def transitions(cls) -> dict[int, dict[int, list[tuple[float, int, float, bool]]]]:
        """The model as Gymnasium's toy-text environments have it."""
        return {
            state: {
                action: [(1.0, after or 0, reward, after is None)]
                for action in (0, 1)
                for reward, after in [cls.model(state, action)]
            }
            for state in range(cls.STATES)
        }

    @classmethod
    def values_of_acting(cls, gamma: float, epsilon: float) -> np.ndarray:
        """Q of going right with probability 1 − ε/2, by sweeping Bellman's expectation equation."""
        q = np.zeros((cls.STATES, 2))
        for _ in range(100):
            for state, action in np.ndindex(q.shape):
                reward, after = cls.model(state, action)
                follows = 0.0 if after is None else q[after] @ (epsilon / 2, 1 - epsilon / 2)
                q[state, action] = reward + gamma * follows
        return q


@pytest.fixture
def chain() -> type[Chain]:
    """The five-state chain, to be made with a time limit."""
    return Chain


@pytest.fixture
def no_temporaries(tmp_path: Path) -> Callable[[], bool]:
    """Whether a test's folder is free of half-written files, hidden ones too."""
    return lambda: not [path for path in tmp_path.rglob("*") if ".tmp" in path.name]


@pytest.fixture(scope="module")
def without_collecting():
    # statsmodels collects garbage in each correction: a tenth of a second, some thousand times
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "collect", lambda *_: 0)
        yield
