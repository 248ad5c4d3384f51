"""The paper's experiments: each has a question, the study that answers it, and claims."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from touchdown.studies.claims import Claim
from touchdown.studies.paper import claims
from touchdown.studies.paper.levels import (
    BEST,
    DEPTHS,
    EPSILON_DECAYS,
    FIRST_SEED,
    GAMMAS,
    LADDER_SEEDS,
    LOOKS,
    MAP,
    NODES,
    PID_TRIALS,
    RESAVES,
    RUNGS,
    SEEDS,
    SHARED,
    SPENDING,
    TARGET_PERIODS,
    Scale,
    shape_of,
    split_evenly,
)
from touchdown.studies.plan import Factor, Level, Study, levels_of
from touchdown.studies.tuners import TUNERS, Tuning
from touchdown.studies.work import BaselineJob, PidJob


@dataclass(frozen=True, slots=True)
class Topic:
    """One of the paper's experiments, which is a section of the report."""

    name: str
    title: str
    section: str
    question: str
    study: Study | None
    """The study whose runs it uses; None for the PID tunings, which are not training runs."""
    claims: tuple[Claim, ...] = ()
    metric: str = "best_return"
    """Metric that its figure shows."""
    with_baselines: bool = False
    """Whether it compares with flights of the PID and of random actions."""


def topics(scale: Scale) -> dict[str, Topic]:
    """All topics of the paper by name, in the order of its sections."""
    return {topic.name: topic for topic in _topics(scale)}


@cache  # checking the settings of some hundred cells takes a third of a second
def _topics(scale: Scale) -> tuple[Topic, ...]:
    ladder = _study(
        "ladder",
        scale,
        "What each part brings",
        (Factor("variant", tuple(Level(label, changes) for label, changes in RUNGS)),),
    )
    size, depth = _size(scale), _depth(scale)
    period = _one_field(
        "target-period",
        scale,
        "Target period",
        "target period, env steps",
        "learning.target_period",
        TARGET_PERIODS[scale],
        800,
    )
    resaves = _one_field(
        "resaves",
        scale,
        "Preferential memory",
        "re-saves τ",
        "replay.resaves",
        RESAVES[scale],
        10,
    )
    discount = _one_field(
        "discount", scale, "Discount", "discount γ", "learning.gamma", GAMMAS[scale], 0.99
    )
    decay = _one_field(
        "epsilon-decay",
        scale,
        "Decay of ε",
        "decay of ε an episode",
        "exploration.epsilon_decay",
        EPSILON_DECAYS[scale],
        0.975,
    )
    combination = _combination(scale, (size, depth, period, resaves, discount, decay))
    found = [
        Topic(
            ladder.name,
            ladder.title,
            "4-9",
            "Does each part that the paper adds land better than the one before?",
            ladder,
            claims.ladder_claims(),
            with_baselines=True,
        ),
        Topic(
            "hover",
            "Hovering until the time limit",
            "5, 6",
            "How often do training episodes run all 1000 steps, and does this depend on the agent?",
            ladder,
            claims.hover_claims(),
            "hover_share",
        ),
        _topic(size, "8.1", "Do more nodes in a layer help?", claims.size_claims(scale)),
        _topic(
            depth,
            "8.1",
            "Does depth help, with 100 nodes in all and with 100 in each layer?",
            claims.depth_claims(),
        ),
        _topic(
            period,
            "8.2",
            "Is there a best period between copies to the target network, near 800 env steps?",
            claims.target_period_claims(scale),
        ),
        _topic(
            resaves,
            "8.3",
            "Do re-saves speed up early learning, and does the difference disappear later?",
            claims.resaves_claims(scale),
        ),
        _topic(
            discount,
            "8.4",
            "Is there a sweet spot for the discount?",
            claims.discount_claims(),
        ),
        _topic(
            decay,
            "8.4",
            "Is there a sweet spot for how fast exploration ends?",
            claims.epsilon_decay_claims(),
        ),
        _topic(_map(scale), "8.4", "Do the two sweet spots depend on each other?", ()),
        _topic(
            combination,
            "9",
            "Does any other value of one setting do better than the paper's best agent?",
            claims.combination_claims(combination.labels(0)),
        ),
        Topic(
            "alike",
            "Flights like the PID's",
            "9, C",
            "How far are the best agent's flights from the PID's, from the same starts?",
            ladder,
            claims.alike_claims(),
            with_baselines=True,
        ),
        Topic(
            "pid",
            "The PID and its tuners",
            "C",
            "How good are hand-picked gains, Twiddle's gains, and those of modern tuners?",
            None,
            claims.pid_claims(),
        ),
    ]
    return tuple(found)


