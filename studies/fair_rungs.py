"""Tune the rungs from `online-q` on with the same budget, and write the study that compares them.

    python studies/fair_rungs.py tune          # searches; the same command goes on where it stopped
    python studies/fair_rungs.py write         # studies/fair-rungs.toml, from studies/tuned/
    touchdown study run studies/fair-rungs.toml
    touchdown study report studies/fair-rungs.toml
    python studies/fair_rungs.py show          # the table and pictures of the ladder's pages

`studies/spaces` has what is searched, by rung. The tuning seeds are not those of the study.
"""

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from touchdown.api import studies
from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.config.ladder import BUILDS_ON
from touchdown.config.presets import preset
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.core.types import FloatArray
from touchdown.figures import rungs as figures
from touchdown.figures import style
from touchdown.lander import rules
from touchdown.report.tables import interval_text
from touchdown.stats.compare import compare, holm
from touchdown.stats.location import median_interval
from touchdown.studies import study_file
from touchdown.studies.changes import nested
from touchdown.studies.findings import p_text
from touchdown.studies.plan import Factor, Level, Study
from touchdown.studies.results import StudyResults, read_study
from touchdown.studies.space import read_space
from touchdown.studies.store import DEFAULT_RESULTS, open_store

HERE = Path(__file__).parent
PICTURES = HERE.parent / "docs" / "pictures" / "ladder"
SPACES, TUNED, STUDY = HERE / "spaces", HERE / "tuned", HERE / "fair-rungs.toml"
TRIALS, TUNING_SEEDS, ENV_STEPS = 16, 2, 180_000
SEEDS, FIRST_SEED = 10, 10
BASE = "vector-dqn"


def rungs() -> list[str]:
    """The rungs with a space, sorted by name, with the base first."""
    names = (path.stem for path in SPACES.glob("*.toml"))
    return sorted(names, key=lambda name: (name != BASE, name))


def tuned_name(rung: str) -> str:
    """The level of a rung with the settings that were found."""
    return f"{rung}, tuned"


def tune(results_dir: Path) -> None:
    """Search the settings of each rung."""
    TUNED.mkdir(exist_ok=True)
    for rung in rungs():
        out = TUNED / f"{rung}.toml"
        if out.is_file():
            continue
        found = studies.tune_agent(
            rung,
            trials=TRIALS,
            seeds=TUNING_SEEDS,
            env_steps=ENV_STEPS,
            space=SPACES / f"{rung}.toml",
            out=out,
            results_dir=results_dir,
            progress=True,
        )
        print(f"{rung}: {found}", flush=True)


def tuned_changes(rung: str) -> dict[str, Any]:
    """The searched settings of a rung, with the values that were found."""
    _, space = read_space(SPACES / f"{rung}.toml", preset(rung))
    path = TUNED / f"{rung}.toml"
    found = flat(toml.from_values(toml.read_toml(path), Config(), path))
    changes: dict[str, Any] = {}
    for name in space:
        for section, fields in nested({name: found[name]}).items():
            changes.setdefault(section, {}).update(fields)
    return changes


def study() -> Study:
    """Each rung, untuned and tuned."""
    levels = [
        level
        for rung in rungs()
        for level in (
            Level(rung, {"preset": rung}),
            Level(tuned_name(rung), {"preset": rung, **tuned_changes(rung)}),
        )
    ]
    return Study(
        name="fair-rungs",
        title="Every rung, untuned and tuned",
        question=(
            f"How much does each rung return in {ENV_STEPS:,} environment steps, after the same "
            f"search of {TRIALS} trials?"
        ),
        base=BASE,
        base_level=BASE,
        seeds=SEEDS,
        first_seed=FIRST_SEED,
        changes={
            "learning": {"backend": "fused"},
            "training": {
                "episodes": 1_000_000,
                "max_env_steps": ENV_STEPS,
                "validation_period": 5_000,
                "candidate_checkpoints": 8,
            },
        },
        factors=[Factor("rung", levels)],
    )


def show(results_dir: Path) -> None:
    """Print the table of the rungs as Markdown, and draw each beside the rung that it builds on."""
    study = study_file.from_toml(STUDY)
    results = read_study(study, study.seeds, open_store(results_dir))
    columns = ("rung", "n", "untuned: median [95%]", "≥ 200", "tuned: median [95%]", "≥ 200")
    print("|", " | ".join((*columns, "gain [95%]", "p")), "|")
    print("| --- |" + " ---: |" * 7)
    returns = {
        rung: [results.values((each,)) for each in (rung, tuned_name(rung))] for rung in rungs()
    }
    known = {rung: each for rung, each in returns.items() if min(map(len, each)) > 1}
    compared = [compare(*each) for each in known.values()]
    corrected = holm([found.p_value for found in compared])
    for (rung, each), found, p in zip(known.items(), compared, corrected, strict=True):
        count = " and ".join(map(str, dict.fromkeys(map(len, each))))
        print(
            f"| [`{rung}`]({page_of(rung)}) | {count} | {' | '.join(map(cells_of, each))} "
            f"| {interval_text(found.difference)} | {p_text(p)} |"
        )
    for rung in rungs():
        save_picture(results, rung)


def page_of(rung: str) -> str:
    """The page of a rung, beside the table."""
    return f"{rung.removesuffix('-lite')}.md"


def cells_of(returns: FloatArray) -> str:
    """The median of the seeds with its interval, and how many of them solve the lander."""
    return f"{interval_text(median_interval(returns))} | {np.sum(returns >= rules.SOLVED_RETURN)}"


def save_picture(results: StudyResults, rung: str) -> None:
    """The rung untuned and tuned over training, with the rung that it builds on."""
    base = BUILDS_ON.get(rung, BASE)
    names = [*dict.fromkeys((base if base in rungs() else BASE, rung)), tuned_name(rung)]
    curves: Mapping[str, Any] = {
        name: [run.validations for run in results.of((name,))] for name in names
    }
    known = {name: of for name, of in curves.items() if of}
    if not known:
        return
    figure = style.new_figure(7.2, 3.8)
    figures.draw_rungs(figure.subplots(), known)
    style.save(figure, PICTURES / f"{rung}.png")


def main() -> None:
    """Tune, write the study, or show its results."""
    parser = argparse.ArgumentParser(description="Tune every rung with the same budget.")
    parser.add_argument("what", choices=("tune", "write", "show"))
    parser.add_argument(
        "--results-dir", type=Path, default=DEFAULT_RESULTS, help="folder that holds the runs"
    )
    args = parser.parse_args()
    try:
        if args.what == "tune":
            tune(args.results_dir)
        elif args.what == "show":
            show(args.results_dir)
        else:
            head = "# Written by `python studies/fair_rungs.py write`.\n"
            files.write_atomic(STUDY, head + study_file.to_toml(study()))
            print(STUDY)
    except UserError as error:
        print(f"fair_rungs.py: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
