"""The paper's claims, paraphrased, each with the test that decides it."""

from collections.abc import Sequence

from touchdown.studies.claim_tests import (
    Alike,
    Best,
    Beyond,
    Greater,
    Near,
    SweetSpot,
    Trend,
)
from touchdown.studies.claims import Claim
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


def _names(values: Sequence[float]) -> tuple[str, ...]:
    """The names of the cells of a study that varies one number."""
    return tuple(f"{value:g}" for value in values)


def ladder_claims() -> tuple[Claim, ...]:
    """The effect of each part (sections 4-9)."""
    return (
        Claim("Plain DQN ends below 100.", Beyond("dqn", 100, "below"), section="5"),
        Claim("A target network raises the return.", Greater("target-dqn", "dqn"), section="6"),
        Claim(
            "With a target network the return is about 170.",
            Near("target-dqn", 170, _ABOUT),
            section="6",
        ),
        Claim(
            "Preferential memory raises it further.",
            Greater("preferential-dqn", "target-dqn"),
            section="7",
        ),
        Claim(
            "With preferential memory the return is about 199.",
            Near("preferential-dqn", 199, _ABOUT),
            section="7",
        ),
        Claim("The best agent averages about 221.", Near(BEST, 221, _ABOUT), section="9"),
        Claim(
            "The best agent is always above 200: its worst flight, averaged over seeds, is.",
            Beyond(BEST, 200, "above"),
            "worst_return",
            "9",
        ),
    )


def hover_claims() -> tuple[Claim, ...]:
    """How often episodes reach the time limit (sections 5 and 6)."""
    return (
        Claim(
            "Most training episodes of plain DQN run all 1000 steps.",
            Beyond("dqn", 0.5, "above"),
            "hover_share",
            "5",
        ),
        Claim(
            "The best agent hovers less than plain DQN.",
            Greater("dqn", BEST),
            "hover_share",
            "5, 6",
        ),
    )


def size_claims(scale: Scale) -> tuple[Claim, ...]:
    """Nodes in a layer (section 8.1)."""
    return tuple(
        Claim(
            f"More nodes lower the return, with {words}.",
            Trend(tuple(f"{layers} × {nodes}" for nodes in NODES[scale]), "fall"),
            section="8.1",
        )
        for layers, words in ((1, "one hidden layer"), (3, "three hidden layers"))
    )


def depth_claims() -> tuple[Claim, ...]:
    """Hidden layers (section 8.1)."""
    in_all = tuple(shape_of(split_evenly(100, depth)) for depth in DEPTHS)
    in_each = tuple(shape_of((100,) * depth) for depth in DEPTHS)
    return (
        Claim("With 100 nodes in all, deeper is better.", Trend(in_all), section="8.1"),
        Claim("With 100 nodes in each layer, deeper is better.", Trend(in_each), section="8.1"),
    )


def resaves_claims(scale: Scale) -> tuple[Claim, ...]:
    """Preferential memory (section 8.3)."""
    every = _names(RESAVES[scale])
    some = tuple(name for name in every if name != "0")
    return (
        Claim("More re-saves bring more return.", Trend(every), section="8.3"),
        Claim("More re-saves speed up early learning.", Trend(every), "early_return", "8.3"),
        Claim(
            "Late in training, how many re-saves makes little difference.",
            Alike(some[0], some[-1], _ABOUT),
            "last_return",
            "8.3",
        ),
        Claim(
            "Without re-saves the agent still lags behind late.",
            Greater(some[-1], "0"),
            "last_return",
            "8.3",
        ),
    )


def alike_claims() -> tuple[Claim, ...]:
    """How close the agent's flights are to the PID's (section 9, appendix C)."""
    return (
        Claim(
            "The best agent's flights are nearer to the PID's than to random ones.",
            Greater("to random", "to the PID"),
            "distance",
            "9, C",
        ),
        Claim(
            "They are as near to the PID's as to those of the agent's other seeds.",
            Beyond("to the PID, over to another seed", 1.0, "below"),
            "ratio",
            "9, C",
        ),
    )


def pid_claims() -> tuple[Claim, ...]:
    """The tuned PID (appendix C)."""
    return (
        Claim("The tuned PID averages about 222.", Near("twiddle", 222, _ABOUT), section="C"),
        Claim(
            "Twiddle improves on gains that were picked by hand.",
            Greater("twiddle", "hand"),
            section="C",
        ),
    )


def target_period_claims(scale: Scale) -> tuple[Claim, ...]:
    """The target network update period (section 8.2)."""
    return (
        Claim(
            "A target period around 800 env steps is best.",
            Best(("800",), _names(TARGET_PERIODS[scale])),
            section="8.2",
        ),
        Claim("Short periods do worse than 800.", Greater("800", "1"), section="8.2"),
        Claim("Long periods do worse than 800.", Greater("800", "10000"), section="8.2"),
    )


def discount_claims() -> tuple[Claim, ...]:
    """The discount factor (section 8.4)."""
    return (
        Claim(
            "γ has a sweet spot: 0.99 does better than 0.9 and than 0.999.",
            SweetSpot("0.99", "0.9", "0.999"),
            section="8.4",
        ),
    )


def epsilon_decay_claims() -> tuple[Claim, ...]:
    """The decay of ε (section 8.4)."""
    return (
        Claim(
            "The decay of ε has a sweet spot: 0.975 does better than 0.9 and than 0.999.",
            SweetSpot("0.975", "0.9", "0.999"),
            section="8.4",
        ),
    )
