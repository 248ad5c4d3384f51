"""A study (a base config, one or two factors with levels, and seeds) and its runs."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, cast

import msgspec
from msgspec import Meta, Struct

from touchdown.config import presets, toml
from touchdown.config.checks import is_plain_name
from touchdown.config.config import Config
from touchdown.core import records
from touchdown.core.errors import UserError, one_line
from touchdown.studies.metrics import METRICS, TEST_METRICS

FORMAT_VERSION = 1
FIRST_TUNING_SEED = 10_000
"""Training seeds from this one on are reserved for tuning; no reported result uses them."""

Changes = Mapping[str, Any]
"""Changes to a config: a mapping for a section, a value for a field; `preset` starts from another
preset."""


@dataclass(frozen=True, slots=True)
class Level:
    """One level of a factor."""

    label: str
    changes: Changes
    position: float | None = None
    """Its position on the factor's axis; None if values are words."""
    series: str = ""
    """Its line in a figure, if a factor has several lines."""


@dataclass(frozen=True, slots=True)
class Factor:
    """A factor: what a study varies."""

    name: str
    levels: tuple[Level, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """A combination of one level of each factor, with the resulting settings except the seed."""

    labels: tuple[str, ...]
    config: Config

    @property
    def name(self) -> str:
        """Name of the cell in tables."""
        return " · ".join(self.labels)


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """One cell with one training seed."""

    cell: Cell
    seed: int

    @property
    def config(self) -> Config:
        """All settings of the run."""
        return replace(self.cell.config, seed=self.seed)

    @property
    def digest(self) -> str:
        """Identifier of the run; studies with the same run share it."""
        return self.config.digest


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A study: its base settings, factors and number of seeds.

    Raises:
        UserError: a factor without levels, duplicate levels, more than two factors, a level with
            invalid settings, or a metric that is unknown or needs a test.
    """

    name: str
    factors: tuple[Factor, ...]
    seeds: int
    base: str = "paper-best"
    """The preset that all cells start from, unless a level names another one."""
    changes: Changes = field(default_factory=dict[str, Any])
    """Changes to all cells, applied before those of a level."""
    base_level: str = ""
    """The baseline: a level of the first factor, or the full name of a cell; if empty, the first
    cell."""
    first_seed: int = 0
    """The smallest training seed. Tuning uses `FIRST_TUNING_SEED` or above."""
    metric: str = "best_return"
    """Metric that its report shows and compares, one of `METRICS`. A study without a test
    (`test_episodes = 0`) has no test return and needs `validation_return`."""
    title: str = ""
    section: str = ""
    question: str = ""

    def __post_init__(self) -> None:
        if not is_plain_name(self.name):
            raise UserError(f"name = {self.name!r}: must be letters, digits, '.', '_' and '-'")
        check_seeds(self.seeds, self.first_seed)
        if self.metric not in METRICS:
            raise UserError(f"metric = {self.metric!r}: must be one of {', '.join(METRICS)}")
        if not 1 <= len(self.factors) <= 2:
            raise UserError(f"study {self.name!r}: has {len(self.factors)} factors, must be 1 or 2")
        for factor in self.factors:
            labels = [level.label for level in factor.levels]
            if not labels:
                raise UserError(f"factor {factor.name!r}: has no levels, must have at least 1")
            twice = next((label for label in labels if labels.count(label) > 1), None)
            if twice is not None:
                raise UserError(f"factor {factor.name!r}: has level {twice!r} twice")
        untested = any(not cell.config.training.test_episodes for cell in self.cells())
        if untested and self.metric in TEST_METRICS:
            raise UserError(
                f"metric = {self.metric!r}: needs a test, and test_episodes is 0; "
                "choose validation_return"
            )
        names = list(dict.fromkeys((*self.labels(0), *(cell.name for cell in self.cells()))))
        if self.base_level and self.base_level not in names:
            raise UserError(f"base_level = {self.base_level!r}: must be one of {', '.join(names)}")

    def labels(self, factor: int) -> list[str]:
        """The labels of a factor's levels, in order."""
        return [level.label for level in self.factors[factor].levels]

    def cells(self) -> list[Cell]:
        """Every combination of levels; the last factor varies fastest."""
        return [
            Cell(tuple(level.label for level in levels), self._config_of(levels))
            for levels in itertools.product(*(factor.levels for factor in self.factors))
        ]

    def runs(self, seeds: int | None = None) -> list[PlannedRun]:
        """All runs, ordered by seed, so that a study stopped early has a few seeds of every cell.

        Args:
            seeds: number of seeds; None uses the study's own number.
        """
        count = self.seeds if seeds is None else seeds
        seeds_in_order = range(self.first_seed, self.first_seed + count)
        return [PlannedRun(cell, seed) for seed in seeds_in_order for cell in self.cells()]

    def base_cell(self) -> Cell:
        """The baseline cell."""
        wanted = self.base_level or self.labels(0)[0]
        return next(cell for cell in self.cells() if wanted in (cell.name, cell.labels[0]))

    def _config_of(self, levels: Sequence[Level]) -> Config:
        where = f"study {self.name!r}, {' · '.join(level.label for level in levels)}"
        started = [level.changes["preset"] for level in levels if "preset" in level.changes]
        config = presets.preset(str(started[-1] if started else self.base))
        for changes in (self.changes, *(level.changes for level in levels)):
            rest = {name: value for name, value in changes.items() if name != "preset"}
            config = toml.replace_fields(config, rest, where)
        return cast(Config, config)


def check_seeds(seeds: int, first_seed: int = 0) -> None:
    """Refuse an invalid number of seeds.

    Args:
        seeds: number of seeds.
        first_seed: smallest seed.

    Raises:
        UserError: the number is 0, or the seeds begin below `FIRST_TUNING_SEED` and reach it.
    """
    if first_seed < 0:
        raise UserError(f"first_seed = {first_seed}: must be at least 0")
    most = FIRST_TUNING_SEED - (first_seed if first_seed < FIRST_TUNING_SEED else 0)
    if not 1 <= seeds <= most:
        raise UserError(f"seeds = {seeds}: must be from 1 to {most}")


def nested(field_name: str, value: Any) -> dict[str, Any]:
    """The change of one field by its dotted name, such as `learning.gamma`."""
    section, _, inner = field_name.rpartition(".")
    return {section: {inner: value}} if section else {inner: value}


def levels_of(field_name: str, values: Sequence[Any]) -> tuple[Level, ...]:
    """A level for each value of one field."""
    return tuple(
        Level(_label(value), nested(field_name, value), _position(value)) for value in values
    )


class _FactorTable(Struct, frozen=True, forbid_unknown_fields=True):
    """`[[factor]]` of a study file."""

    name: str = ""
    field: Annotated[str, Meta(title="a field such as 'learning.gamma'")] = ""
    values: Annotated[list[Any], Meta(title="a list of values")] = msgspec.field(
        default_factory=list[Any]
    )
    level: Annotated[list[dict[str, Any]], Meta(title="tables [[factor.level]]")] = msgspec.field(
        default_factory=list[dict[str, Any]]
    )


class _StudyFile(Struct, frozen=True, forbid_unknown_fields=True):
    """A study file."""

    format_version: Any = FORMAT_VERSION
    name: str = ""
    title: str = ""
    question: str = ""
    base: Annotated[str, Meta(title="a preset's name")] = "paper-best"
    base_level: Annotated[str, Meta(title="a level's label")] = ""
    seeds: int = 5
    first_seed: int = 0
    metric: Annotated[str, Meta(title="a metric's name")] = "best_return"
    config: Annotated[dict[str, Any], Meta(title="a table [config]")] = msgspec.field(
        default_factory=dict[str, Any]
    )
    factor: Annotated[list[_FactorTable], Meta(title="tables [[factor]]")] = msgspec.field(
        default_factory=list[_FactorTable]
    )


def from_toml(path: Path) -> Study:
    """The study in a TOML file.

    Raises:
        UserError: unreadable file, unknown field, empty factor, invalid value, or another format
            version.
    """
    file = records.convert(toml.read_toml(path), _StudyFile, path)
    if file.format_version != FORMAT_VERSION:
        raise UserError(
            f"{path}: format_version = {file.format_version!r}: must be {FORMAT_VERSION} "
            "in this version of touchdown"
        )
    try:
        return Study(
            name=file.name or path.stem,
            title=file.title,
            question=file.question,
            base=file.base,
            base_level=file.base_level,
            seeds=file.seeds,
            first_seed=file.first_seed,
            metric=file.metric,
            changes=file.config,
            factors=tuple(map(_factor_from, file.factor)),
        )
    except UserError as error:
        raise UserError(f"{path}: {one_line(error)}") from None


def _factor_from(table: _FactorTable) -> Factor:
    if table.field:
        return Factor(table.name or table.field, levels_of(table.field, table.values))
    if not table.name:
        raise UserError("[[factor]]: must have a field, or a name and [[factor.level]]")
    return Factor(table.name, tuple(map(_level_from, table.level)))


def _level_from(table: dict[str, Any]) -> Level:
    label = table.get("label")
    if not isinstance(label, str):
        raise UserError(f"[[factor]]: level = {table!r}: must be a table with a label")
    changes = {name: value for name, value in table.items() if name != "label"}
    return Level(label, changes)


def _label(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "-".join(map(str, cast(Sequence[Any], value)))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _position(value: Any) -> float | None:
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if numeric else None
