"""Claims and their verdicts, decided by statistical tests on one number per training seed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchdown.core.complaints import complaint
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.stats import compare
from touchdown.studies.assurance import ASSURANCE, FURTHER_SEEDS, seeds_for_decision
from touchdown.studies.claim_tests import KINDS, Test
from touchdown.studies.findings import Finding, Values, Verdict, evidence_text
from touchdown.studies.metrics import DEFAULT_METRIC

CLAIMS = "claims"
"""Name of the table of claims in a report; studies may not use it."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement made before the results are known, and the test that decides it.

    Example:
        ```python
        Claim("A longer horizon brings more return.", Greater("0.99", "0.9", margin=20))
        ```

    Raises:
        UserError: the sentence is empty or has several lines, or the kind of test is unknown.
    """

    sentence: str
    """The claim in words, as shown on the page."""
    test: Test
    metric: str = ""
    """The metric that is tested, one of `METRICS`; if empty, the study's metric."""
    section: str = ""
    """Section of the paper; empty for a claim that is not the paper's."""

    def __post_init__(self) -> None:
        for name in ("sentence", "metric", "section"):
            if said := complaint(getattr(self, name), str, name):
                raise UserError(said)
        if len(self.sentence.splitlines()) != 1:
            raise UserError(f"sentence = {self.sentence!r}: must be text on one line")
        if type(self.test) not in KINDS.values():
            names = ", ".join(kind.__name__ for kind in KINDS.values())
            raise UserError(f"test = {self.test!r}: must be one of {names}")


@dataclass(frozen=True, slots=True)
class Decision:
    """A claim with its verdict."""

    claim: Claim
    metric: str
    """The metric that was tested."""
    verdict: Verdict
    evidence: str
    p_raw: float
    """Two-sided; 1 while there are too few runs."""
    p_value: float
    """`p_raw`, corrected for the other claims of the study."""
    seeds: int
    """Smallest number of seeds in a tested cell."""
    more_seeds: int | None
    """Number of further seeds per cell that would decide it with a probability of `ASSURANCE`;
    None if it is decided, if it has too few seeds for its test, if no number that is tried would,
    or if nobody asked."""


def decide(
    claims: Sequence[Claim],
    values: Values,
    metric: str = DEFAULT_METRIC,
    *,
    with_advice: bool = True,
) -> list[Decision]:
    """Decide each claim; the probability of any false decision is at most 5% (Holm, 1979).

    Args:
        claims: the claims of one study.
        values: the study's numbers.
        metric: the metric of claims that name none.
        with_advice: whether to say how many more seeds would decide an undecided claim, which takes
            a second each.
    """
    metrics = [claim.metric or metric for claim in claims]
    groups = [known_groups(claim, values, of) for claim, of in zip(claims, metrics, strict=True)]
    findings = [
        finding_of(claim.test, of_claim, of)
        for claim, of_claim, of in zip(claims, groups, metrics, strict=True)
    ]
    corrected = compare.holm([1.0 if each is None else each.p_value for each in findings])
    return [
        _too_few(claim, of, of_claim)
        if finding is None
        else _decision(claim, of, of_claim, finding, p, with_advice=with_advice)
        for claim, of, of_claim, finding, p in zip(
            claims, metrics, groups, findings, corrected, strict=True
        )
    ]


def preview(
    claims: Sequence[Claim], values: Values, metric: str = DEFAULT_METRIC
) -> list[Decision]:
    """The evidence on each claim, without a verdict; see `decide`."""
    found = decide(claims, values, metric, with_advice=False)
    return [replace(each, verdict="preview") for each in found]


def known_groups(claim: Claim, values: Values, metric: str) -> list[FloatArray]:
    """The numbers of each cell of a claim's test, without those that a run does not have."""
    every = [values(cell, metric) for cell in claim.test.cells]
    return [of_cell[~np.isnan(of_cell)] for of_cell in every]


def finding_of(test: Test, groups: Sequence[FloatArray], metric: str) -> Finding | None:
    """The finding of a claim's test; None with fewer seeds than it needs."""
    seeds = min(map(len, groups))
    if seeds < test.fewest_seeds:
        return None
    return Finding(test.rule(groups, metric), test.evidence(groups, metric), seeds)


def verdict_of(finding: Finding, p: float, alpha: float) -> Verdict:
    """The verdict at a level.

    Args:
        finding: the finding.
        p: its p-value, corrected for the other claims.
        alpha: the two-sided level for all of them.
    """
    return finding.verdict(_level_of(finding, p, alpha)) if p <= alpha else "undecided"


def _level_of(finding: Finding, p: float, alpha: float) -> float:
    """The level of one claim: the correction raised its p-value, so alpha falls by that factor."""
    return alpha * finding.p_value / p


def _too_few(claim: Claim, metric: str, groups: Sequence[FloatArray]) -> Decision:
    seeds = min(map(len, groups))
    text = f"{seeds} finished seeds of each level; the test needs {claim.test.fewest_seeds}"
    return Decision(claim, metric, "undecided", text, 1.0, 1.0, seeds, None)


def _decision(
    claim: Claim,
    metric: str,
    groups: Sequence[FloatArray],
    finding: Finding,
    p: float,
    *,
    with_advice: bool,
) -> Decision:
    text = evidence_text(finding, p)
    raw, seeds = finding.p_value, finding.seeds
    verdict = verdict_of(finding, p, compare.ALPHA)
    if verdict != "undecided" or not with_advice:
        return Decision(claim, metric, verdict, text, raw, p, seeds, None)
    more = seeds_for_decision(claim.test, groups, metric, _level_of(finding, p, compare.ALPHA) / 2)
    advice = (
        f"{FURTHER_SEEDS[-1]} more seeds of each decide it with less than {ASSURANCE:.0%} "
        "probability"
        if more is None
        else f"{more} more seeds of each decide it with {ASSURANCE:.0%} probability"
    )
    return Decision(claim, metric, "undecided", f"{text}; {advice}", raw, p, seeds, more)
