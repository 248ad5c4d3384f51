"""Levels of the paper's studies, and the settings that they share, at each scale."""

from collections.abc import Sequence
from typing import Any, Literal

from touchdown.stats import spending

Scale = Literal["quick", "full"]
SCALES: tuple[Scale, ...] = ("quick", "full")

_FUSED = {"learning": {"backend": "fused"}}
# sixteen environments and an update every fourth step take a fraction of the time; a quarter of the
# updates need a higher learning rate (studies/search-quick.toml has what else was tried)
_QUICK_LEARNING: dict[str, Any] = {
    **_FUSED["learning"],
    "learning_rate": 5e-4,
    "learning_rate_duration": 60_000,
    "update_period": 4,
}
SHARED: dict[Scale, dict[str, Any]] = {
    "quick": {
        "learning": _QUICK_LEARNING,
        "training": {
            "num_envs": 16,
            "episodes": 1_000_000,
            "max_env_steps": 240_000,
            "validation_period": 12_000,
        },
    },
    "full": {
        **_FUSED,
        "training": {"episodes": 1_000_000, "max_env_steps": 250_000},
    },
}
SEEDS: dict[Scale, int] = {"quick": 3, "full": 10}
LADDER_SEEDS: dict[Scale, int] = {"quick": 5, "full": 10}
FIRST_SEED: dict[Scale, int] = {"quick": 0, "full": 10}
"""The claims were chosen with results of seeds 0 to 9 at hand, so others decide them."""
LOOKS: dict[Scale, tuple[int, ...]] = {"quick": (), "full": (30, 60, 120)}
"""Seeds at which claims are decided. The quick scale decides none: its clocks are not the
paper's."""
PLAN_COMMIT = "bf4a224c"
"""The commit that planned the full scale's claims, margins, levels, seeds and looks. A later change
of the plan needs other seeds, and a new commit here."""
SPENDING = spending.POCOCK
"""A seed of all cells takes an hour, so the first looks get as much of the 5% as the last."""

BEST = "paper-best"
RUNGS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("dqn", {"preset": "dqn"}),
    ("target-dqn", {"preset": "target-dqn"}),
    ("preferential-dqn", {"preset": "preferential-dqn"}),
    (BEST, {"preset": "paper-best"}),
    # not in the paper: each is target-dqn with one later variant
    ("double", {"preset": "target-dqn", "learning": {"double": True}}),
    ("prioritized", {"preset": "target-dqn", "replay": {"prioritized": True}}),
)
NODES: dict[Scale, tuple[int, ...]] = {
    "quick": (10, 30, 100, 200),
    "full": (10, 30, 50, 100, 200, 400),
}
TARGET_PERIODS: dict[Scale, tuple[int, ...]] = {
    "quick": (1, 100, 800, 3_000, 10_000),
    "full": (1, 10, 100, 300, 800, 1_500, 3_000, 10_000),
}
RESAVES: dict[Scale, tuple[int, ...]] = {
    "quick": (0, 1, 5, 10, 20),
    "full": (0, 1, 2, 5, 10, 15, 20),
}
GAMMAS: dict[Scale, tuple[float, ...]] = {
    "quick": (0.9, 0.95, 0.98, 0.99, 0.999),
    "full": (0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999),
}
EPSILON_DECAYS: dict[Scale, tuple[float, ...]] = {
    "quick": (0.9, 0.95, 0.975, 0.99, 0.999),
    "full": (0.9, 0.95, 0.965, 0.975, 0.985, 0.99, 0.999),
}
MAP: dict[Scale, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "quick": ((0.95, 0.99, 0.999), (0.9, 0.975, 0.999)),
    "full": ((0.9, 0.95, 0.98, 0.99, 0.999), (0.9, 0.95, 0.975, 0.99, 0.999)),
}
DEPTHS = (1, 2, 3, 4, 5)
PID_TRIALS: dict[Scale, int] = {"quick": 150, "full": 400}


def shape_of(sizes: Sequence[int]) -> str:
    """The label of a network by its hidden layers, such as `100-100`."""
    return "-".join(map(str, sizes))


def split_evenly(nodes: int, depth: int) -> tuple[int, ...]:
    """Sizes of hidden layers that share a number of nodes, larger ones first."""
    return tuple(nodes // depth + (i < nodes % depth) for i in range(depth))
