"""Tune the rungs from `online-q` on with the same budget, and write the study that compares them.

    python studies/fair_rungs.py tune          # searches; the same command goes on where it stopped
    python studies/fair_rungs.py write         # studies/fair-rungs.toml, from studies/tuned/
    touchdown study run studies/fair-rungs.toml
    touchdown study report studies/fair-rungs.toml

`studies/spaces` has what is searched, by rung. The tuning seeds are not those of the study.
"""

import argparse
from pathlib import Path
from typing import Any

from touchdown.api import studies
from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.config.presets import preset
from touchdown.core import files
from touchdown.studies import study_file
from touchdown.studies.changes import nested
from touchdown.studies.plan import Factor, Level, Study
from touchdown.studies.space import read_space

HERE = Path(__file__).parent
SPACES, TUNED, STUDY = HERE / "spaces", HERE / "tuned", HERE / "fair-rungs.toml"
TRIALS, TUNING_SEEDS, ENV_STEPS = 24, 2, 180_000
SEEDS, FIRST_SEED = 10, 10


def rungs() -> list[str]:
    """The rungs with a space, sorted by name, with the base first."""
    return sorted((path.stem for path in SPACES.glob("*.toml")), key=lambda of: of != "vector-dqn")


def tune() -> None:
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
            Level(f"{rung}, tuned", {"preset": rung, **tuned_changes(rung)}),
        )
    ]
    return Study(
        name="fair-rungs",
        title="Every rung, untuned and tuned",
        question=(
            f"How much does each rung return in {ENV_STEPS:,} environment steps, after the same "
            f"search of {TRIALS} trials?"
        ),
        base="vector-dqn",
        base_level="vector-dqn",
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


def main() -> None:
    """Tune, or write the study."""
    parser = argparse.ArgumentParser(description="Tune every rung with the same budget.")
    parser.add_argument("what", choices=("tune", "write"))
    if parser.parse_args().what == "tune":
        tune()
        return
    head = "# Written by `python studies/fair_rungs.py write`.\n"
    files.write_atomic(STUDY, head + study_file.to_toml(study()))
    print(STUDY)


if __name__ == "__main__":
    main()
