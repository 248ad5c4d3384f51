"""The page of a user's study: a verdict on each claim, its figure, its levels, its runs."""

from collections.abc import Callable
from pathlib import Path

from touchdown.core import files
from touchdown.report.builder import Builder
from touchdown.report.csv_tables import claim_table, level_table, run_tables
from touchdown.report.output import PAGE, Report, write_report
from touchdown.report.page import Page
from touchdown.report.provenance import page_facts, provenance_of
from touchdown.report.sensitivity_section import sensitivity_section
from touchdown.studies.claims import CLAIMS, Decision, decide
from touchdown.studies.looks import decide_study, read_in_looks
from touchdown.studies.plan import SENSITIVITY_FACTORS, Study
from touchdown.studies.results import StudyResults, read_study
from touchdown.studies.store import Store


def write_study_report(
    study: Study,
    seeds: int,
    store: Store,
    out: Path,
    *,
    command: str,
    note: str = "",
    linked: bool,
    on_step: Callable[[str], object] = lambda _: None,
) -> Report:
    """Write the page of a study from the records of its runs.

    Args:
        study: the study.
        seeds: training seeds per cell; of no use to a study with looks.
        store: store of the runs.
        out: folder for the page and its pictures.
        command: the command that makes the page, shown on it.
        note: a sentence to show after the study's question.
        linked: whether the page links to the runs' folders.
        on_step: called after each of the `STEPS` of the section.

    Raises:
        UserError: the runs' files are broken, or something cannot be written.
    """
    results = read_in_looks(study, store) if study.looks else read_study(study, seeds, store)
    title = study.title or study.name
    known = {study.name: results}
    tables = run_tables(known)
    decisions = _decisions(results) if results.runs else []
    if results.runs:
        tables[f"{study.name}-levels"] = level_table(
            results, study.metric, compared=len(study.factors) < SENSITIVITY_FACTORS
        )
    by_study = {study.name: decisions} if decisions else {}
    if by_study:
        tables[CLAIMS] = claim_table(by_study)
    with files.complete_folder(out) as folder:
        builder = Builder(folder, beside=out if linked else None, on_step=on_step)
        sections = ()
        if results.runs and len(study.factors) == SENSITIVITY_FACTORS:
            section, own = sensitivity_section(builder, title, results, study.metric, decisions)
            sections, tables = (section,), tables | own
        elif results.runs:
            section = builder.section(
                study.name, title, study.question, results, study.metric, decisions, {}
            )
            sections = (section,)
        page = Page(
            title=title,
            lead=f"{study.question} {note}".strip(),
            facts=page_facts(known, (), ""),
            sections=sections,
            provenance=provenance_of(command, known, ""),
        )
        write_report(page, tables, folder)
    return Report(out / PAGE, by_study, known)


def _decisions(results: StudyResults) -> list[Decision]:
    study = results.study
    if not study.looks:
        return decide(study.claims, results.named, study.metric)
    return [each.decision for each in decide_study(results)]
