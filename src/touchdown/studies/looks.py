"""Claims decided in looks: at planned numbers of seeds, until each is decided or hopeless."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from touchdown.core.types import FloatArray
from touchdown.stats import compare, spending
from touchdown.studies.assurance import decided_share
from touchdown.studies.claims import Claim, Decision, finding_of, known_groups, verdict_of
from touchdown.studies.findings import Finding, evidence_text, p_text
from touchdown.studies.metrics import DEFAULT_METRIC
from touchdown.studies.plan import PlannedRun, Study
from touchdown.studies.results import StudyResults, read_study
from touchdown.studies.store import Store
from touchdown.studies.work import TrainJob

HOPELESS = 0.05
"""A claim gets no more seeds if all of the plan's would decide it with a smaller probability."""


SeedValues = Callable[[str, str, int], FloatArray]
"""One number per finished run of a cell, among its first planned seeds, [n], by the cell's name,
the metric's and the number of seeds."""


@dataclass(frozen=True, slots=True)
class Question:
    """A claim with the numbers that decide it."""

    claim: Claim
    values: SeedValues
    metric: str
    """The metric that is tested."""


@dataclass(frozen=True, slots=True)
class LookDecision:
    """A claim with its verdict so far."""

    decision: Decision
    next_seeds: int | None
    """Seeds per cell at the next look; None if it is decided, hopeless, or was the last."""


def questions(
    claims: Iterable[Claim], values: SeedValues, metric: str = DEFAULT_METRIC
) -> list[Question]:
    """The claims about the same numbers.

    Args:
        claims: the claims.
        values: their numbers.
        metric: the metric of claims that name none.
    """
    return [Question(claim, values, claim.metric or metric) for claim in claims]


def decide_in_looks(
    asked: Sequence[Question], looks: Sequence[int], shape: str = spending.OBRIEN_FLEMING
) -> list[LookDecision]:
    """Decide each claim at the first look at which it can be.

    A look uses the seeds that were planned for it, however many others there are, and a claim waits
    until all of its own have finished. Holm's correction (1979) is over all claims that are still
    open, also those that wait; until none does, verdicts are provisional: they keep the error
    rate, but more of them may be decided later, or decided more closely. The looks share 5%
    (`stats.spending`).

    Args:
        asked: the claims that share the 5%, with their numbers.
        looks: numbers of seeds, increasing.
        shape: how the looks share the 5%, one of `spending.SHAPES`.
    """
    levels = spending.levels(looks, shape)
    found: dict[int, LookDecision] = {}
    latest: dict[int, LookDecision] = {}
    for number, (look, level) in enumerate(zip(looks, levels, strict=True), start=1):
        is_open = [i for i in range(len(asked)) if i not in found]
        groups = {i: _groups(asked[i], look) for i in is_open}
        seeds = {i: min(map(len, of_claim)) for i, of_claim in groups.items()}
        if number == 1:
            latest = {i: _waiting(asked[i], seeds[i], look) for i in is_open}
        findings = {
            i: finding_of(asked[i].claim.test, groups[i], asked[i].metric)
            for i in is_open
            if seeds[i] >= look
        }
        waits = len(findings) < len(is_open)
        p_raw = [1.0 if (f := findings.get(i)) is None else f.p_value for i in is_open]
        for i, p in zip(is_open, compare.holm(p_raw), strict=True):
            finding = findings.get(i)
            if finding is None:
                continue
            where = f"look {number} of {len(looks)}, {look} seeds, level {p_text(level)}"
            where += "; provisional while other claims wait for their seeds" if waits else ""
            decided = _decided(asked[i], finding, p, level, where)
            if decided is not None:
                found[i] = LookDecision(decided, None)
            else:
                later = list(zip(looks, levels, strict=True))[number:]
                latest[i] = _open(asked[i], finding, p, groups[i], later, where)
    return [found.get(i, latest[i]) for i in range(len(asked))]


def seeds_of_cells(
    study: Study, claims: Sequence[Claim], decisions: Sequence[LookDecision]
) -> dict[str, int]:
    """How many seeds each cell should have: more where a claim is open.

    A cell that no claim names has the study's own number.

    Args:
        study: a study with looks.
        claims: all claims about its cells.
        decisions: those of these claims.
    """
    named = {cell for claim in claims for cell in claim.test.cells}
    wanted = {
        cell.name: study.looks[0] if cell.name in named else min(study.seeds, study.looks[-1])
        for cell in study.cells()
    }
    for each in decisions:
        if each.next_seeds is not None:
            for cell in each.decision.claim.test.cells:
                wanted[cell] = max(wanted[cell], each.next_seeds)
    return wanted


