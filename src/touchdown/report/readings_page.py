"""The page of the paper's claims in every reading."""

from collections.abc import Callable, Sequence
from pathlib import Path

import polars as pl

from touchdown.core import files
from touchdown.figures import style
from touchdown.figures.verdicts import Column, draw_verdicts
from touchdown.report.csv_tables import run_tables
from touchdown.report.output import PAGE, Report, write_report
from touchdown.report.page import Page, Picture, Section, Table
from touchdown.report.provenance import page_facts, provenance_of
from touchdown.report.tables import claim_rows
from touchdown.studies.claims import Decision
from touchdown.studies.multiverse import (
    PAPER_RETURNS,
    PaperDistance,
    ReadClaim,
    Turn,
    paper_distances,
    read_claims,
)
from touchdown.studies.paper import Scale
from touchdown.studies.paper.readings import AXES, Reading, reading_studies, readings
from touchdown.studies.results import read_study
from touchdown.studies.run_result import RunResult
from touchdown.studies.store import Store

_LEAST_SPREAD = 0.25
"""A choice that changes the share of readings in which a claim holds by less does not turn it."""
_READINGS = "readings"
_LEAD = (
    "The paper leaves open what a replication must choose. Here, its experiments are run with "
    "several choices, and its claims are decided for each."
)
_LONGEST = 62  # characters of a claim in a figure


def write_readings_report(
    scale: Scale,
    seeds: int | None,
    store: Store,
    out: Path,
    *,
    command: str,
    note: str = "",
    on_step: Callable[[str], object] = lambda _: None,
) -> Report:
    """Write the page of the paper's claims in every reading that has runs.

    Args:
        scale: scale of the runs.
        seeds: training seeds per cell; None uses the study's own number.
        store: store of the runs.
        out: folder for the page and its pictures.
        command: the command that makes the page, shown on it.
        note: a sentence to show after the first one on the page.
        on_step: called once for each reading, with its name.

    Raises:
        UserError: the runs' files are broken, or something cannot be written.
    """
    read: dict[str, RunResult] = {}
    results = {
        study.name: read_study(study, seeds or study.seeds, store, read)
        for studies in reading_studies(scale).values()
        for study in studies
    }
    found = read_claims(scale, results, on_step)
    known = {name: each for name, each in results.items() if each.runs}
    missing = sum(each.missing for each in results.values())
    planned = sum(each.planned for each in results.values())
    not_done = f"{missing} of {planned} runs are not done yet." if missing else ""
    shipped = _in_shipped(found)
    with files.complete_folder(out) as folder:
        (folder / "figures").mkdir()
        page = Page(
            title="The paper, in every reading",
            lead=" ".join(filter(None, (_LEAD, not_done, note))),
            facts=(("readings", str(len(readings()))), *page_facts(known, (), scale)),
            sections=(
                _map_section(found, folder / "figures" / "verdicts"),
                _choices_section(found),
                _nearest_section(paper_distances(results)),
                Section(
                    id="shipped",
                    title="In the shipped reading",
                    lead="What this project's presets choose.",
                    claims=tuple(row for each in shipped.values() for row in claim_rows(each)),
                ),
            ),
            provenance=provenance_of(command, known, scale),
        )
        write_report(page, {_READINGS: _table_of(found), **run_tables(known)}, folder)
    return Report(out / PAGE, shipped, results)


def _in_shipped(found: Sequence[ReadClaim]) -> dict[str, list[Decision]]:
    """The decisions in the shipped reading, by topic."""
    decisions: dict[str, list[Decision]] = {}
    for each in found:
        for reading, decision in each.decisions.items():
            if reading.is_shipped:
                decisions.setdefault(each.topic.name, []).append(decision)
    return decisions


