"""The section on similarity to the PID's flights: distances between paths from the same starts."""

from collections.abc import Sequence

import numpy as np

from touchdown.figures.studies import Row
from touchdown.report import pictures, tables
from touchdown.report.builder import Builder
from touchdown.report.page import Picture, Section, Table
from touchdown.studies.alike import AgentDistances
from touchdown.studies.claims import Decision
from touchdown.studies.paper import Topic


def alike_section(
    builder: Builder,
    topic: Topic,
    title: str,
    distances: AgentDistances,
    decisions: Sequence[Decision],
) -> Section:
    """The section on how close the agent's flights are to the PID's.

    Args:
        builder: builder of the page.
        topic: the topic of the paper.
        title: title of the section.
        distances: distances of the best agent.
        decisions: decisions on the topic's claims.
    """
    stem = builder.figures / topic.name
    labels = ("to the PID", "to another seed", "to random")
    rows = [Row(label, distances.values(label, "distance")) for label in labels]
    pictures.save_rows(rows, "distance between flights, m", stem, from_zero=True)
    table = Table(
        f"Mean distance of each seed's flights from {distances.starts} test starts, in metres.",
        ("seed", *labels),
        tuple(
            (
                str(each.seed),
                f"{each.to_pid:.2f}",
                f"{np.mean([*each.to_other_seeds.values()]):.2f}" if each.to_other_seeds else "–",
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
                "Mean distance to flights from the same starts; each dot is a training seed of the "
                "best agent; median with its 95% interval.",
            ),
        ),
        films=(),
        tables=(table,),
    )
