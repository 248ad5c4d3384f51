"""A study: a base config, factors with levels, seeds and claims; and its runs."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

from touchdown.config import presets, toml
from touchdown.config.checks import is_plain_name
from touchdown.config.config import Config
from touchdown.config.digest import digest_with_seed
from touchdown.core.complaints import complaint
from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.stats import spending
from touchdown.studies.changes import Changes, nested
from touchdown.studies.claims import Claim
from touchdown.studies.metrics import (
    DEFAULT_METRIC,
    METRICS,
    TEST_METRICS,
    TIMES,
    more_is_better,
)

FIRST_TUNING_SEED = 10_000
"""Training seeds from this one on are for choosing settings; no results are reported on them."""
SENSITIVITY_FACTORS = 3
"""Factors of a study on sensitivity: algorithms, environments, settings."""
BETWEEN_LABELS = " · "
"""Separates the labels in the name of a cell of several factors."""


@dataclass(frozen=True, slots=True)
class Level:
    """One value of a factor.

    Example:
        ```python
        Level("soft", {"learning.target_period": 0, "learning.polyak": 0.005})
        ```

    Raises:
        UserError: the label is empty or has several lines, or a field is changed twice.
    """

    label: str
    changes: Changes = field(default_factory=dict[str, Any])
    """Changes to the base config; stored as nested tables, as in a TOML file."""
    position: float | None = None
    """Its position on the factor's axis; None if levels are not numbers."""
    series: str = ""
    """Its line in a figure, if a factor has several lines."""

    def __post_init__(self) -> None:
        _check_types(self, label=str, position=float | None, series=str)
        if len(self.label.splitlines()) != 1:
            raise UserError(f"label = {self.label!r}: must be text on one line")
        _check_is(self.changes, Mapping, "changes", "a dictionary of settings")
        object.__setattr__(self, "changes", nested(self.changes))


@dataclass(frozen=True, slots=True)
class Factor:
    """What a study varies, and its levels.

    Example:
        ```python
        Factor("target", [Level("copied"), Level("soft", {"learning.polyak": 0.005})])
        Factor.of("learning.gamma", [0.9, 0.99])
        ```

    Raises:
        UserError: there are no levels, or two have the same label.
    """

    name: str
    levels: Sequence[Level]

    def __post_init__(self) -> None:
        _check_types(self, name=str)
        object.__setattr__(self, "levels", _all_are(self.levels, Level, "levels"))
        if not self.levels:
            raise UserError(f"factor {self.name!r}: has no levels, must have at least 1")
        twice = _first_twice([level.label for level in self.levels])
        if twice is not None:
            raise UserError(f"factor {self.name!r}: has {twice!r} twice")

    @classmethod
    def of(cls, field: str, values: Sequence[Any], name: str = "") -> "Factor":
        """A factor with a level for each value of one field; a value's text is its label.

        Args:
            field: the field's dotted name, such as `learning.gamma`, or `preset`.
            values: the field's values, in order.
            name: the factor's name; if empty, the field's name.

        Raises:
            UserError: there are no values, or two have the same text.
        """
        return cls(name or field, levels_of(field, values))


