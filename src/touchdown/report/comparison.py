"""Compares finished runs on one page, grouped by settings; seeds of one setting form a level."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.report.builder import Builder
from touchdown.report.output import PAGE
from touchdown.report.page import Page, Section, Table, write_page
from touchdown.report.provenance import machine_facts
from touchdown.runs.run import Run
from touchdown.studies.plan import Factor, Level, Study
from touchdown.studies.results import StudyResults
from touchdown.studies.run_result import read_run

_SHOWN = 4  # differing settings in a level's name

_NONE = "–"  # a setting that a run does not have


def write_comparison(
    runs: Sequence[Run], out: Path, on_step: Callable[[str], object] = lambda _: None
) -> Path:
    """Write the page into a folder.

    Args:
        runs: finished runs, at least one; the settings of the first are the baseline.
        out: folder for the page and its pictures.
        on_step: called after each of the `STEPS` of the page's section.

    Returns:
        The page.

    Raises:
        UserError: a run is not finished, its files are broken, or something cannot be written.
    """
    if not runs:
        raise UserError("runs: must be at least one run")
    for run in runs:
        if run.evaluation is None:
            raise UserError(
                f"run {run.name!r}: has no test episodes; must be finished and have test_episodes"
            )
    groups: dict[str, list[Run]] = {}
    for run in {run.path.resolve(): run for run in runs}.values():
        groups.setdefault(dataclasses.replace(run.config, seed=0).digest, []).append(run)
    labels = _labels([of[0] for of in groups.values()])
    levels = tuple(
        Level(label, _settings_of(of[0].config))
        for label, of in zip(labels, groups.values(), strict=True)
    )
    study = Study(
        name="comparison",
        title="Runs compared",
        factors=(Factor("settings", levels),),
        seeds=max(len(of) for of in groups.values()),
    )
    found = tuple(
        read_run(run.path, (label,), run.config.seed)
        for label, of in zip(labels, groups.values(), strict=True)
        for run in of
    )
    results = StudyResults(study, study.seeds, found, 0, {})
    with files.complete_folder(out) as folder:
        builder = Builder(folder, beside=out, on_step=on_step)
        section = builder.section("comparison", "Test returns", "", results, "best_return", (), {})
        page = Page(
            title="Runs compared",
            lead=f"{len(found)} runs of {len(groups)} settings.",
            sections=(section, _settings_section(labels, [of[0] for of in groups.values()])),
            provenance=machine_facts(),
        )
        write_page(page, folder / PAGE)
    return out / PAGE


def _settings_of(config: Config) -> dict[str, Any]:
    """All settings without the preset, whose name may be unknown here."""
    return {name: value for name, value in toml.to_dict(config).items() if name != "preset"}


def _differing(runs: Sequence[Run]) -> dict[str, list[Any]]:
    """The settings in which runs differ, by dotted name."""
    settings = [flat(run.config) for run in runs]
    # an agent's options need not be the same for all
    names = dict.fromkeys(name for each in settings for name in each)
    values = {name: [each.get(name, _NONE) for each in settings] for name in names}
    return {
        name: of
        for name, of in values.items()
        if name not in ("seed", "preset") and any(value != of[0] for value in of)
    }


def _labels(runs: Sequence[Run]) -> list[str]:
    """A name for each group: its preset, with the differing settings if presets are equal."""
    presets = [run.config.preset for run in runs]
    if len(set(presets)) == len(presets):
        return presets
    differing = dict(list(_differing(runs).items())[:_SHOWN])
    names = [
        ", ".join(
            [preset, *(f"{name.split('.')[-1]} {values[i]}" for name, values in differing.items())]
        )
        for i, preset in enumerate(presets)
    ]
    return names if len(set(names)) == len(names) else [run.name for run in runs]


def _settings_section(labels: Sequence[str], runs: Sequence[Run]) -> Section:
    differing = _differing(runs)
    rows = tuple((name, *map(str, values)) for name, values in differing.items())
    table = Table("Settings that differ between the runs.", ("setting", *labels), rows)
    return Section(id="settings", title="Settings", tables=(table,) if rows else ())