def studies(scale: Scale) -> dict[str, Study]:
    """The paper's studies of training runs, by name."""
    of = [topic.study for topic in topics(scale).values() if topic.study is not None]
    return {study.name: study for study in of}


def pid_jobs(scale: Scale, seeds: int | None = None) -> list[PidJob]:
    """The PID tunings."""
    count = LADDER_SEEDS[scale] if seeds is None else seeds
    return [
        PidJob(Tuning(tuner=tuner, seed=seed, trials=PID_TRIALS[scale]))
        for seed in range(FIRST_SEED[scale], FIRST_SEED[scale] + count)
        for tuner in TUNERS
    ]


def baseline_jobs() -> list[BaselineJob]:
    """The flights that topics with `with_baselines` compare with."""
    return [BaselineJob("pid"), BaselineJob("random"), BaselineJob("heuristic")]


def _topic(study: Study, section: str, question: str, claimed: tuple[Claim, ...]) -> Topic:
    return Topic(study.name, study.title, section, question, study, claimed)


def _study(
    name: str,
    scale: Scale,
    title: str,
    factors: tuple[Factor, ...],
    base_level: str = "",
) -> Study:
    return Study(
        name=name,
        factors=factors,
        seeds=LADDER_SEEDS[scale] if name == "ladder" else SEEDS[scale],
        base=BEST,
        changes=SHARED[scale],
        base_level=base_level,
        first_seed=FIRST_SEED[scale],
        looks=LOOKS[scale],
        spending=SPENDING,
        title=title,
    )


def _one_field(
    name: str,
    scale: Scale,
    title: str,
    axis: str,
    field: str,
    values: Sequence[float],
    base: float,
) -> Study:
    factor = Factor(axis, levels_of(field, values))
    return _study(name, scale, title, (factor,), f"{base:g}")


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
            for nodes in NODES[scale]
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
                (shape_of(sizes), "100 nodes in all", depth, sizes)
                for depth in DEPTHS
                for sizes in [split_evenly(100, depth)]
            ),
            # one layer of 100 nodes is in the first line already
            *(
                (shape_of((100,) * depth), "100 nodes in each", depth, (100,) * depth)
                for depth in DEPTHS[1:]
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
            Level(label, {"network.hidden_sizes": sizes}, float(position), series)
            for label, series, position, sizes in levels
        ),
    )
    return _study(name, scale, title, (factor,), base)


def _combination(scale: Scale, others: Sequence[Study]) -> Study:
    """The best agent, and each one that differs from it in one setting.

    Args:
        scale: scale of the runs.
        others: the studies of one setting each; their runs are shared.
    """
    levels: dict[str, Level] = {}
    for study in others:
        for cell, level in zip(study.cells(), study.factors[0].levels, strict=True):
            is_best = cell.name == study.base_level
            label = BEST if is_best else f"{study.title.lower()} {level.label}"
            levels.setdefault(cell.config.digest, Level(label, level.changes))
    best_first = sorted(levels.values(), key=lambda level: level.label != BEST)
    return _study("combination", scale, "Other values", (Factor("agent", tuple(best_first)),), BEST)


def _map(scale: Scale) -> Study:
    gammas, decays = MAP[scale]
    return _study(
        "discount-epsilon-decay",
        scale,
        "Discount and decay of ε together",
        (
            Factor("discount γ", levels_of("learning.gamma", gammas)),
            Factor("decay of ε an episode", levels_of("exploration.epsilon_decay", decays)),
        ),
        "0.99 · 0.975",
    )
