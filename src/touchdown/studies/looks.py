"""Claims decided in looks: at planned numbers of seeds, until each is decided or hopeless."""

from collections.abc import Callable, Sequence
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
class LookDecision:
    """A claim with its verdict so far."""

    decision: Decision
    next_seeds: int | None
    """Seeds per cell at the next look; None if it is decided, hopeless, or was the last."""


def decide_in_looks(
    claims: Sequence[Claim], values: SeedValues, looks: Sequence[int], metric: str = DEFAULT_METRIC
) -> list[LookDecision]:
    """Decide each claim at the first look at which it can be.

    A look uses the seeds that were planned for it, however many others there are, and waits until
    all of them have finished, so that the verdicts do not depend on when somebody looked. The
    claims that are still open share the level of a look (Holm, 1979); the looks share 5%
    (`stats.spending`).

    Args:
        claims: the claims of one study.
        values: the study's numbers.
        looks: numbers of seeds, increasing.
        metric: the metric of claims that name none.
    """
    metrics = [claim.metric or metric for claim in claims]
    levels = spending.obrien_fleming(looks)
    found: dict[int, LookDecision] = {}
    latest: dict[int, LookDecision] = {}
    for number, (look, level) in enumerate(zip(looks, levels, strict=True), start=1):
        is_open = [i for i in range(len(claims)) if i not in found]
        groups = {
            i: known_groups(claims[i], lambda cell, of, n=look: values(cell, of, n), metrics[i])
            for i in is_open
        }
        seeds = {i: min(map(len, of_claim)) for i, of_claim in groups.items()}
        if number == 1:
            latest = {i: _waiting(claims[i], metrics[i], seeds[i], look) for i in is_open}
        findings = {
            i: finding_of(claims[i].test, groups[i], metrics[i])
            for i in is_open
            if seeds[i] >= look
        }
        p_raw = [1.0 if (f := findings.get(i)) is None else f.p_value for i in is_open]
        for i, p in zip(is_open, compare.holm(p_raw), strict=True):
            finding = findings.get(i)
            if finding is None:
                continue
            where = f"look {number} of {len(looks)}, {look} seeds, level {p_text(level)}"
            decided = _decided(claims[i], metrics[i], finding, p, level, where)
            if decided is not None:
                found[i] = LookDecision(decided, None)
            else:
                later = list(zip(looks, levels, strict=True))[number:]
                latest[i] = _open(claims[i], metrics[i], finding, p, groups[i], later, where)
    return [found.get(i, latest[i]) for i in range(len(claims))]


def seeds_of_cells(
    claims: Sequence[Claim],
    values: SeedValues,
    looks: Sequence[int],
    cells: Sequence[str],
    metric: str = DEFAULT_METRIC,
) -> dict[str, int]:
    """How many seeds each cell should have: more where a claim is open.

    Args:
        claims: the claims of one study.
        values: the study's numbers.
        looks: numbers of seeds, increasing.
        cells: the names of all cells.
        metric: the metric of claims that name none.
    """
    wanted = dict.fromkeys(cells, looks[0])
    for each in decide_in_looks(claims, values, looks, metric):
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
    digests = {run.name for run in results.runs} | results.failed.keys()
    missing = sum(run.digest not in digests for run in _next_runs(results))
    return replace(results, missing=missing)


def next_jobs(study: Study, store: Store) -> list[TrainJob]:
    """The runs that a study with looks should have now, done or not, by seed.

    Raises:
        UserError: a finished run's files are broken.
    """
    results = read_study(study, study.looks[-1], store)
    return [TrainJob(run.config) for run in _next_runs(results)]


def _next_runs(results: StudyResults) -> list[PlannedRun]:
    """The runs that a study should have now, by its results so far, by seed."""
    study = results.study
    cells = [cell.name for cell in study.cells()]
    wanted = seeds_of_cells(study.claims, results.named_until, study.looks, cells, study.metric)
    return [
        run
        for run in study.runs(study.looks[-1])
        if run.seed < study.first_seed + wanted[run.cell.name]
    ]


def _waiting(claim: Claim, metric: str, seeds: int, first: int) -> LookDecision:
    text = f"{seeds} finished seeds of each level; the first look is at {first}"
    return LookDecision(
        Decision(claim, metric, "undecided", text, 1.0, 1.0, seeds, first - seeds), first
    )


def _decided(
    claim: Claim, metric: str, finding: Finding, p: float, level: float, where: str
) -> Decision | None:
    """The decision at a look; None if it is open."""
    verdict = verdict_of(finding, p, level)
    if verdict == "undecided":
        return None
    text = f"{evidence_text(finding, p)}; decided at {where}"
    return Decision(claim, metric, verdict, text, finding.p_value, p, finding.seeds, None)


def _open(
    claim: Claim,
    metric: str,
    finding: Finding,
    p: float,
    groups: Sequence[FloatArray],
    later: Sequence[tuple[int, float]],
    where: str,
) -> LookDecision:
    """The state of a claim that a look left open.

    Args:
        claim: the claim.
        metric: the metric that was tested.
        finding: what the look found.
        p: its p-value, corrected for the other claims.
        groups: the numbers that the look used.
        later: the seeds and the level of each later look.
        where: the look in words.
    """
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