def _map_section(found: Sequence[ReadClaim], stem: Path) -> Section:
    drawn = [each for each in found if each.decisions]
    figure = style.new_figure(9.6, 4.2 + 0.3 * len(drawn))
    columns = [
        Column(
            reading.choices,
            [None if (d := each.decisions.get(reading)) is None else d.verdict for each in drawn],
            is_shaded=reading.is_shipped,
        )
        for reading in readings()
        if any(reading in each.decisions for each in drawn)
    ]
    axes = {axis: list(choices) for axis, choices in AXES.items()}
    draw_verdicts(figure.subplots(), [_short(each) for each in drawn], axes, columns)
    style.save(figure, stem.with_suffix(".png"), stem.with_suffix(".svg"))
    held = sum(each.share == 1 for each in drawn)
    never = sum(each.share == 0 for each in drawn)
    return Section(
        id="map",
        title="Which claims hold in which reading",
        lead=f"Of {len(drawn)} claims with runs, {held} hold in every reading and {never} in none; "
        f"{len(drawn) - held - never} depend on the reading.",
        pictures=(
            Picture(
                stem.with_suffix(".svg"),
                stem.with_suffix(".png"),
                "A verdict for each claim, from the top, and each reading, from the left",
                "A column is a reading, with its choices at the bottom; the shipped one is shaded. "
                "A claim is undecided if there are too few seeds, or the difference is too small.",
            ),
        ),
        tables=(
            Table(
                "In how many readings each claim holds, and the choice that makes the largest "
                "difference to that, if it changes a quarter of them.",
                ("claim", "section", "holds", "readings", "the choice that turns it"),
                tuple(
                    (
                        each.claim.sentence,
                        each.claim.section,
                        f"{each.share:.0%}" if each.decisions else "–",
                        str(len(each.decisions)),
                        _turn_text(each.turns[0]) if each.decisions else "–",
                    )
                    for each in found
                ),
            ),
        ),
    )


def _choices_section(found: Sequence[ReadClaim]) -> Section:
    """How much each axis matters, over all claims."""
    spreads = {
        axis: [
            turn.spread
            for each in found
            if each.decisions
            for turn in each.turns
            if turn.axis == axis
        ]
        for axis in AXES
    }
    return Section(
        id="choices",
        title="Which choices matter",
        lead="A choice turns a claim if the share of readings in which the claim holds differs by "
        f"at least {_LEAST_SPREAD:.0%} between the choices on its axis.",
        tables=(
            Table(
                "For each axis: how many claims it turns, and the mean difference.",
                ("axis", "claims turned", "mean difference"),
                tuple(
                    (
                        axis,
                        f"{sum(s >= _LEAST_SPREAD for s in of)} of {len(of)}",
                        f"{sum(of) / len(of):.0%}" if of else "–",
                    )
                    for axis, of in spreads.items()
                ),
            ),
            Table(
                "The choices.",
                ("axis", "choice", "meaning"),
                tuple(
                    (axis, choice, meaning)
                    for axis, choices in AXES.items()
                    for choice, meaning in choices.items()
                ),
            ),
        ),
    )


def _nearest_section(distances: Sequence[PaperDistance]) -> Section:
    given = ", ".join(f"{level} {value:.0f}" for level, value in PAPER_RETURNS.items())
    return Section(
        id="nearest",
        title="The reading nearest to the paper's own returns",
        lead=f"The paper gives one return for each agent: {given}.",
        tables=(
            Table(
                "Median test return over seeds, and its mean distance from the paper's returns; "
                "the nearest reading first.",
                ("reading", *PAPER_RETURNS, "mean distance"),
                tuple(
                    (
                        _words(each.reading),
                        *(f"{each.medians[level]:.0f}" for level in PAPER_RETURNS),
                        f"{each.points:.0f}",
                    )
                    for each in distances
                ),
            ),
        ),
    )


def _table_of(found: Sequence[ReadClaim]) -> pl.DataFrame:
    """Every claim in every reading, for further analysis."""
    return pl.DataFrame(
        [
            {
                "topic": each.topic.name,
                "section": each.claim.section,
                "claim": each.claim.sentence,
                **reading.by_axis,
                "metric": decision.metric,
                "verdict": decision.verdict,
                "p_raw": decision.p_raw,
                "p_corrected": decision.p_value,
                "seeds": decision.seeds,
                "evidence": decision.evidence,
            }
            for each in found
            for reading, decision in each.decisions.items()
        ],
        infer_schema_length=None,
    )


def _turn_text(turn: Turn) -> str:
    if turn.spread < _LEAST_SPREAD:
        return "none"
    return f"{turn.axis}: " + ", ".join(f"{c} {share:.0%}" for c, share in turn.shares.items())


def _words(reading: Reading) -> str:
    return ", ".join(reading.choices)


def _short(each: ReadClaim) -> str:
    """A claim in one line of a figure."""
    sentence = each.claim.sentence.removesuffix(".")
    return sentence if len(sentence) <= _LONGEST else f"{sentence[: _LONGEST - 1]}…"
