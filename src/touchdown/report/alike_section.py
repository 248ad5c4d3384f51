"""The section on similarity to the PID's flights: distances between paths from the same starts."""

import math
from collections.abc import Sequence

import numpy as np
import polars as pl

from touchdown.figures.studies import Row
from touchdown.report import pictures, tables
from touchdown.report.builder import Builder
from touchdown.report.page import Picture, Section, Table
from touchdown.studies.alike import AgentDistances, Controls
from touchdown.studies.claims import Decision
from touchdown.studies.paper import BEST, Topic


def alike_section(
    builder: Builder,
    topic: Topic,
    title: str,
    distances: AgentDistances,
    controls: Controls,
    decisions: Sequence[Decision],
) -> Section:
    """The section on how close the agent's flights are to the PID's.

    Args:
        builder: builder of the page.
        topic: the topic of the paper.
        title: title of the section.
        distances: distances of the best agent.
        controls: distances of others.
        decisions: decisions on the topic's claims.
    """
    stem = builder.figures / topic.name
    labels = ("to the PID", "to another seed", "to random")
    rows = [Row(label, distances.values(label, "distance"), is_base=True) for label in labels]
    rows += [
        Row(f"{name} to the PID", np.array([*of.values()])) for name, of in controls.agents.items()
    ]
    known = not math.isnan(controls.heuristic)
    lines = {"heuristic to the PID": controls.heuristic} if known else {}
    pictures.save_rows(rows, "distance between flights, m", stem, lines, from_zero=True)
    table = Table(
        f"Mean distance of each seed's flights from {distances.starts} test starts, in metres.",
        ("seed", *labels),
        tuple(
            (
                str(each.seed),
                f"{each.to_pid:.2f}",
                f"{each.to_another:.2f}" if each.to_other_seeds else "–",
                f"{each.to_random:.2f}",
            )
            for each in distances.of
        ),
    )
    return Section(
        id=topic.name,
        title=title,
        lead=f"{topic.question} The distance between two flights is the mean over time of the "
        "distance between the two landers at the same step; a lander stays where it ended.",
        claims=tables.claim_rows(decisions),
        pictures=(
            Picture(
                stem.with_suffix(".svg"),
                stem.with_suffix(".png"),
                "Distances of the agent's flights to the PID's, to other seeds' and to random ones",
                "Mean distance between flights from the same starts; each dot is a training seed; "
                "median with its 95% interval. Orange: the best agent's flights. Blue, for "
                "comparison: those of the other agents.",
            ),
        ),
        films=(),
        tables=(table,),
    )


def alike_table(distances: AgentDistances, controls: Controls) -> pl.DataFrame:
    """A row for each training seed, with its distances in metres; null where there is none.

    Args:
        distances: distances of the best agent.
        controls: distances of others.
    """
    rows = [
        {
            "level": BEST,
            "seed": each.seed,
            "to_pid": each.to_pid,
            "to_random": each.to_random,
            "to_other_seeds": each.to_another if each.to_other_seeds else None,
        }
        for each in distances.of
    ]
    none = {"to_random": None, "to_other_seeds": None}
    rows += [
        {"level": name, "seed": seed, "to_pid": to_pid, **none}
        for name, of in controls.agents.items()
        for seed, to_pid in of.items()
    ]
    if not math.isnan(controls.heuristic):
        rows.append({"level": "heuristic", "seed": None, "to_pid": controls.heuristic, **none})
    return pl.DataFrame(rows, infer_schema_length=None)
