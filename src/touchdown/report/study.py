"""The report of studies: one page with a section a topic, and its pictures beside it."""

import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np
import polars as pl

from touchdown.core import files, threads
from touchdown.core.seeding import TEST_STARTS
from touchdown.core.types import FloatArray
from touchdown.envs import flight as flights
from touchdown.evaluation import evaluation as evaluations
from touchdown.evaluation.evaluation import Evaluation
from touchdown.figures.studies import Row
from touchdown.lander import engine as engines
from touchdown.policies import lookup, named
from touchdown.render import film as films
from touchdown.report import sections
from touchdown.report.markdown import summary_of
from touchdown.report.page import Film, Page, Picture, Section, Table, write_page
from touchdown.runs import run as runs
from touchdown.runs.folder import RunFolder
from touchdown.runs.provenance import cpu_name
from touchdown.stats.seeds import summarise_seeds
from touchdown.studies import alike, paper
from touchdown.studies.alike import Likenesses
from touchdown.studies.claims import Decision, decide
from touchdown.studies.paper import Scale, Topic
from touchdown.studies.plan import Study
from touchdown.studies.results import METRICS, PidResult, StudyResults, read_pid, read_study
from touchdown.studies.store import Store
from touchdown.studies.tuners import TUNERS, Tuning

PAGE = "index.html"
_SUMMARY = "summary.md"
_FIGURES = "figures"
_ALIKE_STARTS = 30
# a page carries a film a section: a third of the bytes of a film by itself
_FILM_FPS, _FILM_SCALE = 12, 0.6
_PACKAGES = ("touchdown", "gymnasium", "jax", "numpy", "scipy", "statsmodels")


@dataclass(frozen=True, slots=True)
class Report:
    """A page and what it says."""

    page: Path
    decisions: dict[str, list[Decision]]
    """By topic."""
    results: dict[str, StudyResults]
    """By study."""


class Builder:
    """Draws figures and films into a folder as sections ask for them.

    Args:
        out: the page's folder.
        linked: whether the page lies beside the runs, and links to them.
        on_step: told of each section.
    """

    def __init__(self, out: Path, *, linked: bool, on_step: Callable[[str], object]) -> None:
        self.figures = out / _FIGURES
        self.beside = out if linked else None
        self._on_step = on_step
        with files.refusing(f"out {str(out)!r}"):
            self.figures.mkdir(parents=True, exist_ok=True)

    def section(
        self,
        name: str,
        title: str,
        lead: str,
        results: StudyResults,
        metric: str,
        decisions: Sequence[Decision],
        lines: Mapping[str, float],
    ) -> Section:
        """Of training runs: figure, claims, levels, runs, and the flight of the best."""
        self._on_step(name)
        stem = self.figures / name
        pictures = [sections.save_picture(title, results, metric, lines, stem)]
        by_words = all(level.position is None for level in results.study.factors[0].levels)
        if by_words and len(results.study.factors) == 1:
            of = "hovering" if sections.is_share(metric) else "validations"
            over = self.figures / f"{name}-over-training"
            pictures.append(sections.save_curves(title, results, of, over))
        return Section(
            id=name,
            title=title,
            lead=lead + _gaps(results),
            claims=sections.claim_rows(decisions),
            pictures=tuple(pictures),
            films=self._film_of(results, name, metric),
            tables=(
                sections.level_table(results, metric),
                sections.run_table(results, self.beside),
            ),
        )

    def _film_of(self, results: StudyResults, name: str, metric: str) -> tuple[Film, ...]:
        """The flight in the middle of the run that has the most of what the section is about."""
        most = max(results.runs, key=lambda run: getattr(run, metric))
        folder = RunFolder(most.path)
        test = evaluations.read_evaluations(folder.evaluation)[0]
        policy = runs.load_run(folder)
        said = f"{' · '.join(most.labels)}, seed {most.seed}"
        return (self.film(policy, test, name, said, METRICS[metric]),)

    def film(
        self, policy: named.NamedPolicy, test: Evaluation, name: str, said: str, most: str
    ) -> Film:
        """A policy's flight from the test start of its median return.

        Args:
            policy: flies.
            test: its test flights.
            name: of the file.
            said: who it is.
            most: what it has more of than the others of its section.
        """
        start = evaluations.median_start(test)
        path = self.figures / f"{name}.gif"
        flight = flights.record_flight(policy.policy, policy.env_id, start, said)
        films.write_gif(flight, path, _FILM_FPS, _FILM_SCALE)
        return Film(
            path,
            f"{said}: {flight.outcome} after {flight.steps} steps",
            f"{said}, the one with the greatest {most}, from the test start of its median "
            f"return, {start}: {flight.outcome}, return {flight.episode_return:.0f}.",
        )


