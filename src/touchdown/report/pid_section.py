"""The section on the PID's tuners: test returns of the gains that each one finds."""

from collections.abc import Sequence

import numpy as np
import polars as pl

from touchdown.core.types import FloatArray
from touchdown.figures.studies import Row
from touchdown.report import pictures, tables
from touchdown.report.builder import Builder
from touchdown.report.page import Picture, Section, Table
from touchdown.runs.folder import RunFolder
from touchdown.stats.seeds import summarise_seeds
from touchdown.studies.claims import Decision
from touchdown.studies.paper import Topic
from touchdown.studies.pid_results import PidResult
from touchdown.studies.tuners import TUNERS, Tuning


def pid_section(
    builder: Builder,
    topic: Topic,
    title: str,
    tuned: Sequence[PidResult],
    decisions: Sequence[Decision],
) -> Section:
    """The section on the PID's tuners.

    Args:
        builder: builder of the page.
        topic: the topic of the paper.
        title: title of the section.
        tuned: tested tunings, at least one.
        decisions: decisions on the topic's claims.
    """
    stem = builder.figures / topic.name
    rows = [Row(name, _returns_of(tuned, name), name == "twiddle") for name in TUNERS]
    pictures.save_rows(rows, "test return of the gains", stem)
    best = max(tuned, key=lambda each: each.trained_return)
    tuning = best.job.tuning
    return Section(
        id=topic.name,
        title=title,
        lead=f"{topic.question} All tuners start from the same gains and run as many trials.",
        claims=tables.claim_rows(decisions),
        pictures=(
            Picture(
                stem.with_suffix(".svg"),
                stem.with_suffix(".png"),
                "Test return of the gains of each tuner",
                "Mean test return of the gains found, over tuning seeds, each with different "
                "training starts; median with its 95% interval.",
            ),
        ),
        films=builder.film(
            RunFolder(best.path),
            topic.name,
            f"{tuning.tuner}, seed {tuning.seed}",
            "return on its training starts",
        ),
        tables=(_tuner_table(tuned, tuning),),
    )


def _returns_of(tuned: Sequence[PidResult], tuner: str) -> FloatArray:
    """Mean test returns of a tuner's gains, one per tuning seed, [n]."""
    found = [each.test.summary.mean_return for each in tuned if each.job.tuning.tuner == tuner]
    return np.array(found, float)


def _tuner_table(tuned: Sequence[PidResult], tuning: Tuning) -> Table:
    rows: list[tuple[str, ...]] = []
    for name in TUNERS:
        of = [each for each in tuned if each.job.tuning.tuner == name]
        if not of:
            continue
        test = summarise_seeds([each.test.summary.mean_return for each in of])
        rows.append(
            (
                name,
                str(test.n),
                tables.interval_text(test.mean),
                f"{np.mean([each.trained_return for each in of]):.0f}",
                f"{np.mean([each.test.summary.share_solved or 0.0 for each in of]):.0%}",
            )
        )
    return Table(
        f"The best of up to {tuning.trials} gains, tried on {tuning.starts} training starts "
        "each, on the test starts.",
        ("tuner", "seeds", "test return, mean [95%]", "on its training starts", "share ≥ 200"),
        tuple(rows),
    )


def pid_table(tuned: Sequence[PidResult]) -> pl.DataFrame:
    """A row for each tuning: its tuner, its seed, and the returns of its gains."""
    return pl.DataFrame(
        [
            {
                "tuner": each.job.tuning.tuner,
                "seed": each.job.tuning.seed,
                "run": each.job.digest,
                "trials": each.job.tuning.trials,
                "training_return": each.trained_return,
                "test_return": each.test.summary.mean_return,
                "share_solved": each.test.summary.share_solved,
            }
            for each in tuned
        ],
        infer_schema_length=None,
    )
