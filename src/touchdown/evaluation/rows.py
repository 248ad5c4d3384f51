"""A summary of episodes in words and numbers: the rows of every table of evaluations."""

from collections.abc import Callable, Iterator

from touchdown.lander import rules
from touchdown.stats.summary import Summary


def summary_rows(
    env_id: str, threshold: float | None
) -> Iterator[tuple[str, Callable[[Summary], str]]]:
    """Each row's name, and how its cells are made.

    Args:
        env_id: the environment of the episodes.
        threshold: the return from which an episode counts as solved; None if there is none.
    """
    yield "return, mean ± sd", lambda s: f"{points(s.mean_return, 1)} ± {points(s.sd_return, 0)}"
    yield "return, IQM", lambda s: points(s.iqm.value, 1)
    yield "  95% interval", lambda s: f"[{points(s.iqm.low, 0)}, {points(s.iqm.high, 0)}]"
    yield "return, worst 5%", lambda s: points(s.worst_5_percent, 1)
    if threshold is not None:
        yield f"share ≥ {threshold:g}", lambda s: f"{s.share_solved:.0%}"
    if rules.is_lander(env_id):
        for outcome in ("landed", "crashed", "out of bounds", "timed out"):
            yield outcome, lambda s, outcome=outcome: f"{s.outcomes.get(outcome, 0.0):.0%}"
    yield "steps", lambda s: f"{s.steps:.0f}"
    if rules.is_lander(env_id):
        yield "fuel", lambda s: f"{s.fuel:.1f}"


def points(value: float, decimals: int) -> str:
    """A return; small ones get two decimals, as environments that pay 1 in all need them."""
    return f"{value:z.{2 if abs(value) < 2 else decimals}f}"  # z: no -0
