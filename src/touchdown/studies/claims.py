"""Claims and their verdicts, decided by statistical tests on one number per training seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from touchdown.core.complaints import complaint
from touchdown.core.errors import UserError
from touchdown.stats import compare
from touchdown.studies.claim_tests import KINDS, Test
from touchdown.studies.findings import LEAST_P, Finding, Values, p_text
from touchdown.studies.metrics import DEFAULT_METRIC

Verdict = Literal["holds", "does not hold", "undecided"]
CLAIMS = "claims"
"""Name of the table of claims in a report; studies may not use it."""
VERDICTS: tuple[Verdict, ...] = ("holds", "does not hold", "undecided")


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement made before the results are known, and the test that decides it.

    Example:
        ```python
        Claim("A longer horizon brings more return.", Greater(above="0.99", below="0.9"))
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
    """Number of further seeds per cell that would probably decide it; None if it is decided, or if
    no feasible number would."""


def decide(claims: Sequence[Claim], values: Values, metric: str = DEFAULT_METRIC) -> list[Decision]:
    """Decide each claim; the probability of any false decision is at most 5% (Holm, 1979).

    Args:
        claims: the claims of one study.
        values: the study's numbers.
        metric: the metric of claims that name none.
    """
    metrics = [claim.metric or metric for claim in claims]
    findings = [claim.test.find(values, of) for claim, of in zip(claims, metrics, strict=True)]
    raw = [1.0 if found is None else found.p_value for found in findings]
    corrected = compare.holm(raw)
    return [
        _without_finding(claim, of, values) if finding is None else _decision(claim, of, finding, p)
        for claim, of, finding, p in zip(claims, metrics, findings, corrected, strict=True)
    ]


def _without_finding(claim: Claim, metric: str, values: Values) -> Decision:
    seeds = min(len(values(cell, metric)) for cell in claim.test.cells)
    return Decision(claim, metric, "undecided", "too few finished runs", 1.0, 1.0, seeds, None)


def _decision(claim: Claim, metric: str, finding: Finding, p: float) -> Decision:
    text = f"{finding.evidence}; p {p_text(p) if p < LEAST_P else f'= {p_text(p)}'}"
    raw, seeds = finding.p_value, finding.seeds
    if p < compare.ALPHA:
        verdict = "holds" if finding.p_for < finding.p_against else "does not hold"
        return Decision(claim, metric, verdict, text, raw, p, seeds, None)
    # the correction raised the p-value; to undo it, alpha falls by the same factor
    needed = finding.seeds_needed(compare.ALPHA * raw / p)
    more = None if needed is None else max(1, needed - seeds)
    advice = (
        "no number of seeds that can be run would decide it"
        if more is None
        else f"about {more} more {'seed' if more == 1 else 'seeds'} of each would decide it"
    )
    return Decision(claim, metric, "undecided", f"{text}; {advice}", raw, p, seeds, more)
