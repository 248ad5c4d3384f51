"""The sections of a config: each a frozen dataclass that says its units and refuses nonsense."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from msgspec import Meta

from touchdown.config.bounds import (
    MOST_N_STEP,
    MOST_NODES,
    MOST_RESAVES,
    MOST_STEPS,
    AtLeastOne,
    NonNegative,
    NumEnvs,
    Positive,
    Share,
    Steps,
    Transitions,
)
from touchdown.config.checks import check, settle
from touchdown.core.starts import TEST_STARTS, VALIDATION_STARTS

ALGORITHMS = ("dqn", "pqn", "tabular", "value-iteration")
Backend = Literal["jax", "fused"]

_MOST_STATES = 100_000_000  # of a table: more would end in a system without memory
MOST_FUSED_LAYERS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkConfig:
    """The Q-network: a multilayer perceptron (section 5)."""

    hidden_sizes: tuple[int, ...] = (100, 100, 100)
    """Nodes of each hidden layer, first to last."""
    activation: Literal["relu", "tanh", "silu"] = "relu"
    """Function after each hidden layer."""
    dueling: bool = False
    """One output for the state's value and one for each action's advantage (Wang et al., 2016)."""
    layer_norm: bool = False
    """Layer normalisation before each hidden layer's function (Ba, Kiros & Hinton, 2016)."""
    quantiles: Annotated[
        int, Meta(ge=0, le=MOST_NODES, description=f"from 0 (none) to {MOST_NODES}")
    ] = 0
    """Quantiles of the return that each action's output has (QR-DQN; Dabney et al., 2018); 0 is one
    number, its mean."""
    atoms: int = 0
    """Fixed returns to which each action's output gives probabilities (C51; Bellemare et al.,
    2017), 2 or more; 0 is one number, their mean."""
    v_min: float = -10.0
    """Least of the atoms; returns below count as it (scaled reward units)."""
    v_max: float = 10.0
    """Greatest of the atoms; returns above count as it (scaled reward units)."""
    noisy: bool = False
    """Weights drawn anew around learned means at each update, for exploration (Fortunato et al.,
    2018); the greedy policy takes the means."""
    noisy_sigma: Positive = 0.5
    """σ₀: deviation of noisy weights at the start, times the root of the layer's inputs."""

    def __post_init__(self) -> None:
        settle(self)
        sizes_ok = all(0 < size <= MOST_NODES for size in self.hidden_sizes)
        check(self, "hidden_sizes", ok=sizes_ok, wanted=f"from 1 to {MOST_NODES} nodes each")
        atoms_ok = self.atoms == 0 or 2 <= self.atoms <= MOST_NODES
        check(self, "atoms", ok=atoms_ok, wanted=f"0 (none) or from 2 to {MOST_NODES}")
        below = self.v_min < self.v_max
        check(self, "v_min", ok=below, wanted=f"below v_max = {self.v_max}")
        if self.atoms and self.quantiles:
            raise ValueError(
                f"atoms = {self.atoms}: must be 0 with quantiles = {self.quantiles}; "
                "a return is described by one or the other, not both"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """The memory (Algorithm 2) and its preferential re-saves (section 7)."""

    capacity: Transitions = 100_000
    """Size of the first-in, first-out memory (transitions, copies counted)."""
    min_size: Annotated[int, Meta(ge=1, description="at least 1 transition")] = 1_000
    """Transitions held before the first update."""
    resaves: Annotated[int, Meta(ge=0, le=MOST_RESAVES)] = 0
    """τ: how often a rewarded transition is stored again; 0 is plain replay."""
    resave_threshold: float = 0.0
    """A transition is rewarded when its reward is above this (reward units)."""
    prioritized: bool = False
    """Transitions are drawn by their last TD error (Schaul et al., 2016), not uniformly."""
    alpha: Share = 0.6
    """Exponent of the priorities; 0 would be uniform."""
    beta: Share = 0.4
    """Exponent of the importance weights at the start; it rises to 1 in a line."""
    beta_duration: Annotated[
        int, Meta(ge=1, le=MOST_STEPS, description=f"from 1 to {MOST_STEPS} updates")
    ] = 100_000
    """Updates until that exponent is 1."""

    def __post_init__(self) -> None:
        settle(self)
        if self.min_size > self.capacity:
            raise ValueError(
                f"min_size = {self.min_size}: must be at most capacity = {self.capacity}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplorationConfig:
    """ε-greedy exploration (section 2, Eq. 3)."""

    schedule: Literal["constant", "linear", "exponential"] = "exponential"
    """How ε falls: not at all, linearly over environment steps, or by a factor per episode (the
    paper's)."""
    epsilon_start: Share = 1.0
    """ε at the start (probability)."""
    epsilon_end: Share = 0.01
    """Floor of ε for the linear and the exponential schedule (probability)."""
    epsilon_decay: Share = 0.975
    """Factor on ε after each episode, for the exponential schedule."""
    epsilon_duration: Annotated[int, Meta(ge=1, description="at least 1 env step")] = 50_000
    """Environment steps from epsilon_start to epsilon_end, for the linear schedule."""

    def __post_init__(self) -> None:
        settle(self)
        if self.schedule != "constant" and self.epsilon_end > self.epsilon_start:
            raise ValueError(
                f"epsilon_end = {self.epsilon_end}: "
                f"must be at most epsilon_start = {self.epsilon_start}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningConfig:
    """Q-learning's update (Eq. 4 and 5) and its optimiser (appendix B)."""

    gamma: Share = 0.99
    """γ: discount of the next step's value."""
    learning_rate: Positive = 5e-4
    """Step size of the optimiser, at the start."""
    learning_rate_end: NonNegative = 0.0
    """Step size once learning_rate_duration updates are done."""
    learning_rate_duration: Steps = 0
    """Updates over which the step size falls in a line; 0 keeps learning_rate throughout."""
    optimizer: Literal["adam", "adamw", "rmsprop", "sgd"] = "adam"
    """Optimiser, by optax's name."""
    backend: Backend = "jax"
    """What computes updates: `jax`, or `fused`: forward, backward and Adam in one call of our own,
    in C++ on the CPU, for networks of ReLU layers whose outputs are values."""
    batch_size: Transitions = 64
    """Transitions in a minibatch."""
    loss: Literal["mse", "huber"] = "mse"
    """Loss of the TD error: its square, or Huber's with the knee at 1 scaled reward unit. With
    atoms it is not used: their loss is the cross entropy."""
    reward_scale: Positive = 1.0
    """Factor on rewards inside the update (recorded returns keep their units)."""
    max_grad_norm: Annotated[float, Meta(ge=0, description="0 (never) or more")] = 0.0
    """Gradient clipping: the largest norm that a gradient may have; 0 never clips."""
    target: Literal["q-learning", "sarsa", "expected-sarsa"] = "q-learning"
    """What the TD target takes of the next action values: the greatest, the one of the action that
    came next (appendix A), or their mean over the ε-greedy policy."""
    update_period: Annotated[int, Meta(ge=1, description="at least 1 env step")] = 1
    """Environment steps between updates (Algorithm 2: 1); with 32 environments, 16 makes two
    updates each time that all of them have taken a step."""
    gradient_steps: Annotated[
        int, Meta(ge=1, le=MOST_N_STEP, description=f"1 to {MOST_N_STEP} updates")
    ] = 1
    """Updates each time."""
    target_period: Steps = 0
    """n: environment steps between copies to the target network; 0 makes no copies (section 6)."""
    polyak: Annotated[float, Meta(ge=0, le=1, description="from 0 (never) to 1")] = 0.0
    """Soft update: the share of the online weights that the target network takes over after each
    update (Lillicrap et al., 2016); 0 never. Copies and soft updates exclude each other; with
    neither there is no target network."""
    double: bool = False
    """The online network selects the next action, the target network evaluates it (van Hasselt et
    al., 2016)."""
    n_step: Annotated[int, Meta(ge=1, le=MOST_N_STEP, description=f"1 to {MOST_N_STEP}")] = 1
    """Steps whose rewards one transition gathers before it bootstraps."""

    def __post_init__(self) -> None:
        settle(self)
        if self.polyak and self.target_period:
            raise ValueError(
                f"polyak = {self.polyak}: must be 0 with target_period = {self.target_period}; "
                "a target network is copied or updated softly, not both"
            )
        if self.double and not self.has_target:
            raise ValueError(
                "double = True: must have a target network to evaluate; "
                "set target_period or polyak above 0"
            )
        if self.double and self.target != "q-learning":
            raise ValueError(
                f"double = True: must be False with target = {self.target!r}, which gives "
                "the next action, so that nothing is left to select"
            )

    @property
    def has_target(self) -> bool:
        """Whether a target network bootstraps."""
        return self.target_period > 0 or self.polyak > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig:
    """A table of action values (Algorithm 1), and how Box observations are binned into states."""

    bins: tuple[int, ...] = ()
    """Equal parts of each dimension of a Box; a Discrete environment has its states already."""
    bins_low: tuple[float, ...] = ()
    """Where the parts of each dimension begin; what is below belongs to the first. () takes the
    environment's own bounds."""
    bins_high: tuple[float, ...] = ()
    """Where they end; what is above belongs to the last. () takes the environment's own bounds."""
    initial_value: float = 0.0
    """Every action's value at the start; a high one makes the agent try everything."""

    def __post_init__(self) -> None:
        settle(self)
        for name in ("bins_low", "bins_high"):
            bounds = getattr(self, name)
            if bounds and len(bounds) != len(self.bins):
                raise ValueError(
                    f"{name} = {bounds!r}: must be () or as many as bins = {self.bins!r}"
                )
        check(self, "bins", ok=all(count > 0 for count in self.bins), wanted="at least 1 each")
        if math.prod(self.bins) > _MOST_STATES:
            raise ValueError(
                f"bins = {self.bins!r}: make {math.prod(self.bins)} states, "
                f"must be at most {_MOST_STATES}"
            )
        # one of them may be left out
        if any(low >= high for low, high in zip(self.bins_low, self.bins_high, strict=False)):
            raise ValueError(
                f"bins_low = {self.bins_low!r}: must be below bins_high = {self.bins_high!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class RolloutConfig:
    """Learning without a memory, from the latest steps of many environments (PQN)."""

    rollout_steps: NumEnvs = 32
    """Steps of every environment between two rounds of learning."""
    epochs: NumEnvs = 2
    """Passes over those steps in a round."""
    minibatches: NumEnvs = 4
    """Minibatches of a pass, an update each."""
    trace_decay: Share = 0.65
    """λ of the returns: 0 looks one step ahead, 1 to the end of the rollout."""

    def __post_init__(self) -> None:
        settle(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingConfig:
    """How long to train, how a checkpoint is chosen, and what is written down on the way."""

    num_envs: NumEnvs = 1
    """Environments that the agent acts in at the same time."""
    episodes: AtLeastOne = 500
    """Training ends after this many episodes."""
    max_env_steps: Annotated[int, Meta(ge=0)] = 0
    """Training also ends with the episode that reaches this many environment steps; 0: no limit."""
    validation_period: AtLeastOne = 10_000
    """Environment steps between validations: greedy episodes from validation starts."""
    validation_episodes: AtLeastOne = 20
    """Validation starts of each validation."""
    candidate_checkpoints: AtLeastOne = 5
    """Best checkpoints that are evaluated again at the end, from fresh validation starts, for the
    choice."""
    final_validation_episodes: AtLeastOne = 100
    """Fresh validation starts of each candidate checkpoint."""
    test_episodes: Annotated[int, Meta(ge=0)] = 100
    """Test starts of the chosen checkpoint, at the very end; 0 skips the test."""
    stop_when_solved: bool = False
    """Training also ends as soon as final_validation_episodes fresh validation starts leave no
    doubt that the policy reaches the environment's reward threshold on test_episodes others."""
    checkpoint_seconds: NonNegative = 10.0
    """Seconds between checkpoints, taken where an episode ends; 0 takes one after each episode."""
    metrics_period: AtLeastOne = 1_000
    """Updates between lines in updates.jsonl."""

    def __post_init__(self) -> None:
        settle(self)
        starts = self.validation_episodes + self.final_validation_episodes
        if starts > len(VALIDATION_STARTS):
            raise ValueError(
                f"validation_episodes + final_validation_episodes = {starts}: "
                f"must be at most {len(VALIDATION_STARTS)}, as there are no more starts"
            )
        test_ok = self.test_episodes <= len(TEST_STARTS)
        check(self, "test_episodes", ok=test_ok, wanted=f"at most {len(TEST_STARTS)}")
        if self.stop_when_solved and (
            self.final_validation_episodes < 30 or not self.test_episodes
        ):
            raise ValueError(
                "stop_when_solved = True: must have at least 30 final_validation_episodes and 1 of "
                f"test_episodes to be sure by, got {self.final_validation_episodes} and "
                f"{self.test_episodes}"
            )


SECTIONS: dict[str, type[Any]] = {
    "network": NetworkConfig,
    "replay": ReplayConfig,
    "exploration": ExplorationConfig,
    "learning": LearningConfig,
    "table": TableConfig,
    "rollout": RolloutConfig,
    "training": TrainingConfig,
}
