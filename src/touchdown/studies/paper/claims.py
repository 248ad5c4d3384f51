"""The paper's claims, paraphrased, each with the test that decides it."""

from collections.abc import Sequence

from touchdown.studies.claim_tests import (
    Alike,
    Best,
    Beyond,
    Greater,
    Monotonic,
    Near,
    SweetSpot,
)
from touchdown.studies.claims import Claim, Labels
from touchdown.studies.paper.levels import (
    BEST,
    DEPTHS,
    NODES,
    RESAVES,
    TARGET_PERIODS,
    Scale,
    shape_of,
    split_evenly,
)

_ABOUT = 20.0
"""Margin in return points within which two means count as about the same."""


def labels_of(values: Sequence[float]) -> tuple[Labels, ...]:
    """The labels of the cells of a study that varies one number."""
    return tuple((f"{value:g}",) for value in values)


def ladder_claims() -> tuple[Claim, ...]:
    """The effect of each part (sections 4-9)."""
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


def hover_claims() -> tuple[Claim, ...]:
    """How often episodes reach the time limit (sections 5 and 6)."""
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


def size_claims(scale: Scale) -> tuple[Claim, ...]:
    """Nodes in a layer (section 8.1)."""
    return tuple(
        Claim(
            f"More nodes lower the return, with {words}.",
            "8.1",
            Monotonic(tuple((f"{layers} × {nodes}",) for nodes in NODES[scale]), "fall"),
        )
        for layers, words in ((1, "one hidden layer"), (3, "three hidden layers"))
    )


def depth_claims() -> tuple[Claim, ...]:
    """Hidden layers (section 8.1)."""
    in_all = tuple((shape_of(split_evenly(100, depth)),) for depth in DEPTHS)
    return (
        Claim("With 100 nodes in all, deeper is better.", "8.1", Monotonic(in_all)),
        Claim(
            "With 100 nodes in each layer, deeper is better.",
            "8.1",
            Monotonic(tuple((shape_of((100,) * depth),) for depth in DEPTHS)),
        ),
    )


def resaves_claims(scale: Scale) -> tuple[Claim, ...]:
    """Preferential memory (section 8.3)."""
    every = labels_of(RESAVES[scale])
    some = tuple(labels for labels in every if labels != ("0",))
    return (
        Claim("More re-saves bring more return.", "8.3", Monotonic(every)),
        Claim(
            "More re-saves speed up early learning.",
            "8.3",
            Monotonic(every, "rise", "early_return"),
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


def alike_claims() -> tuple[Claim, ...]:
    """How close the agent's flights are to the PID's (section 9, appendix C)."""
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


def pid_claims() -> tuple[Claim, ...]:
    """The tuned PID (appendix C)."""
    return (
        Claim("The tuned PID averages about 222.", "C", Near(("twiddle",), 222, _ABOUT)),
        Claim(
            "Twiddle improves on gains that were picked by hand.",
            "C",
            Greater(("twiddle",), ("hand",)),
        ),
    )


def target_period_claims(scale: Scale) -> tuple[Claim, ...]:
    """The target network update period (section 8.2)."""
    return (
        Claim(
            "A target period around 800 env steps is best.",
            "8.2",
            Best((("800",),), labels_of(TARGET_PERIODS[scale])),
        ),
        Claim("Short periods do worse than 800.", "8.2", Greater(("800",), ("1",))),
        Claim("Long periods do worse than 800.", "8.2", Greater(("800",), ("10000",))),
    )


def discount_claims() -> tuple[Claim, ...]:
    """The discount factor (section 8.4)."""
    return (
        Claim(
            "γ has a sweet spot: 0.99 does better than 0.9 and than 0.999.",
            "8.4",
            SweetSpot(("0.99",), ("0.9",), ("0.999",)),
        ),
    )


def epsilon_decay_claims() -> tuple[Claim, ...]:
    """The decay of ε (section 8.4)."""
    return (
        Claim(
            "The decay of ε has a sweet spot: 0.975 does better than 0.9 and than 0.999.",
            "8.4",
            SweetSpot(("0.975",), ("0.9",), ("0.999",)),
        ),
    )
