"""The page of the paper's experiments: a section for each topic, a verdict on each claim."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from touchdown.core import files
from touchdown.evaluation.evaluation import read_evaluations
from touchdown.report import alike_section, pid_section
from touchdown.report.builder import Builder
from touchdown.report.csv_tables import claim_table, level_table, run_tables
from touchdown.report.output import PAGE, Report, write_report
from touchdown.report.page import Page, Section
from touchdown.report.provenance import page_facts, provenance_of
from touchdown.runs.folder import RunFolder
from touchdown.studies import alike, paper
from touchdown.studies.claims import CLAIMS, Decision
from touchdown.studies.paper import Scale, Topic
from touchdown.studies.paper import looks as paper_looks
from touchdown.studies.paper.looks import PaperResults
from touchdown.studies.store import Store
from touchdown.studies.work import BaselineJob

_LEAD = (
    "Every experiment of the paper, with its own clocks: one environment, and an update "
    "after each step. A verdict on each claim is by a statistical test, a smallest effect of "
    "interest and numbers of seeds that were specified before the runs."
)
_LEAD_OF_PREVIEW = (
    "A preview of the paper's experiments, which takes a fraction of the time: with 16 "
    "environments and an update every fourth step, its clocks are not the paper's, so it decides "
    "no claim."
)
_TRAINING = {"ladder": "training_returns", "hover": "training_steps"}
"""What the paper draws of training, by topic."""


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
        seeds: training seeds per cell, of a scale without looks; None uses the study's own number.
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
    found = _read(scale, seeds, store, wanted)
    chosen = {topic.name for topic in wanted}
    others = (
        alike.controls(found.results["ladder"], paper.BEST, store) if "alike" in chosen else None
    )
    of_topics = {topic.study.name for topic in wanted if topic.study}
    results = {name: each for name, each in found.results.items() if name in of_topics}
    decisions: dict[str, list[Decision]] = {}
    sections: list[Section] = []
    with files.complete_folder(out) as folder:
        builder = Builder(folder, beside=out if linked else None, on_step=on_step)
        for topic in wanted:
            made = _section_of(builder, topic, found, others, store)
            if made is None or topic.study is None or topic.name == "alike":
                builder.all_steps(topic.name)
            if made is not None:
                decisions[topic.name], section = made
                sections.append(section)
        page = Page(
            title="The paper, re-measured",
            lead=" ".join(filter(None, (_lead(scale), _not_run(wanted, decisions), note))),
            facts=page_facts(results, found.tuned if "pid" in decisions else (), scale),
            sections=tuple(sections),
            provenance=(*_plan(scale), *provenance_of(command, results, scale)),
        )
        tables = run_tables(results) | {
            f"{topic.name}-levels": level_table(results[topic.study.name], topic.metric)
            for topic in wanted
            if topic.name in decisions and topic.name != "alike" and topic.study is not None
        }
        if found.distances is not None and others is not None:
            tables["alike"] = alike_section.alike_table(found.distances, others)
        if "pid" in decisions:
            tables["pid"] = pid_section.pid_table(found.tuned)
        if any(decisions.values()):
            tables[CLAIMS] = claim_table(decisions)
        write_report(page, tables, folder)
    return Report(out / PAGE, decisions, results)


def _lead(scale: Scale) -> str:
    return _LEAD if paper.LOOKS[scale] else _LEAD_OF_PREVIEW


def _not_run(wanted: Sequence[Topic], decisions: Mapping[str, Sequence[Decision]]) -> str:
    """Which topics the page leaves out, because nothing of them has been run."""
    names = [topic.title for topic in wanted if topic.name not in decisions]
    return f"Not run yet: {'; '.join(names)}." if names else ""


def _plan(scale: Scale) -> list[tuple[str, str]]:
    """The plan, by the commit that made it before any run."""
    if not paper.LOOKS[scale]:
        return []
    looks = ", ".join(map(str, paper.LOOKS[scale]))
    text = (
        f"claims, margins and looks at {looks} seeds from seed {paper.FIRST_SEED[scale]} on: "
        f"commit {paper.PLAN_COMMIT}, before the first of these runs"
    )
    return [("plan", text)]


def _read(scale: Scale, seeds: int | None, store: Store, wanted: Sequence[Topic]) -> PaperResults:
    """The results of topics, with decisions if the scale has looks, and else without."""
    if paper.LOOKS[scale]:
        return paper_looks.read_paper(scale, store)
    return paper_looks.preview_paper(scale, seeds, store, wanted)


def _section_of(
    builder: Builder,
    topic: Topic,
    found: PaperResults,
    others: alike.Controls | None,
    store: Store,
) -> tuple[list[Decision], Section] | None:
    """A topic's decisions and section; None if its records are missing."""
    title = f"{topic.title} (section {topic.section})"
    decisions = list(found.decisions.get(topic.name, []))
    if topic.study is None:
        if not found.tuned:
            return None
        return decisions, pid_section.pid_section(builder, topic, title, found.tuned, decisions)
    results = found.results[topic.study.name]
    if not results.runs:
        return None
    if topic.name == "alike":
        if found.distances is None or others is None:
            return None
        section = alike_section.alike_section(
            builder, topic, title, found.distances, others, decisions
        )
        return decisions, section
    lines = _baseline_returns(store) if topic.with_baselines else {}
    section = builder.section(
        topic.name,
        title,
        topic.question,
        results,
        topic.metric,
        decisions,
        lines,
        training=_TRAINING.get(topic.name, ""),
        with_curves=topic.name != "combination",  # its levels have theirs in other sections
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
