"""The page of the paper's experiments: a section for each topic, a verdict on each claim."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from touchdown.core import files
from touchdown.evaluation.evaluation import read_evaluations
from touchdown.report import alike_section, pid_section
from touchdown.report.builder import STEPS, Builder
from touchdown.report.csv_tables import claim_table, level_table, run_tables
from touchdown.report.output import PAGE, Report, write_report
from touchdown.report.page import Page, Section
from touchdown.report.provenance import page_facts, provenance_of
from touchdown.runs.folder import RunFolder
from touchdown.studies import alike, paper
from touchdown.studies.claims import CLAIMS, Decision, decide
from touchdown.studies.paper import Scale, Topic
from touchdown.studies.results import PidResult, StudyResults, read_pid, read_study
from touchdown.studies.store import Store
from touchdown.studies.work import BaselineJob


def write_paper_report(
    scale: Scale,
    seeds: int | None,
    store: Store,
    out: Path,
    *,
    names: Sequence[str] | None = None,
    command: str,
    note: str = "",
    linked: bool,
    on_step: Callable[[str], object] = lambda _: None,
) -> Report:
    """Write the page of the paper's topics from the records of their runs.

    Topics without runs are left out, as are films, distances and lines whose flights are not
    recorded.

    Args:
        scale: scale of the runs.
        seeds: training seeds per cell; None uses the study's own number.
        store: store of the runs.
        out: folder for the page and its pictures.
        names: topics to write; None writes all.
        command: the command that makes the page, shown on it.
        note: a sentence to show after the first one on the page.
        linked: whether the page links to the runs' folders.
        on_step: called `STEPS` times for each topic, with its name.

    Raises:
        UserError: the runs' files are broken, or something cannot be written.
    """
    topics = paper.topics(scale)
    wanted = [topics[name] for name in (names or topics)]
    results = {
        study.name: read_study(study, seeds or study.seeds, store)
        for study in {t.study.name: t.study for t in wanted if t.study}.values()
    }
    tuned = read_pid(paper.pid_jobs(scale, seeds), store)
    decisions: dict[str, list[Decision]] = {}
    sections: list[Section] = []
    with files.complete_folder(out) as folder:
        builder = Builder(folder, beside=out if linked else None, on_step=on_step)
        for topic in wanted:
            made = _section_of(builder, topic, results, tuned, store)
            if made is None or topic.study is None or topic.name == "alike":
                for _ in range(STEPS):  # a section of another kind, or none
                    on_step(topic.name)
            if made is not None:
                decisions[topic.name], section = made
                sections.append(section)
        lead = (
            "Every experiment of the paper over several training seeds, with a verdict on each of "
            "its claims by a statistical test that was specified before the runs."
        )
        page = Page(
            title="The paper, re-measured",
            lead=f"{lead} {note}".strip(),
            facts=page_facts(results, tuned, scale),
            sections=tuple(sections),
            provenance=provenance_of(command, results, scale),
        )
        tables = run_tables(results) | {
            f"{topic.name}-levels": level_table(results[topic.study.name], topic.metric)
            for topic in wanted
            if topic.name in decisions and topic.name != "alike" and topic.study is not None
        }
        if any(decisions.values()):
            tables[CLAIMS] = claim_table(decisions)
        write_report(page, tables, folder)
    return Report(out / PAGE, decisions, results)


def _section_of(
    builder: Builder,
    topic: Topic,
    results: Mapping[str, StudyResults],
    tuned: Sequence[PidResult],
    store: Store,
) -> tuple[list[Decision], Section] | None:
    """A topic's decisions and section; None if its records are missing."""
    title = f"{topic.title} (section {topic.section})"
    if topic.study is None:
        if not tuned:
            return None
        decisions = decide(topic.claims, pid_section.values_of(tuned))
        return decisions, pid_section.pid_section(builder, topic, title, tuned, decisions)
    found = results[topic.study.name]
    if not found.runs:
        return None
    if topic.name == "alike":
        distances = alike.agent_distances(found, (paper.BEST,), store)
        if distances is None:
            return None
        decisions = decide(topic.claims, distances.values)
        return decisions, alike_section.alike_section(builder, topic, title, distances, decisions)
    decisions = decide(topic.claims, found.named, topic.metric)
    lines = _baseline_returns(store) if topic.with_baselines else {}
    section = builder.section(
        topic.name, title, topic.question, found, topic.metric, decisions, lines
    )
    return decisions, section


def _baseline_returns(store: Store) -> dict[str, float]:
    """Mean test returns of the tested baselines, by their label."""
    jobs = {"PID": BaselineJob("pid"), "random": BaselineJob("random")}
    return {
        words: read_evaluations(RunFolder(store.runs / job.digest).evaluation)[
            0
        ].summary.mean_return
        for words, job in jobs.items()
        if job.has_results(store.runs)
    }
