"""The paper's studies and claims, at two scales."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from touchdown.studies.claims import (
    Alike,
    Best,
    Beyond,
    Claim,
    Greater,
    Labels,
    Near,
    SweetSpot,
    Trend,
)
from touchdown.studies.plan import Factor, Level, Study, levels_of, nested
from touchdown.studies.tuners import TUNERS, Tuning
from touchdown.studies.work import PidJob

Scale = Literal["quick", "full"]
SCALES: tuple[Scale, ...] = ("quick", "full")

_FUSED = {"learning": {"backend": "fused"}}
# sixteen worlds side by side and an update every fourth observation take a small part of the time;
# a quarter of the updates want a higher rate (benchmarks/search/quick-study.toml tells what others
# reach, on seeds that no study uses)
_QUICK_LEARNING: dict[str, Any] = {
    **_FUSED["learning"],
    "learning_rate": 5e-4,
    "learning_rate_duration": 60_000,
    "update_period": 4,
}
_SHARED: dict[Scale, dict[str, Any]] = {
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
_SEEDS: dict[Scale, int] = {"quick": 3, "full": 10}
_LADDER_SEEDS: dict[Scale, int] = {"quick": 5, "full": 10}

BEST = "paper-best"
RUNGS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("dqn", {"preset": "dqn"}),
    ("target-dqn", {"preset": "target-dqn"}),
    ("preferential-dqn", {"preset": "preferential-dqn"}),
    (BEST, {"preset": "paper-best"}),
    # the field's own, each on the paper's rung below it
    ("double", {"preset": "target-dqn", "learning": {"double": True}}),
    ("prioritized", {"preset": "target-dqn", "replay": {"prioritized": True}}),
)
_NODES: dict[Scale, tuple[int, ...]] = {
    "quick": (10, 30, 100, 200),
    "full": (10, 30, 50, 100, 200, 400),
}
_PERIODS: dict[Scale, tuple[int, ...]] = {
    "quick": (1, 100, 800, 3_000, 10_000),
    "full": (1, 10, 100, 300, 800, 1_500, 3_000, 10_000),
}
_RESAVES: dict[Scale, tuple[int, ...]] = {
    "quick": (0, 1, 5, 10, 20),
    "full": (0, 1, 2, 5, 10, 15, 20),
}
_GAMMAS: dict[Scale, tuple[float, ...]] = {
    "quick": (0.9, 0.95, 0.98, 0.99, 0.999),
    "full": (0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999),
}
_DECAYS: dict[Scale, tuple[float, ...]] = {
    "quick": (0.9, 0.95, 0.975, 0.99, 0.999),
    "full": (0.9, 0.95, 0.965, 0.975, 0.985, 0.99, 0.999),
}
_MAP: dict[Scale, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "quick": ((0.95, 0.99, 0.999), (0.9, 0.975, 0.999)),
    "full": ((0.9, 0.95, 0.98, 0.99, 0.999), (0.9, 0.95, 0.975, 0.99, 0.999)),
}
_DEPTHS = (1, 2, 3, 4, 5)
_ABOUT = 20.0
"""Return points within which two means count as about the same."""
_TRIALS: dict[Scale, int] = {"quick": 150, "full": 400}


@dataclass(frozen=True, slots=True)
class Topic:
    """One row of the paper's experiments: what the report has a section for."""

    name: str
    title: str
    section: str
    question: str
    study: Study | None
    """The study whose runs it looks at; None for the PID's, which are no training runs."""
    claims: tuple[Claim, ...] = ()
    metric: str = "best_return"
    """What its figure shows."""


def shared_changes(scale: Scale) -> dict[str, Any]:
    """What all the paper's runs have in common at a scale."""
    return _SHARED[scale]


