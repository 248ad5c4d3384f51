"""The settings that a search varies: built-in for the agents of a network, or from a TOML file."""

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from msgspec import Struct

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.config.fields import flat
from touchdown.core import records
from touchdown.core.errors import UserError
from touchdown.studies.changes import nested

if TYPE_CHECKING:
    from optuna.trial import BaseTrial


@dataclass(frozen=True, slots=True)
class Range:
    """A range of numbers."""

    low: float
    high: float
    log: bool = False
    whole: bool = False
    from_one: bool = False
    """The range applies to 1 minus the setting, so that 0.99 to 0.999 is as wide as 0.9 to 0.99."""

    def suggest(self, trial: "BaseTrial", name: str) -> float | int:
        """The value for a trial."""
        if self.whole:
            return trial.suggest_int(name, int(self.low), int(self.high), log=self.log)
        drawn = trial.suggest_float(name, self.low, self.high, log=self.log)
        return 1 - drawn if self.from_one else drawn

    @property
    def ends(self) -> tuple[Any, ...]:
        """The first and the last value of the setting."""
        if self.whole:
            return int(self.low), int(self.high)
        return (1 - self.low, 1 - self.high) if self.from_one else (self.low, self.high)


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few values."""

    values: tuple[Any, ...]

    def suggest(self, trial: "BaseTrial", name: str) -> Any:
        """The value for a trial."""
        if all(isinstance(value, str | int | float) for value in self.values):
            return trial.suggest_categorical(name, self.values)
        # Optuna's categories are plain values, so a list is chosen by its text
        by_text = {str(value): value for value in self.values}
        return by_text[trial.suggest_categorical(name, tuple(by_text))]

    @property
    def ends(self) -> tuple[Any, ...]:
        """All values of the setting."""
        return self.values


Space = Mapping[str, Range | Choice]
"""What is searched, by the setting's dotted name."""


class _RangeTable(Struct, frozen=True, forbid_unknown_fields=True):
    """A range in a file."""

    low: float
    high: float
    log: bool = False
    from_one: bool = False


def space_of(config: Config) -> Space:
    """The built-in space: the settings that an algorithm depends on most.

    Raises:
        UserError: the algorithm has none.
    """
    found: dict[str, Range | Choice] = {
        "learning.learning_rate": Range(1e-4, 2e-3, log=True),
        "learning.gamma": Range(1e-3, 0.1, log=True, from_one=True),
        "learning.reward_scale": Choice((0.01, 0.03, 0.1, 0.3)),
    }
    if config.exploration.schedule != "constant":
        found["exploration.epsilon_end"] = Range(0.003, 0.1, log=True)
    if config.exploration.schedule == "exponential":
        found["exploration.epsilon_decay"] = Range(3e-3, 0.1, log=True, from_one=True)
    if config.algorithm == "pqn":
        return found | {
            "rollout.trace_decay": Range(0.5, 0.98),
            "rollout.epochs": Range(1, 6, whole=True),
            "rollout.minibatches": Choice((4, 8, 16, 32)),
        }
    if config.algorithm != "dqn":
        raise UserError(
            f"algorithm = {config.algorithm!r}: must be dqn or pqn for the built-in space; choose "
            "your own with --space"
        )
    found["learning.batch_size"] = Choice((32, 64, 128))
    if config.learning.target_period:
        found["learning.target_period"] = Range(50, 5_000, log=True, whole=True)
    if config.replay.resaves:
        found["replay.resaves"] = Range(1, 20, whole=True)
    return found


def read_space(path: Path, base: Config) -> tuple[Config, Space]:
    """The space in a TOML file: a list of values, or a range, for each setting.

    Args:
        path: the file, with a table for each section of the settings. A setting with a single
            value has it in all trials.
        base: the settings that are searched from.

    Returns:
        The settings with those of a single value, and the space.

    Raises:
        UserError: the file cannot be read, a setting is unknown, or the settings refuse a value.
    """
    values = toml.without_version(toml.read_toml(path), path)
    known = flat(base)
    fixed: dict[str, dict[str, Any]] = {}
    space: dict[str, Range | Choice] = {}
    for section, entries in values.items():
        of_section = {name for name in known if name.startswith(f"{section}.")}
        if not of_section or not isinstance(entries, dict):
            # with the message of a config, which knows sections and their fields
            toml.replace_fields(base, {section: entries}, str(path))
            raise UserError(f"{path}: {section} = {entries!r}: must be in the table of a section")
        for given, entry in cast(dict[str, Any], entries).items():
            name = f"{section}.{toml.present_name(given)}"
            where = f"{path} [{section}] {given}"
            if name not in known:
                toml.replace_fields(base, {section: {given: None}}, str(path))
            if not isinstance(entry, list | dict):
                fixed.setdefault(section, {})[given] = entry
                continue
            space[name] = _entry(cast("list[Any] | dict[str, Any]", entry), known[name], where)
    base = toml.replace_fields(base, fixed, str(path))  # at once: some fit only together
    if not space:
        raise UserError(f"{path}: has no settings to search, must have at least 1")
    for name, searched in space.items():
        for value in searched.ends:
            toml.replace_fields(base, nested({name: value}), str(path))
    return base, space


def _entry(entry: list[Any] | dict[str, Any], current: object, where: str) -> Range | Choice:
    """A range or some values.

    Args:
        entry: as in the file.
        current: the setting's value before the search.
        where: file, section and setting, for errors.
    """
    if isinstance(entry, list):
        choices = dict.fromkeys(map(_hashable, entry))
        if len(choices) < 2:
            raise UserError(f"{where} = {entry!r}: must have at least 2 different values")
        return Choice(tuple(choices))
    table = records.convert(entry, _RangeTable, where)
    if not table.low < table.high:
        raise UserError(f"{where}: high = {table.high:g}: must be above low = {table.low:g}")
    if table.log and table.low <= 0:
        raise UserError(f"{where}: low = {table.low:g}: must be above 0 with log = true")
    is_whole = isinstance(current, int) and not isinstance(current, bool)
    if is_whole and not (table.low.is_integer() and table.high.is_integer()):
        raise UserError(f"{where}: low and high must be whole numbers")
    if is_whole and table.from_one:
        raise UserError(f"{where}: from_one = true: must be left out for whole numbers")
    return Range(table.low, table.high, table.log, is_whole, table.from_one)


def _hashable(value: Any) -> Any:
    return tuple(cast(Sequence[Any], value)) if isinstance(value, list) else value


def digest_of(space: Space) -> str:
    """8 hex digits of a space: searches with different spaces are different searches."""
    text = repr([(name, dataclasses.astuple(space[name])) for name in sorted(space)])
    return hashlib.sha256(text.encode()).hexdigest()[:8]