def read_in_looks(study: Study, store: Store) -> StudyResults:
    """The results of a study with looks; missing are the runs that its open claims need next.

    Raises:
        UserError: a finished run's files are broken.
    """
    results = read_study(study, study.looks[-1], store)
    return with_missing(results, _wanted(results))


def with_missing(results: StudyResults, wanted: Mapping[str, int]) -> StudyResults:
    """The same results, of which the runs are missing that a study should have now.

    Args:
        results: the results with all seeds of a study in looks.
        wanted: the number of seeds of each cell.
    """
    digests = {run.name for run in results.runs} | results.failed.keys()
    planned = planned_until(results.study, wanted)
    return replace(results, missing=sum(run.digest not in digests for run in planned))


def next_jobs(study: Study, store: Store) -> list[TrainJob]:
    """The runs that a study with looks should have now, done or not, by seed.

    Raises:
        UserError: a finished run's files are broken.
    """
    results = read_study(study, study.looks[-1], store)
    return [TrainJob(run.config) for run in planned_until(study, _wanted(results))]


def decide_study(results: StudyResults) -> list[LookDecision]:
    """The decisions on the claims of a study with looks.

    Args:
        results: its results with all seeds.
    """
    study = results.study
    asked = questions(study.claims, results.named_until, study.metric)
    return decide_in_looks(asked, study.looks, study.spending)


def planned_until(study: Study, wanted: Mapping[str, int]) -> list[PlannedRun]:
    """The runs of a study, by seed.

    Args:
        study: the study.
        wanted: the number of seeds of each cell.
    """
    return [
        run
        for run in study.runs(max(wanted.values()))
        if run.seed < study.first_seed + wanted[run.cell.name]
    ]


def _wanted(results: StudyResults) -> dict[str, int]:
    study = results.study
    return seeds_of_cells(study, study.claims, decide_study(results))


def _groups(question: Question, seeds: int) -> list[FloatArray]:
    """The numbers of a claim's cells with the first seeds."""
    return known_groups(
        question.claim, lambda cell, of: question.values(cell, of, seeds), question.metric
    )


def _waiting(question: Question, seeds: int, first: int) -> LookDecision:
    text = f"{seeds} of {first} seeds of each level have this number; the first look is at {first}"
    claim, metric = question.claim, question.metric
    return LookDecision(
        Decision(claim, metric, "undecided", text, 1.0, 1.0, seeds, first - seeds), first
    )


def _decided(
    question: Question, finding: Finding, p: float, level: float, where: str
) -> Decision | None:
    """The decision at a look; None if it is open."""
    verdict = verdict_of(finding, p, level)
    if verdict == "undecided":
        return None
    text = f"{evidence_text(finding, p)}; decided at {where}"
    claim, metric = question.claim, question.metric
    return Decision(claim, metric, verdict, text, finding.p_value, p, finding.seeds, None)


def _open(
    question: Question,
    finding: Finding,
    p: float,
    groups: Sequence[FloatArray],
    later: Sequence[tuple[int, float]],
    where: str,
) -> LookDecision:
    """The state of a claim that a look left open.

    Args:
        question: the claim.
        finding: what the look found.
        p: its p-value, corrected for the other claims.
        groups: the numbers that the look used.
        later: the seeds and the level of each later look.
        where: the look in words.
    """
    claim, metric = question.claim, question.metric
    text = f"{evidence_text(finding, p)}; open at {where}"
    chances = [
        decided_share(claim.test, groups, metric, level / 2, look - finding.seeds)
        for look, level in later
    ]
    if chances and max(chances) < HOPELESS:
        text += f"; given up, because no later look would decide it with {HOPELESS:.0%} probability"
        later = []
    next_seeds = later[0][0] if later else None
    more = None if next_seeds is None else next_seeds - finding.seeds
    decision = Decision(claim, metric, "undecided", text, finding.p_value, p, finding.seeds, more)
    return LookDecision(decision, next_seeds)