def _gaps(results: StudyResults) -> str:
    gaps: list[str] = []
    if results.missing:
        gaps.append(f" {results.missing} of {results.planned} runs are not done yet.")
    if results.failed:
        reasons = "; ".join(sorted(set(results.failed.values())))
        gaps.append(f" {len(results.failed)} runs failed: {reasons}.")
    return "".join(gaps)


def write_paper_report(
    scale: Scale,
    seeds: int | None,
    store: Store,
    out: Path,
    *,
    names: Sequence[str] | None = None,
    command: str,
    linked: bool,
    on_step: Callable[[str], object] = lambda _: None,
) -> Report:
    """The paper's topics, those of which there are runs.

    Args:
        scale: of the runs.
        seeds: how many a study, if not its own number.
        store: where the runs are.
        out: folder for the page and its pictures.
        names: topics to write; None takes all.
        command: what makes the page's numbers, named on it.
        linked: whether the page links to the runs' folders.
        on_step: told of each topic.

    Raises:
        UserError: the runs' files are broken, or something cannot be written.
    """
    topics = paper.topics(scale)
    wanted = [topics[name] for name in (names or topics)]
    results = {
        study.name: read_study(study, seeds or study.seeds, store)
        for study in {t.study.name: t.study for t in wanted if t.study}.values()
    }
    builder = Builder(out, linked=linked, on_step=on_step)
    tuned = read_pid(paper.pid_jobs(scale, seeds), store)
    decisions: dict[str, list[Decision]] = {}
    found: list[Section] = []
    for topic in wanted:
        made = _paper_section(builder, topic, results, tuned)
        if made is not None:
            decisions[topic.name], section = made
            found.append(section)
    page = Page(
        title="The paper, re-measured",
        lead="Every experiment of the paper with training seeds for its unit, and a verdict on "
        "each of its claims by a test that was written down before the numbers came.",
        facts=_facts(results, tuned, scale),
        sections=tuple(found),
        provenance=_provenance(command, results, scale),
    )
    tables = _run_tables(results)
    if any(decisions.values()):
        tables["claims"] = _claim_table(decisions)
    _write(page, tables, out)
    return Report(out / PAGE, decisions, results)


def write_study_report(
    study: Study,
    seeds: int,
    store: Store,
    out: Path,
    *,
    command: str,
    linked: bool,
    on_step: Callable[[str], object] = lambda _: None,
) -> Report:
    """A study of the user's own: its figure, its levels compared, its runs.

    Args:
        study: what was varied.
        seeds: how many of each cell.
        store: where the runs are.
        out: folder for the page and its pictures.
        command: what makes the page's numbers, named on it.
        linked: whether the page links to the runs' folders.
        on_step: told when it begins.

    Raises:
        UserError: the runs' files are broken, or something cannot be written.
    """
    results = read_study(study, seeds, store)
    builder = Builder(out, linked=linked, on_step=on_step)
    made = (
        [
            builder.section(
                study.name,
                study.title or study.name,
                study.question,
                results,
                "best_return",
                (),
                {},
            )
        ]
        if results.runs
        else []
    )
    known = {study.name: results}
    page = Page(
        title=study.title or study.name,
        lead=study.question,
        facts=_facts(known, (), ""),
        sections=tuple(made),
        provenance=_provenance(command, known, ""),
    )
    _write(page, _run_tables(known), out)
    return Report(out / PAGE, {}, known)


