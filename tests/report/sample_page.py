"""A page with all that a page may have, and names that were chosen to do harm."""

from pathlib import Path

import numpy as np
from PIL import Image

from touchdown.figures import rungs, style
from touchdown.figures import studies as figures
from touchdown.figures.studies import Point, Row
from touchdown.report.page import (
    ClaimRow,
    Film,
    Link,
    Page,
    Picture,
    Section,
    Table,
    TableCell,
)
from touchdown.studies.findings import Verdict

HOSTILE = "<script>alert('x')</script>\"><img src=x onerror=alert(1)>&amp;{{ 7 * 7 }}"
LONG = "paper-best_with_a_name_that_" + "never_" * 20 + "ends"

_CLAIMS: tuple[tuple[str, Verdict, str], ...] = (
    (
        "A target network lands better than none.",
        "holds",
        "target-dqn minus dqn typically 283 [201, 366], above 0 in 100% of pairs; p < 0.001",
    ),
    (
        "A target period around 800 env steps is best.",
        "does not hold",
        "800 at 188, 3000 at 214: difference -26 [-41, -11]; p = 0.003",
    ),
    (
        (
            "Re-saving rewarded transitions speeds learning up, and is level with the target "
            "network alone late in training."
        ),
        "undecided",
        (
            "preferential-dqn minus target-dqn typically 32 [-19, 83]; p = 0.21; 20 more seeds of "
            "each decide it with 80% probability"
        ),
    ),
)
_TITLES = (
    "What each part brings", "Hovering until the time limit", "Size of a layer", "Depth",
    "Target period", "Preferential memory", "Discount", "Decay of ε", "Discount and decay together",
    "Flights like the PID's", "The PID and its tuners",
)  # fmt: skip


def rungs_picture(stem: Path, seed: int = 0, names: tuple[str, ...] = ("dqn", "target")) -> Picture:
    """Learning curves of made-up runs."""
    chance = np.random.default_rng(seed)
    at = list(np.linspace(0, 120_000, 21))
    curves = {
        name: [
            (at, list(-180 + 400 * (1 - np.exp(-np.arange(21) / (3 + 2 * place))) + noise))
            for noise in chance.normal(0, 25, (5, 21))
        ]
        for place, name in enumerate(names)
    }
    figure = style.new_figure(7.2, 3.6)
    rungs.draw_rungs(figure.subplots(), curves)
    return _saved(figure, stem, "Validation return during training, one line per level")


def axis_picture(stem: Path) -> Picture:
    """Levels on an axis."""
    chance = np.random.default_rng(3)
    points = [
        Point(at, mean + chance.normal(0, 20, 5))
        for at, mean in ((1, 40.0), (100, 150.0), (800, 210.0), (3000, 205.0), (10000, 120.0))
    ]
    figure = style.new_figure(7.2, 3.6)
    ax = figures.draw_over_axis(figure.subplots(), {"": points}, "target period, env steps", 800)
    figures.finish(ax, "test return", [point.values for point in points], "y")
    return _saved(figure, stem, "Test return of each target period")


def rows_picture(stem: Path) -> Picture:
    """Levels in a list."""
    chance = np.random.default_rng(4)
    rows = [
        Row(name, chance.normal(mean, 25, 5), name == "target-dqn")
        for name, mean in (("dqn", -110), ("target-dqn", 171), ("preferential-dqn", 203))
    ]
    figure = style.new_figure(7.2, 2.6)
    lines = {"PID": 232.0, "random": -180.0}
    ax = figures.draw_rows(figure.subplots(), rows, lines)
    groups = [row.values for row in rows]
    figures.finish(ax, "test return", groups, "x", others=tuple(lines.values()))
    return _saved(figure, stem, "Test return of each part")


def map_picture(stem: Path) -> Picture:
    """Two factors: a picture with pixels."""
    chance = np.random.default_rng(5)
    figure = style.new_figure(5.4, 3.8)
    figures.draw_map(
        figure.subplots(),
        ("decay of ε", ("0.9", "0.975", "0.999")),
        ("discount γ", ("0.9", "0.99")),
        {
            (up, across): mean + chance.normal(0, 25, 3)
            for up, means in enumerate(((-20.0, 35.0, 60.0), (140.0, 214.0, 231.0)))
            for across, mean in enumerate(means)
        },
    )
    return _saved(figure, stem, "Test return of each pair of discount and decay")