def topics(scale: Scale) -> dict[str, Topic]:
    """All of the paper's, by name, in the order of its sections."""
    ladder = _study(
        "ladder",
        scale,
        "What each part brings",
        "4-9",
        (Factor("variant", tuple(Level(label, changes) for label, changes in RUNGS)),),
    )
    found = [
        _topic(
            ladder,
            "Does each part that the paper adds land better than the one before?",
            _ladder_claims(),
        ),
        Topic(
            "hover",
            "Hovering until the time is up",
            "5, 6",
            "How often does a training episode run all its 1000 steps, and who unlearns it?",
            ladder,
            _hover_claims(),
            "hover_share",
        ),
        _topic(
            _size(scale),
            "Do more nodes in a layer help?",
            _size_claims(scale),
        ),
        _topic(
            _depth(scale),
            "Does depth help, with 100 nodes in all and with 100 in each layer?",
            _depth_claims(),
        ),
        _topic(
            _one_field(
                "target-period",
                scale,
                "Target period",
                "8.2",
                "target period, observations",
                "learning.target_period",
                _PERIODS[scale],
                800,
            ),
            "Is there a best period between copies to the target network, near 800 observations?",
            (
                Claim(
                    "A target period around 800 observations is best.",
                    "8.2",
                    Best((("800",),), _labels(_PERIODS[scale])),
                ),
                Claim("Short periods do worse than 800.", "8.2", Greater(("800",), ("1",))),
                Claim("Long periods do worse than 800.", "8.2", Greater(("800",), ("10000",))),
            ),
        ),
        _topic(
            _one_field(
                "resaves",
                scale,
                "Preferential memory",
                "8.3",
                "re-saves τ",
                "replay.resaves",
                _RESAVES[scale],
                10,
            ),
            "Does storing rewarded transitions again speed learning up, and is it level late?",
            _resaves_claims(scale),
        ),
        _topic(
            _one_field(
                "discount",
                scale,
                "Discount",
                "8.4",
                "discount γ",
                "learning.gamma",
                _GAMMAS[scale],
                0.99,
            ),
            "Is there a sweet spot for the discount?",
            (
                Claim(
                    "γ has a sweet spot: 0.99 does better than 0.9 and than 0.999.",
                    "8.4",
                    SweetSpot(("0.99",), ("0.9",), ("0.999",)),
                ),
            ),
        ),
        _topic(
            _one_field(
                "epsilon-decay",
                scale,
                "Decay of ε",
                "8.4",
                "decay of ε an episode",
                "exploration.epsilon_decay",
                _DECAYS[scale],
                0.975,
            ),
            "Is there a sweet spot for how fast exploration ends?",
            (
                Claim(
                    "The decay of ε has a sweet spot: 0.975 does better than 0.9 and than 0.999.",
                    "8.4",
                    SweetSpot(("0.975",), ("0.9",), ("0.999",)),
                ),
            ),
        ),
        _topic(_map(scale), "Do the two sweet spots hang on each other?", ()),
        Topic(
            "alike",
            "Flights like the PID's",
            "9, C",
            "How far are the best agent's flights from the PID's from the same starts?",
            ladder,
            _alike_claims(),
        ),
        Topic(
            "pid",
            "The PID and its tuners",
            "C",
            "What do gains by hand reach, Twiddle's, and those of modern tuners?",
            None,
            _pid_claims(),
        ),
    ]
    return {topic.name: topic for topic in found}


def studies(scale: Scale) -> dict[str, Study]:
    """The paper's studies of training runs, by name, each once."""
    of = [topic.study for topic in topics(scale).values() if topic.study is not None]
    return {study.name: study for study in of}


def pid_jobs(scale: Scale, seeds: int | None = None) -> list[PidJob]:
    """The tunings of the PID."""
    count = _LADDER_SEEDS[scale] if seeds is None else seeds
    return [
        PidJob(Tuning(tuner=tuner, seed=seed, trials=_TRIALS[scale]))
        for seed in range(count)
        for tuner in TUNERS
    ]


def _topic(study: Study, question: str, claims: Sequence[Claim]) -> Topic:
    return Topic(study.name, study.title, study.section, question, study, tuple(claims))


def _study(
    name: str,
    scale: Scale,
    title: str,
    section: str,
    factors: tuple[Factor, ...],
    base_level: str = "",
) -> Study:
    return Study(
        name=name,
        factors=factors,
        seeds=_LADDER_SEEDS[scale] if name == "ladder" else _SEEDS[scale],
        base=BEST,
        changes=_SHARED[scale],
        base_level=base_level,
        title=title,
        section=section,
    )


def _one_field(
    name: str,
    scale: Scale,
    title: str,
    section: str,
    axis: str,
    field: str,
    values: Sequence[float],
    base: float,
) -> Study:
    factor = Factor(axis, levels_of(field, values))
    return _study(name, scale, title, section, (factor,), f"{base:g}")


def _size(scale: Scale) -> Study:
    return _layered(
        "size",
        scale,
        "Size",
        "nodes in each hidden layer",
        [
            (
                f"{layers} × {nodes}",
                f"{layers} hidden layer{'s' * (layers > 1)}",
                nodes,
                (nodes,) * layers,
            )
            for layers in (1, 3)
            for nodes in _NODES[scale]
        ],
        "3 × 100",
    )


