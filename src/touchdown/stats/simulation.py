"""The table of `touchdown study check`: the error rates of the tests, intervals and verdicts."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from touchdown.stats.procedures import PROCEDURES, Kind, Procedure
from touchdown.stats.scenarios import SCENARIOS

SEEDS = (5, 8, 10, 15, 20, 30, 50, 100)
"""Training seeds of each setting."""
REPETITIONS = 20_000
MOST_ERRORS = 0.06
"""Largest error rate of a test or a verdict that claims 5%."""
LEAST_COVERAGE = 0.93
"""Smallest coverage of an interval that claims 95%."""


@dataclass(frozen=True, slots=True)
class CheckRow:
    """One procedure in one scenario, with one number of seeds."""

    kind: Kind
    procedure: str
    scenario: str
    seeds: int
    repetitions: int
    error: float
    strict_error: float
    coverage: float
    power: float

    @property
    def keeps(self) -> bool:
        """Whether the rate is within its limit, or at most two standard errors outside.

        The standard error is that of the simulation: 0.17% with 20,000 repetitions.
        """
        limit = LEAST_COVERAGE if self.kind == "interval" else MOST_ERRORS
        error = math.sqrt(limit * (1 - limit) / self.repetitions)
        if self.kind == "interval":
            return self.coverage >= limit - 2 * error
        return self.error <= limit + 2 * error


def simulate(
    repetitions: int = REPETITIONS,
    seed: int = 0,
    *,
    counts: Sequence[int] = SEEDS,
    procedures: Sequence[Procedure] = PROCEDURES,
    on_row: Callable[[], object] = lambda: None,
) -> list[CheckRow]:
    """Simulate every procedure in every scenario; a row depends on the seed and on itself alone.

    Args:
        repetitions: simulated data sets of a row; slow procedures get a fixed share of them.
        seed: seed of the simulation.
        counts: numbers of training seeds.
        procedures: what to simulate.
        on_row: called after each row.
    """
    found: list[CheckRow] = []
    for procedure in procedures:
        for i, scenario in enumerate(SCENARIOS):
            for n in counts:
                name = [seed, i, n, *procedure.name.encode()]
                count = max(1, round(repetitions * procedure.share))
                rng = np.random.default_rng(np.random.SeedSequence(name))
                rates = procedure.run(rng, scenario, count, n)
                found.append(
                    CheckRow(procedure.kind, procedure.name, scenario.name, n, count, *rates)
                )
                on_row()
    return found


def count_rows(counts: Sequence[int] = SEEDS, procedures: Sequence[Procedure] = PROCEDURES) -> int:
    """Number of rows of a simulation."""
    return len(counts) * len(procedures) * len(SCENARIOS)


def fewest_seeds(rows: Sequence[CheckRow], procedure: str) -> int | None:
    """The smallest number of seeds from which on a procedure keeps its limit in all scenarios.

    Returns:
        The number; None if it breaks the limit with the largest number, too.
    """
    of = [row for row in rows if row.procedure == procedure]
    kept: int | None = None
    for n in sorted({row.seeds for row in of}, reverse=True):
        if not all(row.keeps for row in of if row.seeds == n):
            break
        kept = n
    return kept


def summary_of(rows: Sequence[CheckRow]) -> list[tuple[str, str, str, str]]:
    """For each procedure: its name, its kind, its worst rate, and from where it keeps its limit."""
    kinds = {row.procedure: row.kind for row in rows}
    return [(name, kind, _worst(rows, name), _from(rows, name)) for name, kind in kinds.items()]


def to_markdown(rows: Sequence[CheckRow]) -> str:
    """The rows as tables: a summary, and for each procedure its rates by scenario and seeds."""
    head = ("procedure", "kind", "worst rate", "keeps its limit from")
    parts = [_table([head, ("---",) * len(head), *summary_of(rows)])]
    for name in dict.fromkeys(row.procedure for row in rows):
        of = [row for row in rows if row.procedure == name]
        parts.append(f"### {name[0].upper()}{name[1:]}\n\n{_table(_rates_of(of))}")
    return "\n\n".join(parts)


def _worst(rows: Sequence[CheckRow], name: str) -> str:
    of = [row for row in rows if row.procedure == name]
    if of[0].kind == "interval":
        return f"coverage {min(row.coverage for row in of):.1%}"
    return f"error {max(row.error for row in of):.1%}"


def _from(rows: Sequence[CheckRow], name: str) -> str:
    fewest = fewest_seeds(rows, name)
    return "never" if fewest is None else f"{fewest} seeds"


def _rates_of(rows: Sequence[CheckRow]) -> list[tuple[str, ...]]:
    """A line for each scenario: the rate, in bold outside its limit, then the power."""
    counts = sorted({row.seeds for row in rows})
    head = ("%", *(f"n = {n}" for n in counts))
    by_place = {(row.scenario, row.seeds): row for row in rows}
    scenarios = dict.fromkeys(row.scenario for row in rows)
    return [
        head,
        ("---",) * len(head),
        *(
            (scenario, *(_cell(by_place[scenario, n]) for n in counts if (scenario, n) in by_place))
            for scenario in scenarios
        ),
    ]


def _cell(row: CheckRow) -> str:
    rate = row.coverage if row.kind == "interval" else row.error
    text = f"{100 * rate:.1f}"
    text = text if row.keeps else f"**{text}**"
    return text if math.isnan(row.power) else f"{text} / {100 * row.power:.0f}"


def _table(rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)