def film(path: Path, frames: int = 3) -> Film:
    """A square that changes its colour."""
    pictures = [Image.new("RGB", (60, 40), (80 * place, 40, 200)) for place in range(frames)]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=100, loop=0)
    return Film(path, "target-dqn, seed 3: landed after 235 steps", "target-dqn, seed 3: landed.")


def page(folder: Path, gif: Path | None = None, runs: int = 60) -> Page:
    """The whole page, its pictures in `folder`.

    Args:
        folder: for the pictures.
        gif: a film for all sections; None makes a small one.
        runs: rows of the long tables.
    """
    moving = film(folder / "film.gif")
    if gif is not None:
        moving = Film(gif, moving.alt, moving.caption)
    names = ("dqn", "target-dqn", "preferential-dqn", "paper-best")
    pictures = (
        (rows_picture(folder / "rows"), rungs_picture(folder / "rungs", 0, names)),
        (rungs_picture(folder / "hover", 1, names[:2]),),
        (axis_picture(folder / "axis"),),
        (map_picture(folder / "map"),),
    )
    return Page(
        title="The paper, re-measured",
        lead="Every experiment of the paper over several training seeds, with a verdict on each of "
        "its claims by a statistical test that was specified before the runs.",
        facts=(
            ("studies", "10"),
            ("training runs", "214"),
            ("observations", "25.7 million"),
            ("hours of training", "3.4"),
            ("scale", "quick"),
        ),
        sections=tuple(
            Section(
                id=f"topic-{place}",
                title=title,
                lead="Does each part that the paper adds improve the return?",
                claims=tuple(
                    ClaimRow(sentence, f"8.{place}", verdict, evidence)
                    for sentence, verdict, evidence in _CLAIMS[: 1 + place % 3]
                ),
                pictures=pictures[place % 4],
                films=(moving,) if place != 3 else (),
                tables=(_levels(), _runs(runs)),
            )
            for place, title in enumerate((*_TITLES, f"{LONG} {HOSTILE}"))
        ),
        provenance=(
            ("made by", "touchdown study report --scale quick"),
            ("machine", "AMD EPYC 7B13, Python 3.11.7"),
            ("versions", "touchdown 0.1.0, gymnasium 1.4.0, jax 0.10.2, numpy 2.4.0, scipy 1.17.0"),
            ("base settings", ", ".join(f"study-{i} 0a1b2c3d4e5f{i:04d}" for i in range(10))),
            ("name", HOSTILE),
        ),
    )


def _levels() -> Table:
    rows = (
        ("dqn (base)", "5", "-118 [-164, -71]", "-112 [-170, -54]", "-181 to -44", "-151", "–", ""),
        ("target-dqn", "5", "174 [121, 219]", "171 [108, 223]", "92 to 240", "149", "+283", "98%"),
        (HOSTILE, "5", "203 [170, 231]", "203 [168, 233]", "150 to 251", "188", "+315", "99%"),
    )  # fmt: skip
    return Table(
        "Chosen checkpoint on the test starts, by level; against the base: difference of means "
        "and probability of improvement.",
        ("level", "n", "IQM [95%]", "mean [95%]", "band of seeds", "last weights", "against base",
         "P(better)"),
        rows,
    )  # fmt: skip


def _runs(count: int) -> Table:
    chance = np.random.default_rng(0)
    rows: list[tuple[TableCell, ...]] = []
    for place in range(count):
        digest = f"{place:04x}b2c3d4e5"
        value = float(chance.normal(150, 60))
        rows.append(
            (
                LONG if place == 1 else ("dqn", "target-dqn")[place % 2],
                str(place // 2),
                Link(digest, f"../runs/{digest}/curve.png"),
                f"{value:.1f}",
                f"{value - 20:.1f}",
                f"{chance.uniform():.0%}",
                f"{120_000 + place:,}",
                "never" if place % 5 == 0 else f"{60_000 + 997 * place:,}",
                f"{40 + place}",
            )
        )
    return Table(
        f"The {count} runs of this study.",
        ("level", "seed", "run", "test return", "last weights", "landed", "observations", "to 200",
         "seconds"),
        tuple(rows),
        folded=True,
    )  # fmt: skip


def _saved(figure: style.Figure, stem: Path, alt: str) -> Picture:
    svg, png = stem.with_suffix(".svg"), stem.with_suffix(".png")
    style.save(figure, png, svg)
    return Picture(svg, png, alt, f"{alt}; mean with its 95% interval over n = 5 training seeds.")
