"""Claims decided in looks: at planned numbers of seeds, until each is decided or hopeless."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from touchdown.core.types import FloatArray
from touchdown.stats import compare, spending
from touchdown.studies.assurance import decided_share
from touchdown.studies.claims import Claim, Decision, finding_of, known_groups, verdict_of
from touchdown.studies.findings import LEAST_P, Finding, Values, p_text
from touchdown.studies.metrics import DEFAULT_METRIC
from touchdown.studies.plan import PlannedRun, Study
from touchdown.studies.results import StudyResults, read_study
from touchdown.studies.store import Store

HOPELESS = 0.05
"""A claim gets no more seeds if all of the plan's would decide it with a smaller probability."""


@dataclass(frozen=True, slots=True)
class LookDecision:
    """A claim with its verdict so far."""

    decision: Decision
    next_seeds: int | None
    """Seeds per cell at the next look; None if it is decided, hopeless, or was the last."""


def decide_in_looks(
    claims: Sequence[Claim], values: Values, looks: Sequence[int], metric: str = DEFAULT_METRIC
) -> list[LookDecision]:
    """Decide each claim at the first look at which it can be.

    A look uses as many seeds of each cell as were planned for it, however many there are, so that
    the verdicts do not depend on when somebody looked. At each look, the claims that are still open
    share its level (Holm, 1979); the looks share 5% (`stats.spending`).

    Args:
        claims: the claims of one study.
        values: the study's numbers.
        looks: numbers of seeds, increasing.
        metric: the metric of claims that name none.
    """
    metrics = [claim.metric or metric for claim in claims]
    groups = [known_groups(claim, values, of) for claim, of in zip(claims, metrics, strict=True)]
    seeds = [min(map(len, of_claim)) for of_claim in groups]
    levels = spending.obrien_fleming(looks)
    found: dict[int, LookDecision] = {}
    latest: dict[int, LookDecision] = {
        i: _waiting(claim, metrics[i], seeds[i], looks[0]) for i, claim in enumerate(claims)
    }
    for number, (look, level) in enumerate(zip(looks, levels, strict=True), start=1):
        is_open = [i for i in range(len(claims)) if i not in found]
        findings = {
            i: finding_of(claims[i].test, [group[:look] for group in groups[i]], metrics[i])
            for i in is_open
            if seeds[i] >= look
        }
        p_raw = [1.0 if (f := findings.get(i)) is None else f.p_value for i in is_open]
        for i, p in zip(is_open, compare.holm(p_raw), strict=True):
            finding = findings.get(i)
            if finding is None:
                continue
            where = f"look {number} of {len(looks)}, {look} seeds"
            decided = _decided(claims[i], metrics[i], finding, p, level, where)
            if decided is not None:
                found[i] = LookDecision(decided, None)
            else:
                seen = [group[:look] for group in groups[i]]
                latest[i] = _open(claims[i], metrics[i], finding, p, seen, looks, levels, where)
    return [found.get(i, latest[i]) for i in range(len(claims))]


def seeds_of_cells(
    claims: Sequence[Claim],
    values: Values,
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
    missing = sum(run.digest not in digests for run in next_runs(results))
    return replace(results, missing=missing)


def next_runs(results: StudyResults) -> list[PlannedRun]:
    """The runs that a study should have now, by its results so far, by seed."""
    study = results.study
    cells = [cell.name for cell in study.cells()]
    wanted = seeds_of_cells(study.claims, results.named, study.looks, cells, study.metric)
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
    text = f"{_text(finding, p)}; decided at {where}"
    return Decision(claim, metric, verdict, text, finding.p_value, p, finding.seeds, None)


def _open(
    claim: Claim,
    metric: str,
    finding: Finding,
    p: float,
    groups: Sequence[FloatArray],
    looks: Sequence[int],
    levels: Sequence[float],
    where: str,
) -> LookDecision:
    text = f"{_text(finding, p)}; open at {where}"
    later = [look for look in looks if look > finding.seeds]
    if later:
        further = later[-1] - finding.seeds
        if decided_share(claim.test, groups, metric, levels[-1] / 2, further) < HOPELESS:
            text = f"{text}; given up, because {later[-1]} seeds would decide it with less than "
            text += f"{HOPELESS:.0%} probability"
            later = []
    more = later[0] - finding.seeds if later else None
    decision = Decision(claim, metric, "undecided", text, finding.p_value, p, finding.seeds, more)
    return LookDecision(decision, later[0] if later else None)


def _text(finding: Finding, p: float) -> str:
    return f"{finding.evidence}; p {p_text(p) if p < LEAST_P else f'= {p_text(p)}'}"