@dataclass(frozen=True, slots=True)
class Cell:
    """A combination of one level of each factor, with the resulting settings except the seed."""

    labels: tuple[str, ...]
    config: Config

    @property
    def name(self) -> str:
        """Its name in tables."""
        return BETWEEN_LABELS.join(self.labels)


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
        return digest_with_seed(self.cell.config, self.seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """A base config, the factors that are varied, training seeds, and claims.

    A study file contains the same as TOML.

    Example:
        ```python
        study = Study(
            name="horizon",
            base="cartpole",
            factors=[Factor.of("learning.gamma", [0.9, 0.99])],
            seeds=5,
            claims=[Claim("A longer horizon is better.", Greater("0.99", "0.9", margin=20))],
        )
        touchdown.run_study(study)
        ```

    Raises:
        UserError: a field of the wrong type, more than three factors, two cells of one name, a
            level whose changes the config refuses, a metric that is unknown or needs a test, or a
            claim about a level or a metric that the study does not have.
    """

    name: str
    """Letters, digits, `.`, `_` and `-`: its page and its tables get this name."""
    factors: Sequence[Factor]
    """From one to three. Three are algorithms, environments and settings, and the report shows how
    much each algorithm depends on settings for each environment."""
    seeds: int = 5
    """Training seeds of each cell."""
    base: str | Config = "paper-best"
    """Base of all cells unless a level names another preset: a preset's name, or a config, whose
    seed is ignored."""
    changes: Changes = field(default_factory=dict[str, Any])
    """Changes to all cells, applied before those of a level."""
    base_level: str = ""
    """The baseline: a level of the first factor, or the full name of a cell; if empty, the first
    cell."""
    looks: Sequence[int] = ()
    """Numbers of training seeds at which claims are tested, increasing; `study run --until-decided`
    runs from one to the next. Without any, claims are tested once, with all seeds."""
    spending: str = spending.OBRIEN_FLEMING
    """How the looks share the 5%, one of `stats.spending.SHAPES`: `obrien-fleming` keeps most of it
    for the last look, `pocock` gives the first looks more."""
    first_seed: int = 0
    """The smallest training seed. A search for settings uses `FIRST_TUNING_SEED` or above."""
    metric: str = DEFAULT_METRIC
    """The metric that its report shows and compares, one of `METRICS`. A study without a test
    (`test_episodes = 0`) has no return on test starts and needs `validation_return`."""
    title: str = ""
    """Title of its page; if empty, the study's name."""
    question: str = ""
    """The first sentence of its page."""
    claims: Sequence[Claim] = ()
    """What is claimed, before the numbers are known; each gets a verdict."""
    from_file: bool = field(default=False, repr=False, compare=False)
    """Whether it was read from a file. Code that it names is then not imported without trust."""

    def __post_init__(self) -> None:
        _check_types(self, name=str, seeds=int, base_level=str, first_seed=int, metric=str)
        _check_types(self, title=str, question=str, spending=str)
        _check_is(self.base, str | Config, "base", "a preset's name or a Config")
        _check_is(self.changes, Mapping, "changes", "a dictionary of settings")
        object.__setattr__(self, "factors", _all_are(self.factors, Factor, "factors"))
        object.__setattr__(self, "claims", _all_are(self.claims, Claim, "claims"))
        object.__setattr__(self, "looks", _all_are(self.looks, int, "looks"))
        object.__setattr__(self, "changes", nested(self.changes))
        if not is_plain_name(self.name):
            raise UserError(f"name = {self.name!r}: must be letters, digits, '.', '_' and '-'")
        check_seeds(self.seeds, self.first_seed)
        self._check_looks()
        if not 1 <= len(self.factors) <= SENSITIVITY_FACTORS:
            raise UserError(
                f"study {self.name!r}: has {len(self.factors)} factors, must be from 1 to "
                f"{SENSITIVITY_FACTORS}"
            )
        if len(self.factors) == SENSITIVITY_FACTORS and not more_is_better(self.metric):
            raise UserError(
                f"metric = {self.metric!r}: must be a return or a share of solved episodes with "
                f"{SENSITIVITY_FACTORS} factors, as the best settings have the most of it"
            )
        cells = self.cells()
        cell_names = [cell.name for cell in cells]
        twice = _first_twice(cell_names)
        if twice is not None:
            raise UserError(f"study {self.name!r}: two cells are called {twice!r}")
        is_tested = all(cell.config.training.test_episodes for cell in cells)
        _check_metric(self.metric, METRICS, is_tested=is_tested)
        names = list(dict.fromkeys((*self.labels(0), *cell_names)))
        if self.base_level and self.base_level not in names:
            raise UserError(f"base_level = {self.base_level!r}: {hint(self.base_level, names)}")
        for claim in self.claims:
            try:
                _check_claim(claim, cell_names, is_tested=is_tested)
            except UserError as error:
                raise UserError(f"claim {claim.sentence!r}: {error}") from None

    def _check_looks(self) -> None:
        """Refuse looks that cannot be kept.

        Raises:
            UserError: they do not increase, are too large, or the first has too few seeds; or the
                shape of their spending is unknown.
        """
        if self.spending not in spending.SHAPES:
            raise UserError(f"spending = {self.spending!r}: {hint(self.spending, spending.SHAPES)}")
        if not self.looks:
            return
        text = list(self.looks)
        if any(b <= a for a, b in itertools.pairwise(self.looks)):
            raise UserError(f"looks = {text}: must increase")
        check_seeds(self.looks[-1], self.first_seed)
        fewest = max((claim.test.fewest_seeds for claim in self.claims), default=1)
        if self.looks[0] < fewest:
            raise UserError(f"looks = {text}: must begin with at least {fewest}, for its claims")

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
            seeds: number of seeds; None uses the study's number.
        """
        count = self.seeds if seeds is None else seeds
        seeds_in_order = range(self.first_seed, self.first_seed + count)
        cells = self.cells()
        return [PlannedRun(cell, seed) for seed in seeds_in_order for cell in cells]

    def base_cell(self) -> Cell:
        """The baseline cell."""
        wanted = self.base_level or self.labels(0)[0]
        return next(cell for cell in self.cells() if wanted in (cell.name, cell.labels[0]))

    def _config_of(self, levels: Sequence[Level]) -> Config:
        where = f"study {self.name!r}, {' · '.join(level.label for level in levels)}"
        started = [level.changes["preset"] for level in levels if "preset" in level.changes]
        base = str(started[-1]) if started else self.base
        config = presets.preset(base) if isinstance(base, str) else base
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


def levels_of(field_name: str, values: Sequence[Any]) -> tuple[Level, ...]:
    """A level for each value of one field."""
    return tuple(Level(_label(value), {field_name: value}, _position(value)) for value in values)


def _label(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "-".join(map(str, cast(Sequence[Any], value)))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _position(value: Any) -> float | None:
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if numeric else None


def _check_types(instance: object, **kinds: Any) -> None:
    """Refuse fields of the wrong type.

    Raises:
        UserError: a field has the wrong type; the message names it.
    """
    for name, kind in kinds.items():
        said = complaint(getattr(instance, name), kind, name)
        if said:
            raise UserError(said)


def _check_is(value: object, kind: Any, name: str, wanted: str) -> None:
    if not isinstance(value, kind):
        raise UserError(f"{name} = {value!r}: must be {wanted}")


def _all_are(values: object, kind: type[Any], name: str) -> tuple[Any, ...]:
    """A sequence as a tuple; the types of its entries are checked."""
    entries = tuple(cast(Sequence[object], values)) if isinstance(values, list | tuple) else None
    if entries is None or not all(isinstance(entry, kind) for entry in entries):
        raise UserError(f"{name} = {values!r}: must be a list of {kind.__name__}")
    return entries


def _first_twice(names: Sequence[str]) -> str | None:
    return next((name for i, name in enumerate(names) if name in names[:i]), None)


def _check_metric(metric: str, known: Collection[str], *, is_tested: bool) -> None:
    if metric not in known:
        raise UserError(f"metric = {metric!r}: {hint(metric, known)}")
    if metric in TEST_METRICS and not is_tested:
        raise UserError(
            f"metric = {metric!r}: needs a test, and test_episodes is 0; choose validation_return"
        )


def _check_claim(claim: Claim, cells: Sequence[str], *, is_tested: bool) -> None:
    if claim.metric:
        _check_metric(claim.metric, (*METRICS, *TIMES), is_tested=is_tested)
    unknown = next((name for name in claim.test.cells if name not in cells), None)
    if unknown is not None:
        raise UserError(f"level {unknown!r}: unknown; {hint(unknown, cells)}")
