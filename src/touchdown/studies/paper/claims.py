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

MARGIN = 20.0
"""Smallest effect of interest in return points; the paper's own steps are 22 to 70 points."""
FAILED = 100.0
"""A run with a lower return has failed: the paper tells of plain DQN that it stays below."""
_MARGIN_OF_HOVERING = 0.05
_STILL_HOVERS = 0.2  # of 100 training episodes in a row
_SATURATED = 0.5  # of the replay memory
_MARGIN_OF_TIME = 10_000.0  # environment steps, of 240,000
_MARGIN_OF_DISTANCE = 0.25  # metres
_ALWAYS = 0.95  # of the test episodes


def _names(values: Sequence[float]) -> tuple[str, ...]:
    """The names of the cells of a study that varies one number."""
    return tuple(f"{value:g}" for value in values)


def _raises(above: str, below: str) -> Greater:
    """A higher return: typically, or by fewer failures."""
    return Greater(above, below, margin=MARGIN, failure=FAILED)


def ladder_claims() -> tuple[Claim, ...]:
    """The effect of each part (sections 4-9)."""
    return (
        Claim("Plain DQN ends below 100.", Beyond("dqn", FAILED, "below"), section="5"),
        Claim("A target network raises the return.", _raises("target-dqn", "dqn"), section="6"),
        Claim(
            "With a target network the return is about 170.",
            Near("target-dqn", 170, MARGIN),
            section="6",
        ),
        Claim(
            "A target network lowers overestimation.",
            Greater("dqn", "target-dqn", margin=MARGIN),
            "overestimation",
            "6",
        ),
        Claim(
            "Preferential memory raises it further.",
            _raises("preferential-dqn", "target-dqn"),
            section="7",
        ),
        Claim(
            "With preferential memory the return is about 199.",
            Near("preferential-dqn", 199, MARGIN),
            section="7",
        ),
        Claim("The best agent averages about 221.", Near(BEST, 221, MARGIN), section="9"),
        Claim(
            "The best agent is the best of the four.",
            Best((BEST,), ("dqn", "target-dqn", "preferential-dqn", BEST), margin=MARGIN),
            section="9",
        ),
        Claim(
            f"The best agent is always above 200: at least {_ALWAYS:.0%} of its test episodes are.",
            Beyond(BEST, _ALWAYS, "above"),
            "share_solved",
            "9",
        ),
    )


def hover_claims() -> tuple[Claim, ...]:
    """How often episodes reach the time limit (sections 5 and 6)."""
    return (
        Claim(
            "At some time, most training episodes of plain DQN run all 1000 steps.",
            Beyond("dqn", 0.5, "above"),
            "hover_peak_share",
            "5",
        ),
        Claim(
            "With a target network, too, many episodes run all 1000 steps: at some time, a fifth.",
            Beyond("target-dqn", _STILL_HOVERS, "above"),
            "hover_peak_share",
            "6",
        ),
        Claim(
            "The best agent hovers for a smaller share of its steps than plain DQN.",
            Greater("dqn", BEST, margin=_MARGIN_OF_HOVERING),
            "hover_step_share",
            "5, 6",
        ),
    )


def size_claims(scale: Scale) -> tuple[Claim, ...]:
    """Nodes in a layer (section 8.1)."""
    return tuple(
        Claim(
            f"More nodes lower the return, with {words}.",
            Trend(
                tuple(f"{layers} × {nodes}" for nodes in NODES[scale]),
                margin=MARGIN,
                direction="fall",
            ),
            section="8.1",
        )
        for layers, words in ((1, "one hidden layer"), (3, "three hidden layers"))
    )


def depth_claims() -> tuple[Claim, ...]:
    """Hidden layers (section 8.1)."""
    in_all = tuple(shape_of(split_evenly(100, depth)) for depth in DEPTHS)
    in_each = tuple(shape_of((100,) * depth) for depth in DEPTHS)
    return (
        Claim(
            "With 100 nodes in all, deeper is better.",
            Trend(in_all, margin=MARGIN),
            section="8.1",
        ),
        Claim(
            "With 100 nodes in each layer, deeper is better.",
            Trend(in_each, margin=MARGIN),
            section="8.1",
        ),
    )


def resaves_claims(scale: Scale) -> tuple[Claim, ...]:
    """Preferential memory (section 8.3)."""
    every = _names(RESAVES[scale])
    some = tuple(name for name in every if name != "0")
    return (
        Claim("More re-saves bring more return.", Trend(every, margin=MARGIN), section="8.3"),
        Claim(
            "More re-saves shorten the time until 200.",
            Trend(every, margin=_MARGIN_OF_TIME, direction="fall"),
            "env_steps_to_solved",
            "8.3",
        ),
        Claim(
            "Late in training, how many re-saves makes little difference.",
            Alike(some, MARGIN),
            "last_return",
            "8.3",
        ),
        Claim(
            "Without re-saves the agent still lags behind late.",
            _raises(some[-1], "0"),
            "last_return",
            "8.3",
        ),
        *(
            Claim(
                f"Late in training, the memory is full of rewarded transitions {words}: at least "
                "half of it.",
                Beyond(name, _SATURATED, "above"),
                "rewarded_share",
                "8.3",
            )
            for name, words in ((every[-1], "with many re-saves"), ("0", "without re-saves, too"))
        ),
    )


def combination_claims(labels: Sequence[str]) -> tuple[Claim, ...]:
    """The best agent as a combination of the best values (section 9).

    Args:
        labels: its label, and those of the agents that differ from it in one setting.
    """
    return (
        Claim(
            "The best agent combines the best values: no other value of one setting does better.",
            Best((BEST,), tuple(labels), margin=MARGIN),
            section="9",
        ),
    )


def alike_claims() -> tuple[Claim, ...]:
    """How close the agent's flights are to the PID's (section 9, appendix C)."""
    return (
        Claim(
            "The best agent's flights are nearer to the PID's than to random ones.",
            Greater("to random", "to the PID", margin=_MARGIN_OF_DISTANCE),
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
        Claim("The tuned PID averages about 222.", Near("twiddle", 222, MARGIN), section="C"),
        Claim(
            "Twiddle improves on this project's gains that were picked by hand.",
            Greater("twiddle", "hand", margin=MARGIN),
            section="C",
        ),
    )


def target_period_claims(scale: Scale) -> tuple[Claim, ...]:
    """The target network update period (section 8.2)."""
    return (
        Claim(
            "A target period around 800 env steps is best.",
            Best(("800",), _names(TARGET_PERIODS[scale]), margin=MARGIN),
            section="8.2",
        ),
        Claim("Short periods do worse than 800.", _raises("800", "1"), section="8.2"),
        Claim("Long periods do worse than 800.", _raises("800", "10000"), section="8.2"),
    )


def discount_claims() -> tuple[Claim, ...]:
    """The discount factor (section 8.4)."""
    return (
        Claim(
            "γ has a sweet spot: 0.99 does better than 0.9 and than 0.999.",
            SweetSpot("0.99", "0.9", "0.999", margin=MARGIN),
            section="8.4",
        ),
    )


def epsilon_decay_claims() -> tuple[Claim, ...]:
    """The decay of ε (section 8.4)."""
    return (
        Claim(
            "The decay of ε has a sweet spot: 0.975 does better than 0.9 and than 0.999.",
            SweetSpot("0.975", "0.9", "0.999", margin=MARGIN),
            section="8.4",
        ),
    )
