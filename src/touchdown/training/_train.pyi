from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, Int64, UInt8
from numpy.random import BitGenerator

from touchdown.agents.learners._fused import Network
from touchdown.lander._engine import Batch

class Settings:
    """The settings of a loop, with the names of `touchdown.config.sections`."""

    schedule: str
    epsilon_start: float
    epsilon_end: float
    epsilon_decay: float
    epsilon_duration: int
    min_size: int
    resaves: int
    resave_threshold: float
    prioritized: bool
    alpha: float
    beta: float
    beta_duration: int
    gamma: float
    n_step: int
    learning_rate: float
    learning_rate_end: float
    learning_rate_duration: int
    batch_size: int
    huber: bool
    double: bool
    sarsa: bool
    reward_scale: float
    max_grad_norm: float
    polyak: float
    averaging: float
    update_period: int
    gradient_steps: int
    target_period: int
    metrics_period: int
    max_episode_steps: int
    seed: int
    """Of the run; of noisy weights."""
    rollout_steps: int
    epochs: int
    minibatches: int
    trace_decay: float

    def __init__(self) -> None: ...

class Counts:
    """What changes from call to call and is no array."""

    env_steps: int
    """Over all environments."""
    episodes: int
    """Episodes that have ended."""
    updates: int
    """Of the agent."""
    adam_updates: int
    """Of the optimiser."""
    added: int
    """Transitions ever stored."""
    filled: int
    """Steps of the rollout that are stored."""
    epsilon: float
    """Of the next actions."""
    epsilon_used: float
    """Of the latest actions."""
    knows_values: bool
    """Whether `q` holds the action values of the current observations."""
    max_priority: float
    """Of the transitions that were never sampled."""
    num_batches: float
    """Minibatches that were sampled by priority."""
    ended: bool
    """Whether an episode ended in the latest step, whose updates follow in the next call."""

    def __init__(self) -> None: ...

class PoolArrays:
    def __init__(
        self,
        actions: Int64[np.ndarray, " N"],
        observations: Float32[np.ndarray, "N 8"],
        rewards: Float64[np.ndarray, " N"],
        terminated: Bool[np.ndarray, " N"],
        steps: Int64[np.ndarray, " N"],
    ) -> None: ...

class EpisodeArrays:
    def __init__(
        self,
        observations: Float32[np.ndarray, "N 8"],
        returns: Float64[np.ndarray, " N"],
        steps: Int64[np.ndarray, " N"],
        actions: Int32[np.ndarray, "N room"],
    ) -> None: ...

class WindowArrays:
    def __init__(
        self,
        o_tm1: Float32[np.ndarray, "N n 8"],
        a_tm1: Int32[np.ndarray, "N n"],
        r_t: Float64[np.ndarray, "N n"],
        lengths: Int64[np.ndarray, " N"],
    ) -> None: ...

class RolloutArrays:
    def __init__(
        self,
        o_tm1: Float32[np.ndarray, "T N 8"],
        a_tm1: Int32[np.ndarray, "T N"],
        r_t: Float32[np.ndarray, "T N"],
        o_t: Float32[np.ndarray, "T N 8"],
        terminated: Float32[np.ndarray, "T N"],
        truncated: Float32[np.ndarray, "T N"],
    ) -> None: ...

class LearnerArrays:
    def __init__(
        self,
        online: Float32[np.ndarray, " P"],
        target: Float32[np.ndarray, " P"] | None,
        mu: Float32[np.ndarray, " P"],
        nu: Float32[np.ndarray, " P"],
        average: Float32[np.ndarray, " P"] | None = None,
    ) -> None: ...

class Loop:
    """Acts, steps landers, stores transitions and learns."""

    def __init__(
        self,
        batch: Batch,
        exploration: BitGenerator,
        replay: BitGenerator,
        settings: Settings,
        network: Network,
        mirror: tuple[Sequence[int], Sequence[float], Sequence[int]] | None = None,
    ) -> None: ...
    def advance(
        self,
        max_steps: int,
        counts: Counts,
        pool: PoolArrays,
        episodes: EpisodeArrays,
        windows: WindowArrays,
        records: Float32[np.ndarray, "capacity W"],
        priorities: Float64[np.ndarray, " nodes"] | None,
        learner: LearnerArrays,
        q: Float32[np.ndarray, "N A"],
    ) -> tuple[float, float, float, float] | None:
        """Take at most `max_steps` steps of all environments, in place.

        It stops after a step that ended an episode, before its updates: they follow in the next
        call, once the caller has reset the environment. It also stops after a step that completed a
        metrics period, and returns the loss, mean Q, greatest Q and gradient norm of its last
        update.
        """

class PqnLoop:
    """Acts, steps landers, and learns from each rollout."""

    def __init__(
        self,
        batch: Batch,
        exploration: BitGenerator,
        replay: BitGenerator,
        settings: Settings,
        network: Network,
        mirror: tuple[Sequence[int], Sequence[float], Sequence[int]] | None = None,
    ) -> None: ...
    def advance(
        self,
        max_steps: int,
        counts: Counts,
        pool: PoolArrays,
        episodes: EpisodeArrays,
        rollout: RolloutArrays,
        learner: LearnerArrays,
        q: Float32[np.ndarray, "N A"],
    ) -> tuple[float, float, float, float] | None:
        """Take at most `max_steps` steps of all environments, in place; see `Loop.advance`."""

class Rollout:
    """Acts greedily and steps landers."""

    def __init__(
        self,
        batch: Batch,
        network: Network,
        max_episode_steps: int,
    ) -> None: ...
    def advance(
        self,
        max_steps: int,
        params: Float32[np.ndarray, " P"],
        tasks: UInt8[np.ndarray, " N"],
        pool: PoolArrays,
        episodes: EpisodeArrays,
    ) -> int:
        """Take at most `max_steps` steps of the environments whose task is to step, in place.

        It stops after a step that ended an episode, and before a step for which an action value is
        not finite. Returns the number of steps.
        """

def random(bit_generator: BitGenerator, out: Float64[np.ndarray, " N"]) -> None:
    """Write what `Generator.random(N)` draws."""

def permutation(bit_generator: BitGenerator, out: Int64[np.ndarray, " N"]) -> None:
    """Write what `Generator.permutation(N)` draws."""

def integers(bit_generator: BitGenerator, high: int, out: Int64[np.ndarray, " N"]) -> None:
    """Write what `Generator.integers(0, high, N)` draws."""
