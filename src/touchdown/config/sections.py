"""The sections of a config: frozen dataclasses that state units and reject invalid values."""

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
from touchdown.core.limits import LAYERS
from touchdown.core.starts import TEST_STARTS, VALIDATION_STARTS

ALGORITHMS = ("dqn", "pqn", "tabular", "value-iteration")
Backend = Literal["jax", "fused", "auto"]

_MOST_STATES = 100_000_000  # of a table: more would exhaust the memory
MOST_FUSED_LAYERS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkConfig:
    """The Q-network, a multilayer perceptron (section 5)."""

    hidden_sizes: tuple[int, ...] = (100, 100, 100)
    """Units in each hidden layer, from first to last."""
    activation: Literal["relu", "tanh", "silu"] = "relu"
    """Activation function of the hidden layers."""
    dueling: bool = False
    """Dueling head: one output for the state value and one for each action's advantage (Wang et
    al., 2016)."""
    layer_norm: bool = False
    """Layer normalisation before each activation function (Ba, Kiros & Hinton, 2016)."""
    quantiles: Annotated[
        int, Meta(ge=0, le=MOST_NODES, description=f"from 0 (none) to {MOST_NODES}")
    ] = 0
    """Quantiles of the return predicted for each action (QR-DQN; Dabney et al., 2018); 0 predicts
    only the mean."""
    atoms: int = 0
    """Atoms of the return distribution predicted for each action (C51; Bellemare et al., 2017), 2
    or more; 0 predicts only the mean."""
    v_min: float = -10.0
    """Smallest atom; lower returns are clipped to it (scaled reward units)."""
    v_max: float = 10.0
    """Largest atom; higher returns are clipped to it (scaled reward units)."""
    noisy: bool = False
    """Noisy network: weights are sampled around learned means at each update, for exploration
    (Fortunato et al., 2018); the greedy policy uses the means."""
    noisy_sigma: Positive = 0.5
    """σ₀: noisy weights start with a standard deviation of σ₀ / √(inputs of the layer)."""

    def __post_init__(self) -> None:
        settle(self)
        if len(self.hidden_sizes) > LAYERS:  # each takes seconds to compile
            raise ValueError(
                f"hidden_sizes: has {len(self.hidden_sizes)} layers, must be at most {LAYERS}"
            )
        sizes_ok = all(0 < size <= MOST_NODES for size in self.hidden_sizes)
        check(self, "hidden_sizes", ok=sizes_ok, wanted=f"from 1 to {MOST_NODES} nodes each")
        atoms_ok = self.atoms == 0 or 2 <= self.atoms <= MOST_NODES
        check(self, "atoms", ok=atoms_ok, wanted=f"0 (none) or from 2 to {MOST_NODES}")
        below = self.v_min < self.v_max
        check(self, "v_min", ok=below, wanted=f"below v_max = {self.v_max}")
        if self.atoms and self.quantiles:
            raise ValueError(
                f"atoms = {self.atoms}: must be 0 with quantiles = {self.quantiles}; "
                "use one or the other to describe a return, not both"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """The replay memory (Algorithm 2) and its preferential re-saves (section 7)."""

    capacity: Transitions = 100_000
    """Capacity of the first-in, first-out replay memory (transitions, re-saved copies included)."""
    min_size: Annotated[int, Meta(ge=1, description="at least 1 transition")] = 1_000
    """Transitions in the replay memory before the first update (warm-up)."""
    resaves: Annotated[int, Meta(ge=0, le=MOST_RESAVES)] = 0
    """τ: extra copies stored of each rewarded transition; 0 is plain replay."""
    resave_threshold: float = 0.0
    """A transition counts as rewarded if its reward exceeds this (reward units)."""
    mirrored: bool = False
    """Also store the mirror image of each transition, in an environment that declares its mirror
    symmetry; the images count as transitions (after van der Pol et al., 2020)."""
    prioritized: bool = False
    """Prioritised replay: sample transitions by their last TD error (Schaul et al., 2016), not
    uniformly."""
    alpha: Share = 0.6
    """Priority exponent; 0 samples uniformly."""
    beta: Share = 0.4
    """Initial exponent of the importance-sampling weights; it increases linearly to 1."""
    beta_duration: Annotated[
        int, Meta(ge=1, le=MOST_STEPS, description=f"from 1 to {MOST_STEPS} updates")
    ] = 100_000
    """Updates until beta reaches 1."""

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
    """How ε decreases: not at all, linearly over environment steps, or by a constant factor per
    episode (as in the paper)."""
    epsilon_start: Share = 1.0
    """Initial ε (probability)."""
    epsilon_end: Share = 0.01
    """Final ε of the linear and exponential schedules (probability)."""
    epsilon_decay: Share = 0.975
    """Factor applied to ε after each episode, for the exponential schedule."""
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
    """The Q-learning update (Eq. 4 and 5) and its optimiser (appendix B)."""

    gamma: Share = 0.99
    """γ: discount factor."""
    learning_rate: Positive = 5e-4
    """Initial learning rate of the optimiser."""
    learning_rate_end: NonNegative = 0.0
    """Learning rate after learning_rate_duration updates."""
    learning_rate_duration: Steps = 0
    """Updates for a linear change to learning_rate_end; 0 keeps learning_rate constant."""
    optimizer: Literal["adam", "adamw", "rmsprop", "sgd"] = "adam"
    """Optimiser, by its name in optax."""
    backend: Backend = "jax"
    """What computes updates: `jax`; `fused`, which runs forward pass, backward pass and Adam in one
    C++ call on the CPU (only ReLU networks with Adam); or `auto`, which is `fused`
    where it was built and supports the settings."""
    batch_size: Transitions = 64
    """Transitions per minibatch."""
    loss: Literal["mse", "huber"] = "mse"
    """Loss on the TD error: squared, or Huber with its threshold at 1 scaled reward unit. Ignored
    when atoms is set, which uses the cross-entropy loss."""
    reward_scale: Positive = 1.0
    """Factor applied to rewards in updates (recorded returns stay unscaled)."""
    max_grad_norm: Annotated[float, Meta(ge=0, description="0 (never) or more")] = 0.0
    """Clip gradients to this norm; 0 disables clipping."""
    target: Literal["q-learning", "sarsa", "expected-sarsa"] = "q-learning"
    """Next action value in the TD target: the maximum (q-learning), that of the next action taken
    (sarsa, appendix A), or the mean under the ε-greedy policy (expected-sarsa)."""
    update_period: Annotated[int, Meta(ge=1, description="at least 1 env step")] = 1
    """Environment steps between updates (1 in Algorithm 2), counted over all environments: with 32
    environments and a period of 16, there are two updates per step of the vector environment."""
    gradient_steps: Annotated[
        int, Meta(ge=1, le=MOST_N_STEP, description=f"1 to {MOST_N_STEP} updates")
    ] = 1
    """Gradient steps each time an update is due."""
    target_period: Steps = 0
    """n: target network update period in environment steps; 0 never copies weights (section 6)."""
    polyak: Annotated[float, Meta(ge=0, le=1, description="from 0 (never) to 1")] = 0.0
    """Soft update: fraction of the online weights mixed into the target network after each update
    (Lillicrap et al., 2016); 0 disables it. Excludes target_period; if both are 0, there is no
    target network."""
    averaging: Annotated[float, Meta(ge=0, le=1, description="from 0 (none) to 1")] = 0.0
    """Weight averaging: fraction of the online weights mixed into their average after each step or
    rollout with updates (after Izmailov et al., 2018). The average is validated, tested and saved,
    while the online weights explore and learn; 0 uses the online weights for everything."""
    double: bool = False
    """Double Q-learning: the online network selects the next action and the target network
    evaluates it (van Hasselt et al., 2016)."""
    n_step: Annotated[int, Meta(ge=1, le=MOST_N_STEP, description=f"1 to {MOST_N_STEP}")] = 1
    """Number of rewards summed before bootstrapping (n-step returns)."""
    bootstrap_on_time_limit: bool = True
    """Bootstrap after the last step of an episode that the time limit cut off (Pardo et al., 2018).
    If not, the time limit ends the episode like a terminal state, with no value after it."""

    def __post_init__(self) -> None:
        settle(self)
        if self.polyak and self.target_period:
            raise ValueError(
                f"polyak = {self.polyak}: must be 0 with target_period = {self.target_period}; "
                "a target network is either copied or softly updated, not both"
            )

    @property
    def has_target(self) -> bool:
        """Whether there is a target network."""
        return self.target_period > 0 or self.polyak > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig:
    """The table of action values (Algorithm 1), and how Box observations are binned into states."""

    bins: tuple[int, ...] = ()
    """Number of equal-width bins in each dimension of a Box; none for a Discrete environment."""
    bins_low: tuple[float, ...] = ()
    """Lower edge of the first bin in each dimension; lower values fall into that bin. () uses the
    environment's bounds."""
    bins_high: tuple[float, ...] = ()
    """Upper edge of the last bin in each dimension; higher values fall into that bin. () uses the
    environment's bounds."""
    initial_value: float = 0.0
    """Initial value of every action; a high value encourages exploration."""

    def __post_init__(self) -> None:
        settle(self)
        for name in ("bins_low", "bins_high"):
            bounds = getattr(self, name)
            if bounds and len(bounds) != len(self.bins):
                raise ValueError(
                    f"{name} = {bounds!r}: must be () or as long as bins = {self.bins!r}"
                )
        check(self, "bins", ok=all(count > 0 for count in self.bins), wanted="at least 1 each")
        if math.prod(self.bins) > _MOST_STATES:
            raise ValueError(
                f"bins = {self.bins!r}: gives {math.prod(self.bins)} states, "
                f"must be at most {_MOST_STATES}"
            )
        # one of them may be empty
        if any(low >= high for low, high in zip(self.bins_low, self.bins_high, strict=False)):
            raise ValueError(
                f"bins_low = {self.bins_low!r}: must be below bins_high = {self.bins_high!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class RolloutConfig:
    """Learning without a replay memory, from the latest steps of many environments (PQN)."""

    rollout_steps: NumEnvs = 32
    """Steps per environment in each rollout."""
    epochs: NumEnvs = 2
    """Passes over each rollout."""
    minibatches: NumEnvs = 4
    """Minibatches per pass, with one update each."""
    trace_decay: Share = 0.65
    """λ of the λ-returns: 0 bootstraps after one step, 1 at the end of the rollout."""
    mirror_half: bool = False
    """Replace the steps of each environment by their mirror images with probability 1/2 in each
    rollout; the environment must declare its mirror symmetry (after van der Pol et al., 2020)."""

    def __post_init__(self) -> None:
        settle(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingConfig:
    """How long to train, how a checkpoint is selected, and what is recorded."""

    num_envs: NumEnvs = 1
    """Number of environments stepped in parallel."""
    episodes: AtLeastOne = 500
    """Stop training after this many episodes."""
    max_env_steps: Annotated[int, Meta(ge=0)] = 0
    """Also stop after the episode that reaches this many environment steps; 0: no limit."""
    validation_period: AtLeastOne = 10_000
    """Environment steps between validations: greedy episodes from validation starts."""
    validation_episodes: AtLeastOne = 20
    """Episodes per validation, each from a different validation start."""
    candidate_checkpoints: AtLeastOne = 5
    """Number of best checkpoints that are evaluated again after training, from fresh validation
    starts, to select one."""
    final_validation_episodes: AtLeastOne = 100
    """Episodes per candidate checkpoint, each from a fresh validation start."""
    test_episodes: Annotated[int, Meta(ge=0)] = 100
    """Test episodes of the selected checkpoint, each from a test start; 0 skips the test."""
    stop_when_solved: bool = False
    """Also stop training as soon as final_validation_episodes episodes from fresh validation starts
    show with high confidence that the policy will reach the environment's reward threshold in the
    test."""
    checkpoint_seconds: NonNegative = 10.0
    """Seconds between checkpoints, saved when an episode ends; 0 saves one after every episode."""
    metrics_period: AtLeastOne = 1_000
    """Updates between lines in updates.jsonl."""

    def __post_init__(self) -> None:
        settle(self)
        starts = self.validation_episodes + self.final_validation_episodes
        if starts > len(VALIDATION_STARTS):
            raise ValueError(
                f"validation_episodes + final_validation_episodes = {starts}: "
                f"must be at most {len(VALIDATION_STARTS)}, the number of validation starts"
            )
        test_ok = self.test_episodes <= len(TEST_STARTS)
        check(self, "test_episodes", ok=test_ok, wanted=f"at most {len(TEST_STARTS)}")
        if self.stop_when_solved and (
            self.final_validation_episodes < 30 or not self.test_episodes
        ):
            raise ValueError(
                "stop_when_solved = True: must have at least 30 final_validation_episodes and "
                f"1 test_episodes for its decision, got {self.final_validation_episodes} and "
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
