"""The tables of a report as data frames, for its CSV files; docs/studies.md has their columns."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from touchdown.stats.summary import Interval
from touchdown.studies.claims import Decision
from touchdown.studies.levels import AgainstBase, LevelSummary, summarise_levels
from touchdown.studies.results import StudyResults


def run_tables(results: Mapping[str, StudyResults]) -> dict[str, pl.DataFrame]:
    """The runs of every study that has any, for further analysis."""
    return {name: each.table() for name, each in results.items() if each.runs}


def level_table(results: StudyResults, metric: str, *, compared: bool = True) -> pl.DataFrame:
    """The numbers of every level, and its comparison with the base; null for missing numbers.

    Args:
        results: results of a study.
        metric: the metric to summarise and compare, one of `METRICS`.
        compared: whether to compare levels with the base.
    """
    rows = [
        {"study": results.study.name, "metric": metric, **_level_row(level)}
        for level in summarise_levels(results, metric, compared=compared)
    ]
    return pl.DataFrame(rows, infer_schema_length=None)


def claim_table(decisions: Mapping[str, Sequence[Decision]]) -> pl.DataFrame:
    """Every claim with its verdict and the numbers behind it."""
    return pl.DataFrame(
        [
            {
                "study": name,
                "section": decision.claim.section,
                "claim": decision.claim.sentence,
                "kind": decision.claim.test.kind,
                "metric": decision.metric,
                "verdict": decision.verdict,
                "p_raw": decision.p_raw,
                "p_corrected": decision.p_value,
                "seeds": decision.seeds,
                "further_seeds": decision.more_seeds,
                "evidence": decision.evidence,
            }
            for name, each in decisions.items()
            for decision in each
        ],
        infer_schema_length=None,
    )


def _level_row(level: LevelSummary) -> dict[str, Any]:
    low, high = level.seeds.band or (None, None)
    return {
        "level": level.cell.name,
        "is_base": level.is_base,
        "n": level.seeds.n,
        **_interval("median", level.median),
        **_interval("iqm", level.seeds.iqm),
        **_interval("mean", level.seeds.mean),
        "band_low": low,
        "band_high": high,
        "last_weights": level.last_weights,
        "over_training": level.over_training,
        "solved_seeds": level.env_steps_to_solved.reached,
        "env_steps_to_solved": _finite(level.env_steps_to_solved.median),
        "seconds_to_solved": _finite(level.seconds_to_solved.median),
        **_comparison(level.against_base),
    }


def _comparison(against: AgainstBase | None) -> dict[str, float | None]:
    found = None if against is None else against.comparison
    return {
        **_interval("difference", found and found.difference),
        **_interval("improvement", found and found.probability_of_improvement),
        "p_raw": found and found.p_value,
        "p_corrected": against and against.p_corrected,
    }


def _interval(name: str, found: Interval | None) -> dict[str, float | None]:
    return {
        name: found and found.value,
        f"{name}_low": found and _finite(found.low),
        f"{name}_high": found and _finite(found.high),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
