"""The sections of a config: each a frozen dataclass that says its units and refuses nonsense."""

import math
from dataclasses import dataclass
from typing import Any, Literal

from touchdown.config.checks import check, settle
from touchdown.core.seeding import TEST_STARTS, VALIDATION_STARTS

Algorithm = Literal["dqn", "pqn", "tabular", "value-iteration"]
Backend = Literal["jax", "fused"]

# Above these a setting is a slip of the finger, and would end in a system without memory.
_MOST_NODES = 100_000
_MOST_TRANSITIONS = 1_000_000_000
_MOST_RESAVES = 1_000_000
_MOST_STEPS = 2**31 - 1  # optax counts in 32 bits
_MOST_N_STEP = 1_000
_MOST_ENVS = 10_000
_MOST_STATES = 100_000_000
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
    quantiles: int = 0
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
    """Weights that learning draws anew around learnt means, to explore by (Fortunato et al., 2018);
    greedy flights take the means."""
    noisy_sigma: float = 0.5
    """σ₀: deviation of noisy weights at the start, times the root of the layer's inputs."""

    def __post_init__(self) -> None:
        settle(self)
        sizes_ok = all(0 < size <= _MOST_NODES for size in self.hidden_sizes)
        check(self, "hidden_sizes", ok=sizes_ok, wanted=f"from 1 to {_MOST_NODES} nodes each")
        quantiles_ok = 0 <= self.quantiles <= _MOST_NODES
        check(self, "quantiles", ok=quantiles_ok, wanted=f"from 0 (none) to {_MOST_NODES}")
        atoms_ok = self.atoms == 0 or 2 <= self.atoms <= _MOST_NODES
        check(self, "atoms", ok=atoms_ok, wanted=f"0 (none) or from 2 to {_MOST_NODES}")
        below = self.v_min < self.v_max
        check(self, "v_min", ok=below, wanted=f"below v_max = {self.v_max}")
        check(self, "noisy_sigma", ok=self.noisy_sigma > 0, wanted="above 0")
        if self.atoms and self.quantiles:
            raise ValueError(
                f"atoms = {self.atoms}: must be 0 beside quantiles = {self.quantiles}; "
                "a return is described by one or the other, not both"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayConfig:
    """The memory (Algorithm 2) and its preferential re-saves (section 7)."""

    capacity: int = 100_000
    """Size of the first-in, first-out memory (transitions, copies counted)."""
    min_size: int = 1_000
    """Transitions held before the first update."""
    resaves: int = 0
    """τ: how often a rewarded transition is stored again; 0 is plain replay."""
    resave_threshold: float = 0.0
    """A transition is rewarded when its reward is above this (reward units)."""
    prioritized: bool = False
    """Transitions are drawn by their last TD error (Schaul et al., 2016), not uniformly."""
    alpha: float = 0.6
    """Exponent of the priorities; 0 would be uniform."""
    beta: float = 0.4
    """Exponent of the importance weights at the start; it rises to 1 in a line."""
    beta_duration: int = 100_000
    """Updates until that exponent is 1."""

    def __post_init__(self) -> None:
        settle(self)
        fits = 0 < self.capacity <= _MOST_TRANSITIONS
        check(self, "capacity", ok=fits, wanted=f"from 1 to {_MOST_TRANSITIONS} transitions")
        check(self, "min_size", ok=self.min_size > 0, wanted="at least 1 transition")
        if self.min_size > self.capacity:
            raise ValueError(
                f"min_size = {self.min_size}: must be at most capacity = {self.capacity}"
            )
        for name in ("alpha", "beta"):
            check(self, name, ok=0 <= getattr(self, name) <= 1, wanted="from 0 to 1")
        duration_ok = 0 < self.beta_duration <= _MOST_STEPS
        check(self, "beta_duration", ok=duration_ok, wanted=f"from 1 to {_MOST_STEPS} updates")
        resaves_ok = 0 <= self.resaves <= _MOST_RESAVES
        check(self, "resaves", ok=resaves_ok, wanted=f"from 0 to {_MOST_RESAVES}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplorationConfig:
    """ε-greedy exploration (section 2, Eq. 3)."""

    schedule: Literal["constant", "linear", "exponential"] = "exponential"
    """How ε falls: never, in a line over observations, or by a factor an episode (the paper's)."""
    epsilon_start: float = 1.0
    """ε at the start (probability)."""
    epsilon_end: float = 0.01
    """Floor of ε for the linear and the exponential schedule (probability)."""
    epsilon_decay: float = 0.975
    """Factor on ε after each episode, for the exponential schedule."""
    epsilon_duration: int = 50_000
    """Observations from epsilon_start to epsilon_end, for the linear schedule."""

    def __post_init__(self) -> None:
        settle(self)
        for name in ("epsilon_start", "epsilon_end", "epsilon_decay"):
            check(self, name, ok=0 <= getattr(self, name) <= 1, wanted="from 0 to 1")
        if self.schedule != "constant" and self.epsilon_end > self.epsilon_start:
            raise ValueError(
                f"epsilon_end = {self.epsilon_end}: "
                f"must be at most epsilon_start = {self.epsilon_start}"
            )
        duration_ok = self.epsilon_duration > 0
        check(self, "epsilon_duration", ok=duration_ok, wanted="at least 1 observation")


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningConfig:
    """Q-learning's update (Eq. 4 and 5) and its optimiser (appendix B)."""

    gamma: float = 0.99
    """γ: discount of the next step's value."""
    learning_rate: float = 5e-4
    """Step size of the optimiser, at the start."""
    learning_rate_end: float = 0.0
    """Step size once learning_rate_duration updates are done."""
    learning_rate_duration: int = 0
    """Updates over which the step size falls in a line; 0 keeps learning_rate throughout."""
    optimizer: Literal["adam", "adamw", "rmsprop", "sgd"] = "adam"
    """Optimiser, by optax's name."""
    backend: Backend = "jax"
    """What computes updates: `jax`, or `fused`: forward, backward and Adam in one call of our own,
    in C++ on the CPU, for networks of ReLU layers whose outputs are values."""
    batch_size: int = 64
    """Transitions in a minibatch."""
    loss: Literal["mse", "huber"] = "mse"
    """Loss of the TD error: its square, or Huber's with the knee at 1 scaled reward unit. Of no
    account beside atoms, whose loss is the cross entropy."""
    reward_scale: float = 1.0
    """Factor on rewards inside the update (recorded returns keep their units)."""
    max_grad_norm: float = 0.0
    """Gradients longer than this are shortened to it; 0 never clips."""
    target: Literal["q-learning", "sarsa", "expected-sarsa"] = "q-learning"
    """What the TD target takes of the next action values: the greatest, the one of the action that
    came next (appendix A), or their mean over the ε-greedy policy."""
    update_period: int = 1
    """Observations between updates (Algorithm 2: 1); with 32 worlds side by side, 16 makes two
    updates a step of them all."""
    gradient_steps: int = 1
    """Updates each time."""
    target_period: int = 0
    """n: observations between copies to the target network; 0 makes no copies (section 6)."""
    polyak: float = 0.0
    """Share of the weights that the target network takes over after each update (Lillicrap et al.,
    2016); 0 never. A target network is copied or follows, not both; with neither there is none."""
    double: bool = False
    """The online network selects the next action, the target network evaluates it (van Hasselt et
    al., 2016)."""
    n_step: int = 1
    """Steps whose rewards one transition gathers before it bootstraps."""

    def __post_init__(self) -> None:
        settle(self)
        check(self, "gamma", ok=0 <= self.gamma <= 1, wanted="from 0 to 1")
        check(self, "learning_rate", ok=self.learning_rate > 0, wanted="above 0")
        check(self, "learning_rate_end", ok=self.learning_rate_end >= 0, wanted="0 or more")
        check(self, "reward_scale", ok=self.reward_scale > 0, wanted="above 0")
        check(self, "max_grad_norm", ok=self.max_grad_norm >= 0, wanted="0 (never) or more")
        batch_ok = 0 < self.batch_size <= _MOST_TRANSITIONS
        check(self, "batch_size", ok=batch_ok, wanted=f"from 1 to {_MOST_TRANSITIONS} transitions")
        check(self, "update_period", ok=self.update_period > 0, wanted="at least 1 observation")
        steps_ok = 0 < self.gradient_steps <= _MOST_N_STEP
        check(self, "gradient_steps", ok=steps_ok, wanted=f"1 to {_MOST_N_STEP} updates")
        for name in ("learning_rate_duration", "target_period"):
            ok = 0 <= getattr(self, name) <= _MOST_STEPS
            check(self, name, ok=ok, wanted=f"from 0 to {_MOST_STEPS}")
        check(self, "polyak", ok=0 <= self.polyak <= 1, wanted="from 0 (never) to 1")
        check(self, "n_step", ok=0 < self.n_step <= _MOST_N_STEP, wanted=f"1 to {_MOST_N_STEP}")
        if self.polyak and self.target_period:
            raise ValueError(
                f"polyak = {self.polyak}: must be 0 beside target_period = {self.target_period}; "
                "a target network is copied or follows, not both"
            )
        if self.double and not self.has_target:
            raise ValueError(
                "double = True: must have a target network to evaluate; "
                "set target_period or polyak above 0"
            )
        if self.double and self.target != "q-learning":
            raise ValueError(
                f"double = True: must be False beside target = {self.target!r}; nothing is left to "
                "select where the next action is given"
            )

    @property
    def has_target(self) -> bool:
        """Whether a target network bootstraps."""
        return self.target_period > 0 or self.polyak > 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TableConfig:
    """A table of action values (Algorithm 1), and how a Box of observations is cut into states."""

    bins: tuple[int, ...] = ()
    """Equal parts of each dimension of a Box; a Discrete world has its states already."""
    bins_low: tuple[float, ...] = ()
    """Where the parts of each dimension begin; what is below belongs to the first. () takes the
    world's own bounds."""
    bins_high: tuple[float, ...] = ()
    """Where they end; what is above belongs to the last. () takes the world's own bounds."""
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
    """Learning without a memory from what many worlds gave just now (PQN; Gallici et al., 2025)."""

    rollout_steps: int = 32
    """Steps of every world between two rounds of learning."""
    epochs: int = 2
    """Times that a round goes through all of them."""
    minibatches: int = 4
    """Parts of each time, an update each."""
    trace_decay: float = 0.65
    """λ of the returns: 0 looks one step ahead, 1 to the end of the rollout."""

    def __post_init__(self) -> None:
        settle(self)
        for name in ("rollout_steps", "epochs", "minibatches"):
            ok = 0 < getattr(self, name) <= _MOST_ENVS
            check(self, name, ok=ok, wanted=f"from 1 to {_MOST_ENVS}")
        check(self, "trace_decay", ok=0 <= self.trace_decay <= 1, wanted="from 0 to 1")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingConfig:
    """How long to train, how a checkpoint is chosen, and what is written down on the way."""

    num_envs: int = 1
    """Worlds that the agent acts in side by side."""
    episodes: int = 500
    """Training ends after this many episodes."""
    max_env_steps: int = 0
    """Training also ends with the episode that reaches this many observations; 0 is no limit."""
    validation_period: int = 10_000
    """Observations between greedy flights on validation starts."""
    validation_episodes: int = 20
    """Validation starts flown each time."""
    candidate_checkpoints: int = 5
    """Best checkpoints that fly again at the end, on fresh validation starts, for the choice."""
    final_validation_episodes: int = 100
    """Validation starts that each finalist flies."""
    test_episodes: int = 100
    """Test starts that the chosen checkpoint flies at the very end; 0 skips the test."""
    stop_when_solved: bool = False
    """Training also ends as soon as final_validation_episodes fresh validation starts leave no
    doubt that the policy reaches the world's reward threshold on test_episodes others."""
    checkpoint_seconds: float = 10.0
    """Seconds between checkpoints, taken where an episode ends; 0 takes one after each episode."""
    metrics_period: int = 1_000
    """Updates between lines in updates.jsonl."""

    def __post_init__(self) -> None:
        settle(self)
        for name in ("max_env_steps", "test_episodes", "checkpoint_seconds"):
            check(self, name, ok=getattr(self, name) >= 0, wanted="0 or more")
        flown = self.validation_episodes + self.final_validation_episodes
        if flown > len(VALIDATION_STARTS):
            raise ValueError(
                f"validation_episodes + final_validation_episodes = {flown}: "
                f"must be at most {len(VALIDATION_STARTS)}, as there are no more starts"
            )
        test_ok = self.test_episodes <= len(TEST_STARTS)
        check(self, "test_episodes", ok=test_ok, wanted=f"at most {len(TEST_STARTS)}")
        envs_ok = 0 < self.num_envs <= _MOST_ENVS
        check(self, "num_envs", ok=envs_ok, wanted=f"from 1 to {_MOST_ENVS}")
        if self.stop_when_solved and (
            self.final_validation_episodes < 30 or not self.test_episodes
        ):
            raise ValueError(
                "stop_when_solved = True: must have at least 30 final_validation_episodes and 1 of "
                f"test_episodes to be sure by, got {self.final_validation_episodes} and "
                f"{self.test_episodes}"
            )
        for name in (
            "episodes",
            "validation_period",
            "validation_episodes",
            "candidate_checkpoints",
            "final_validation_episodes",
            "metrics_period",
        ):
            check(self, name, ok=getattr(self, name) > 0, wanted="at least 1")


SECTIONS: dict[str, type[Any]] = {
    "network": NetworkConfig,
    "replay": ReplayConfig,
    "exploration": ExplorationConfig,
    "learning": LearningConfig,
    "table": TableConfig,
    "rollout": RolloutConfig,
    "training": TrainingConfig,
}