def _depth(scale: Scale) -> Study:
    return _layered(
        "depth",
        scale,
        "Depth",
        "hidden layers",
        [
            *(
                (_shape(sizes), "100 nodes in all", depth, sizes)
                for depth in _DEPTHS
                for sizes in [tuple(100 // depth + (i < 100 % depth) for i in range(depth))]
            ),
            # one layer of 100 nodes is in the first line already
            *(
                (_shape((100,) * depth), "100 nodes in each", depth, (100,) * depth)
                for depth in _DEPTHS[1:]
            ),
        ],
        "100-100-100",
    )


def _layered(
    name: str,
    scale: Scale,
    title: str,
    axis: str,
    levels: Sequence[tuple[str, str, int, tuple[int, ...]]],
    base: str,
) -> Study:
    factor = Factor(
        axis,
        tuple(
            Level(label, nested("network.hidden_sizes", sizes), float(position), series)
            for label, series, position, sizes in levels
        ),
    )
    return _study(name, scale, title, "8.1", (factor,), base)


def _shape(sizes: Sequence[int]) -> str:
    return "-".join(map(str, sizes))


def _map(scale: Scale) -> Study:
    gammas, decays = _MAP[scale]
    return _study(
        "discount-epsilon-decay",
        scale,
        "Discount and decay of ε together",
        "8.4",
        (
            Factor("discount γ", levels_of("learning.gamma", gammas)),
            Factor("decay of ε an episode", levels_of("exploration.epsilon_decay", decays)),
        ),
        "0.99 · 0.975",
    )


def _labels(values: Sequence[float]) -> tuple[Labels, ...]:
    return tuple((f"{value:g}",) for value in values)


def _ladder_claims() -> tuple[Claim, ...]:
    return (
        Claim("Plain DQN ends below 100.", "5", Beyond(("dqn",), 100, "below")),
        Claim("A target network raises the return.", "6", Greater(("target-dqn",), ("dqn",))),
        Claim(
            "With a target network the return is about 170.",
            "6",
            Near(("target-dqn",), 170, _ABOUT),
        ),
        Claim(
            "Preferential memory raises it further.",
            "7",
            Greater(("preferential-dqn",), ("target-dqn",)),
        ),
        Claim(
            "With preferential memory the return is about 199.",
            "7",
            Near(("preferential-dqn",), 199, _ABOUT),
        ),
        Claim("The best agent averages about 221.", "9", Near((BEST,), 221, _ABOUT)),
        Claim(
            "The best agent is always above 200: its worst flight, averaged over seeds, is.",
            "9",
            Beyond((BEST,), 200, "above", "worst_return"),
        ),
    )


def _hover_claims() -> tuple[Claim, ...]:
    return (
        Claim(
            "Most training episodes of plain DQN run all 1000 steps.",
            "5",
            Beyond(("dqn",), 0.5, "above", "hover_share"),
        ),
        Claim(
            "The best agent hovers less than plain DQN.",
            "5, 6",
            Greater(("dqn",), (BEST,), "hover_share"),
        ),
    )


def _size_claims(scale: Scale) -> tuple[Claim, ...]:
    return tuple(
        Claim(
            f"More nodes lower the return, with {words}.",
            "8.1",
            Trend(tuple((f"{layers} × {nodes}",) for nodes in _NODES[scale]), "fall"),
        )
        for layers, words in ((1, "one hidden layer"), (3, "three hidden layers"))
    )


def _depth_claims() -> tuple[Claim, ...]:
    in_all = tuple(
        (_shape([100 // depth + (i < 100 % depth) for i in range(depth)]),) for depth in _DEPTHS
    )
    return (
        Claim("With 100 nodes in all, deeper is better.", "8.1", Trend(in_all)),
        Claim(
            "With 100 nodes in each layer, deeper is better.",
            "8.1",
            Trend(tuple((_shape((100,) * depth),) for depth in _DEPTHS)),
        ),
    )


def _resaves_claims(scale: Scale) -> tuple[Claim, ...]:
    every = _labels(_RESAVES[scale])
    some = tuple(labels for labels in every if labels != ("0",))
    return (
        Claim("More re-saves bring more return.", "8.3", Trend(every)),
        Claim(
            "More re-saves speed up early learning.", "8.3", Trend(every, "rise", "early_return")
        ),
        Claim(
            "Late in training, how many re-saves makes little difference.",
            "8.3",
            Alike(some[0], some[-1], _ABOUT, "last_return"),
        ),
        Claim(
            "Without re-saves the agent still lags behind late.",
            "8.3",
            Greater(some[-1], ("0",), "last_return"),
        ),
    )


def _alike_claims() -> tuple[Claim, ...]:
    return (
        Claim(
            "The best agent's flights are nearer to the PID's than to random ones.",
            "9, C",
            Greater(("to random",), ("to the PID",), "distance"),
        ),
        Claim(
            "They are as near to the PID's as to those of the agent's other seeds.",
            "9, C",
            Beyond(("to the PID, over to another seed",), 1.0, "below", "ratio"),
        ),
    )


def _pid_claims() -> tuple[Claim, ...]:
    return (
        Claim("The tuned PID averages about 222.", "C", Near(("twiddle",), 222, _ABOUT)),
        Claim(
            "Twiddle betters gains that were picked by hand.",
            "C",
            Greater(("twiddle",), ("hand",)),
        ),
    )