def _paper_section(
    builder: Builder,
    topic: Topic,
    results: Mapping[str, StudyResults],
    tuned: Sequence[PidResult],
) -> tuple[list[Decision], Section] | None:
    """A topic's decisions and section; None where nothing of it has been run."""
    title = f"{topic.title} (section {topic.section})"
    if topic.study is None:
        if not tuned:
            return None
        decisions = decide(topic.claims, _pid_values(tuned))
        return decisions, _pid_section(builder, topic, title, tuned, decisions)
    found = results[topic.study.name]
    if not found.runs:
        return None
    if topic.name == "alike":
        agents = alike.agents_of(found, (paper.BEST,))
        if not agents:
            return None
        likenesses = alike.compare_flights(agents, alike.starts_of(_ALIKE_STARTS))
        decisions = decide(topic.claims, likenesses.values)
        return decisions, _alike_section(builder, topic, title, likenesses, decisions)
    decisions = decide(topic.claims, found.values)
    lines = _lines() if topic.name == "ladder" else {}
    section = builder.section(
        topic.name, title, topic.question, found, topic.metric, decisions, lines
    )
    return decisions, section


def _lines() -> dict[str, float]:
    """What the ladder is compared with: the shipped PID and chance, on the same test starts."""
    starts = TEST_STARTS[:100]
    return {
        words: evaluations.evaluate_policy(lookup.load(name), starts).summary.mean
        for name, words in (("pid", "PID"), ("random", "random"))
    }


def _pid_values(tuned: Sequence[PidResult]) -> Callable[[tuple[str, ...], str], FloatArray]:
    def values(labels: tuple[str, ...], metric: str) -> FloatArray:
        del metric
        return np.array(
            [each.test.summary.mean for each in tuned if each.job.tuning.tuner == labels[0]]
        )

    return values


def _pid_section(
    builder: Builder,
    topic: Topic,
    title: str,
    tuned: Sequence[PidResult],
    decisions: Sequence[Decision],
) -> Section:
    values = _pid_values(tuned)
    stem = builder.figures / topic.name
    rows = [Row(name, values((name,), ""), name == "twiddle") for name in TUNERS]
    sections.save_rows(rows, "test return of the gains", stem)
    best = max(tuned, key=lambda each: each.trained_return)
    tuning = best.job.tuning
    policy = lookup.load(str(best.gains))
    return Section(
        id=topic.name,
        title=title,
        lead=f"{topic.question} Every tuner tries as many gains, from the same beginning.",
        claims=sections.claim_rows(decisions),
        pictures=(
            Picture(
                stem.with_suffix(".svg"),
                stem.with_suffix(".png"),
                "Test return of the gains of each tuner",
                "Mean test return of the gains found, over tuning seeds, each with training "
                "starts of its own; mean with its 95% interval.",
            ),
        ),
        films=(
            builder.film(
                policy,
                best.test,
                topic.name,
                f"{tuning.tuner}, seed {tuning.seed}",
                "return on its training starts",
            ),
        ),
        tables=(_pid_table(tuned, tuning),),
    )


def _pid_table(tuned: Sequence[PidResult], tuning: Tuning) -> Table:
    rows: list[tuple[str, ...]] = []
    for name in TUNERS:
        of = [each for each in tuned if each.job.tuning.tuner == name]
        if not of:
            continue
        test = summarise_seeds([each.test.summary.mean for each in of])
        rows.append(
            (
                name,
                str(test.n),
                sections.interval_text(test.mean),
                f"{np.mean([each.trained_return for each in of]):.0f}",
                f"{np.mean([each.test.summary.share_solved or 0.0 for each in of]):.0%}",
            )
        )
    return Table(
        f"Up to {tuning.trials} gains tried on {tuning.starts} training starts each; "
        "the best of them on the test starts.",
        ("tuner", "seeds", "test return, mean [95%]", "on its training starts", "share ≥ 200"),
        tuple(rows),
    )


