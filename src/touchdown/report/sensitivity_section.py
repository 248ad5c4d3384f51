"""The section of a study of three factors: what each algorithm owes to tuned settings."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from touchdown.core.types import FloatArray
from touchdown.figures import style
from touchdown.figures.sensitivity import draw_sensitivity
from touchdown.report import tables
from touchdown.report.builder import Builder, gaps
from touchdown.report.page import Picture, Section, Table
from touchdown.stats.sensitivity import FEWEST_SEEDS, Sensitivity, normalised, sensitivity_of
from touchdown.studies.changes import by_dotted_name
from touchdown.studies.claims import Decision
from touchdown.studies.metrics import METRICS, formatter
from touchdown.studies.plan import Level, Study
from touchdown.studies.results import StudyResults

_EXPLAINED = (
    "After Adkins, Bowling & White (2024), but each seed is scored with the settings that are best "
    "for the other seeds. In each environment, a score of 0 is the 5th and 1 the 95th percentile "
    "of all means over seeds."
)


def sensitivity_section(
    builder: Builder,
    title: str,
    results: StudyResults,
    metric: str,
    decisions: Sequence[Decision],
) -> tuple[Section, dict[str, pl.DataFrame]]:
    """The section of a study of three factors: algorithms, environments and settings.

    Args:
        builder: builder of the page.
        title: title of the section.
        results: results of the study, with at least one finished run.
        metric: a metric of which more is better.
        decisions: decisions on claims.

    Returns:
        The section, and the tables of its CSV files by name.
    """
    study = results.study
    stem = builder.figures / study.name
    found = _read(results, metric)
    builder.all_steps(study.name)
    pictures, shown = (), ()
    if found.of:
        lead = _EXPLAINED
        pictures = (_picture(found, title, stem),)
        shown = (_by_algorithm(found), _by_environment(found))
    else:
        lead = (
            f"Seeds that have a {METRICS[metric]} in every cell: {len(found.seeds)}; sensitivity "
            f"needs at least {FEWEST_SEEDS}."
        )
    section = Section(
        id=study.name,
        title=title,
        lead=" ".join(filter(None, (study.question, lead, *gaps(results)))),
        claims=tables.claim_rows(decisions),
        pictures=pictures,
        tables=(*shown, tables.run_table(results, builder.beside)),
    )
    return section, {f"{study.name}-sensitivity": _frame(found)} if found.of else {}


@dataclass(frozen=True, slots=True)
class _Found:
    """The sensitivity of each algorithm, by the seeds that every cell has."""

    study: Study
    metric: str
    seeds: list[int]
    scores: FloatArray
    """[A, E, H, S], not normalised."""
    of: dict[str, Sensitivity]
    """By the label of the algorithm; empty with too few seeds."""

    @property
    def environments(self) -> list[str]:
        """Labels of the second factor."""
        return self.study.labels(1)

    @property
    def settings(self) -> list[str]:
        """Labels of the third factor."""
        return self.study.labels(2)


def _read(results: StudyResults, metric: str) -> _Found:
    study = results.study
    numbers = {(run.labels, run.seed): getattr(run, metric) for run in results.runs}
    cells = [cell.labels for cell in study.cells()]
    seeds = [
        seed
        for seed in sorted({seed for _, seed in numbers})
        if all(np.isfinite(numbers.get((labels, seed), np.nan)) for labels in cells)
    ]
    scores = np.array([[numbers[labels, seed] for seed in seeds] for labels in cells], float)
    scores = scores.reshape(*(len(factor.levels) for factor in study.factors), len(seeds))
    if len(seeds) < FEWEST_SEEDS:
        return _Found(study, metric, seeds, scores, {})
    values = _values_of(study.factors[2].levels)
    of = {
        name: sensitivity_of(each, values)
        for name, each in zip(study.labels(0), normalised(scores), strict=True)
    }
    return _Found(study, metric, seeds, scores, of)


def _values_of(levels: Sequence[Level]) -> list[list[object]]:
    """The values of the fields that levels change, [H][K]; None where one does not change it."""
    changes = [dict(by_dotted_name(level.changes)) for level in levels]
    names = sorted({name for each in changes for name in each})
    return [[each.get(name) for name in names] for each in changes]


def _picture(found: _Found, title: str, stem: Path) -> Picture:
    """The plane of scores and sensitivities."""
    figure = style.new_figure(7.2, 4.6)
    base = found.study.base_cell().labels[0]
    draw_sensitivity(figure.subplots(), found.of, base)
    svg, png = stem.with_suffix(".svg"), stem.with_suffix(".png")
    style.save(figure, png, svg)
    return Picture(
        svg,
        png,
        f"{title}: score and sensitivity of each level of {found.study.factors[0].name}",
        f"Normalised {METRICS[found.metric]} with settings for each of {len(found.environments)} "
        "environments, and how much of it depends on them. Means over "
        f"n = {len(found.seeds)} training seeds, each of which is a dot. Above the broken line, "
        "an algorithm scores more than "
        f"{base} with one choice of settings for all environments.",
    )


def _by_algorithm(found: _Found) -> Table:
    what = found.study.factors[0].name
    return Table(
        f"Sensitivity to settings, by {what}, as normalised scores: means over "
        f"n = {len(found.seeds)} training seeds, and the lowest and highest seed.",
        (
            what, "tuned per environment", "shared settings", "sensitivity",
            "settings that need tuning", "best shared settings",
        ),
        tuple(
            (
                name,
                _with_range(of.tuned, ".2f"),
                _with_range(of.shared, ".2f"),
                _with_range(of.tuned - of.shared, "+.2f"),
                f"{of.dimensionality}",
                found.settings[of.best_shared],
            )
            for name, of in found.of.items()
        ),
    )  # fmt: skip


def _with_range(values: FloatArray, spec: str) -> str:
    """The mean, and the lowest and the highest value."""
    return f"{values.mean():{spec}} ({values.min():{spec}} to {values.max():{spec}})"


def _by_environment(found: _Found) -> Table:
    what = found.study.factors[0].name
    text_of = formatter(found.metric, [found.scores.ravel()])
    return Table(
        f"Mean {METRICS[found.metric]} with the best shared settings and, after the arrow, with "
        "the best ones for each environment. The same seeds choose and score them here, so the "
        "numbers are too high.",
        (what, *found.environments),
        tuple(
            (
                name,
                *(
                    f"{text_of(means[of.best_shared])} → {text_of(means[best])} with "
                    f"{found.settings[best]}"
                    for means, best in zip(scores.mean(axis=2), of.best, strict=True)
                ),
            )
            for (name, of), scores in zip(found.of.items(), found.scores, strict=True)
        ),
        folded=True,
    )


def _frame(found: _Found) -> pl.DataFrame:
    """A row for each algorithm and seed."""
    return pl.DataFrame(
        [
            {
                "study": found.study.name,
                "metric": found.metric,
                "level": name,
                "seed": seed,
                "tuned": float(tuned),
                "shared": float(shared),
                "sensitivity": float(tuned - shared),
                "dimensionality": of.dimensionality,
                "best_shared": found.settings[of.best_shared],
            }
            for name, of in found.of.items()
            for seed, tuned, shared in zip(found.seeds, of.tuned, of.shared, strict=True)
        ],
        infer_schema_length=None,
    )
