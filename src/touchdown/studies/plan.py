"""A study: a base config, one or two factors with their levels, and seeds; and its runs."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from touchdown.config import presets, toml
from touchdown.config.checks import is_plain_name
from touchdown.config.config import Config
from touchdown.core.errors import UserError, one_line
from touchdown.studies.metrics import METRICS, TEST_METRICS

FORMAT_VERSION = 1
FIRST_TUNING_SEED = 10_000
"""Training seeds from here on are for choosing settings; no result is reported on them."""
_MOST_RUNS = 100_000
_STUDY_FIELDS = (
    "format_version",
    "name",
    "title",
    "question",
    "base",
    "base_level",
    "seeds",
    "first_seed",
    "metric",
    "config",
    "factor",
)
_FACTOR_FIELDS = ("name", "field", "values", "level")

Changes = Mapping[str, Any]
"""Changes to a config: a section's as a mapping, a field's as a value; `preset` starts from another
preset."""


@dataclass(frozen=True, slots=True)
class Level:
    """One value of a factor."""

    label: str
    changes: Changes
    position: float | None = None
    """Its place on the factor's axis; None where values are words."""
    series: str = ""
    """The line of a figure that it belongs to, where a factor has several."""


@dataclass(frozen=True, slots=True)
class Factor:
    """What is varied."""

    name: str
    levels: tuple[Level, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """One level of each factor, with the settings that follow; the seed is still open."""

    labels: tuple[str, ...]
    config: Config

    @property
    def name(self) -> str:
        """As it stands in tables."""
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
        """What the run is known by: studies that plan the same run share it."""
        return self.config.digest


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """What is varied, from which base, and over how many seeds.

    Raises:
        UserError: a factor without levels, two levels of one name, more than two factors, a level
            whose changes the config refuses, or a metric that is unknown or needs a test.
    """

    name: str
    factors: tuple[Factor, ...]
    seeds: int
    base: str = "paper-best"
    """The preset that all cells start from, unless a level names another."""
    changes: Changes = field(default_factory=dict[str, Any])
    """Changes of all cells; a level's own changes are made after them."""
    base_level: str = ""
    """What the others are compared with: a level of the first factor, or a whole cell's name; the
    first cell if empty."""
    first_seed: int = 0
    """The least training seed. A search for settings takes `FIRST_TUNING_SEED` or above."""
    metric: str = "best_return"
    """What its report shows and compares, one of `METRICS`. A study without a test
    (`test_episodes = 0`) has no return on test starts: it takes `validation_return`."""
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
                raise UserError(f"factor {factor.name!r}: has {twice!r} twice")
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
        """The labels of a factor's levels, in their order."""
        return [level.label for level in self.factors[factor].levels]

    def cells(self) -> list[Cell]:
        """Every combination of levels, the last factor's fastest."""
        return [
            Cell(tuple(level.label for level in levels), self._config_of(levels))
            for levels in itertools.product(*(factor.levels for factor in self.factors))
        ]

    def runs(self, seeds: int | None = None) -> list[PlannedRun]:
        """All runs, seed by seed: a study that is stopped early has a few seeds of every cell.

        Args:
            seeds: how many, if not the study's own number.
        """
        count = self.seeds if seeds is None else seeds
        seeds_in_order = range(self.first_seed, self.first_seed + count)
        return [PlannedRun(cell, seed) for seed in seeds_in_order for cell in self.cells()]

    def base_cell(self) -> Cell:
        """The cell that the others are compared with."""
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
    """Refuse a number of seeds that cannot be run.

    Args:
        seeds: how many.
        first_seed: the least of them.

    Raises:
        UserError: there are none, or they begin below `FIRST_TUNING_SEED` and reach it.
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


def from_toml(path: Path) -> Study:
    """The study in a TOML file.

    Raises:
        UserError: an unreadable file, an unknown field, an empty factor, a value that the config
            refuses, another format version.
    """
    values = toml.read_toml(path)
    _refuse_unknown(values, _STUDY_FIELDS, str(path))
    version = values.get("format_version", FORMAT_VERSION)
    if version != FORMAT_VERSION:
        raise UserError(
            f"{path}: format_version = {version!r}: this touchdown reads {FORMAT_VERSION}"
        )
    tables: list[Any] = _typed(values, "factor", list, "tables [[factor]]", path) or []
    try:
        return Study(
            name=_typed(values, "name", str, "a string", path) or path.stem,
            title=_typed(values, "title", str, "a string", path) or "",
            question=_typed(values, "question", str, "a string", path) or "",
            base=_typed(values, "base", str, "a preset's name", path) or "paper-best",
            base_level=_typed(values, "base_level", str, "a level's label", path) or "",
            seeds=_typed(values, "seeds", int, "a whole number", path) or 5,
            first_seed=_typed(values, "first_seed", int, "a whole number", path) or 0,
            metric=_typed(values, "metric", str, "a metric's name", path) or "best_return",
            changes=_typed(values, "config", dict, "a table [config]", path) or {},
            factors=tuple(_factor_from(table, path) for table in tables),
        )
    except UserError as error:
        said = one_line(error)
        raise UserError(said if said.startswith(str(path)) else f"{path}: {said}") from None


def _factor_from(table: Any, path: Path) -> Factor:
    if not isinstance(table, dict):
        raise UserError(f"{path}: factor = {table!r}: must be a table [[factor]]")
    values = cast(dict[str, Any], table)
    where = f"{path} [[factor]]"
    _refuse_unknown(values, _FACTOR_FIELDS, where)
    field_name = _typed(values, "field", str, "a field such as 'learning.gamma'", path)
    name = _typed(values, "name", str, "a string", path) or field_name
    if field_name:
        given: list[Any] = _typed(values, "values", list, "a list of values", path) or []
        return Factor(name or field_name, levels_of(field_name, given))
    levels: list[Any] = _typed(values, "level", list, "tables [[factor.level]]", path) or []
    if not name:
        raise UserError(f"{where}: must have a field, or a name and [[factor.level]]")
    return Factor(name, tuple(_level_from(level, where) for level in levels))


def _level_from(table: Any, where: str) -> Level:
    values = cast(dict[str, Any], table) if isinstance(table, dict) else {}
    if not isinstance(values.get("label"), str):
        raise UserError(f"{where}: level = {table!r}: must be a table with a label")
    changes = {name: value for name, value in values.items() if name != "label"}
    return Level(values["label"], changes)


def _typed(values: Changes, name: str, kind: type[Any], wanted: str, path: Path) -> Any:
    value = values.get(name)
    if value is not None and (not isinstance(value, kind) or isinstance(value, bool)):
        raise UserError(f"{path}: {name} = {value!r}: must be {wanted}")
    return value


def _refuse_unknown(values: Changes, known: Sequence[str], where: str) -> None:
    for name in values:
        if name not in known:
            raise UserError(f"{where}: unknown field {name!r}; known: {', '.join(known)}")


def _label(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "-".join(map(str, cast(Sequence[Any], value)))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _position(value: Any) -> float | None:
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if numeric else None