def _alike_section(
    builder: Builder,
    topic: Topic,
    title: str,
    likenesses: Likenesses,
    decisions: Sequence[Decision],
) -> Section:
    stem = builder.figures / topic.name
    labels = ("to the PID", "to another seed", "to random")
    rows = [Row(label, likenesses.values((label,), "distance")) for label in labels]
    sections.save_rows(rows, "distance between flights, m", stem, from_zero=True)
    table = Table(
        f"Mean distance of each seed's flights from {likenesses.starts} test starts, in metres.",
        ("seed", *labels),
        tuple(
            (
                str(each.seed),
                f"{each.to_pid:.2f}",
                f"{np.mean(each.to_other_seeds):.2f}" if each.to_other_seeds else "–",
                f"{each.to_random:.2f}",
            )
            for each in likenesses.of
        ),
    )
    return Section(
        id=topic.name,
        title=title,
        lead=f"{topic.question} The distance between two flights is the mean over time of that "
        "between the landers at the same moment; who is down stays where it is.",
        claims=sections.claim_rows(decisions),
        pictures=(
            Picture(
                stem.with_suffix(".svg"),
                stem.with_suffix(".png"),
                "Distances of the agent's flights to the PID's, to other seeds' and to random ones",
                "Mean distance to flights from the same starts, a dot a training seed of the best "
                "agent; mean with its 95% interval.",
            ),
        ),
        films=(),
        tables=(table,),
    )


def _facts(
    results: Mapping[str, StudyResults], tuned: Sequence[PidResult], scale: str
) -> tuple[tuple[str, str], ...]:
    runs = {run.path: run for each in results.values() for run in each.runs}
    hours = sum(run.seconds for run in runs.values()) / 3600
    facts = [
        ("studies", str(len(results) + bool(tuned))),
        ("training runs", str(len(runs))),
        ("observations", f"{sum(run.observations for run in runs.values()) / 1e6:.1f} million"),
        ("hours of training", f"{hours:.1f}"),
    ]
    if scale:
        facts.append(("scale", scale))
    return tuple(facts)


def _provenance(
    command: str, results: Mapping[str, StudyResults], scale: str
) -> tuple[tuple[str, str], ...]:
    bases = {name: each.study.base_cell().config.digest for name, each in results.items()}
    facts = [
        ("made by", command),
        *machine_facts(),
        ("test", f"{_test_starts(results)} starts a run, greedy, that no checkpoint was chosen by"),
        ("base settings", ", ".join(f"{name} {digest}" for name, digest in bases.items())),
    ]
    if scale:
        facts.append(("scale", scale))
    return tuple(facts)


def _test_starts(results: Mapping[str, StudyResults]) -> str:
    counts = {
        cell.config.training.test_episodes
        for each in results.values()
        for cell in each.study.cells()
    }
    return " or ".join(map(str, sorted(counts)))


def machine_facts() -> tuple[tuple[str, str], ...]:
    """When and where a page is written, and with what."""
    return (
        ("written", datetime.now(UTC).strftime("%Y-%m-%d")),
        (
            "machine",
            f"{cpu_name()}, {threads.available()} cores, Python {platform.python_version()}",
        ),
        ("versions", ", ".join(f"{name} {version(name)}" for name in _PACKAGES)),
        ("lander", f"trained on {engines.engine_in_use()}, tested on stock Gymnasium"),
    )


def _run_tables(results: Mapping[str, StudyResults]) -> dict[str, pl.DataFrame]:
    """Every study's runs, for whoever wants to count for themselves."""
    return {name: each.table() for name, each in results.items() if each.runs}


def _claim_table(decisions: Mapping[str, Sequence[Decision]]) -> pl.DataFrame:
    """Every claim with its verdict and the numbers behind it."""
    return pl.DataFrame(
        [
            {
                "study": name,
                "section": decision.claim.section,
                "claim": decision.claim.sentence,
                "verdict": decision.verdict,
                "p": decision.p_value,
                "evidence": decision.evidence,
            }
            for name, each in decisions.items()
            for decision in each
        ]
    )


def _write(page: Page, tables: Mapping[str, pl.DataFrame], out: Path) -> None:
    write_page(page, out / PAGE)
    with files.refusing(str(out / _SUMMARY)):
        files.write_atomic(out / _SUMMARY, summary_of(page, out, PAGE))
    folder = out / "tables"
    with files.refusing(str(folder)):
        folder.mkdir(exist_ok=True)
        for name, table in tables.items():
            files.write_atomic(folder / f"{name}.csv", table.write_csv(float_precision=4))
