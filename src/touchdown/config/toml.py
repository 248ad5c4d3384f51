"""Converts configs to TOML and back."""

import dataclasses
import tomllib
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import tomli_w

from touchdown.config.digest import FORMER_NAMES
from touchdown.core import limits, reading, records
from touchdown.core.errors import UserError, one_line
from touchdown.core.names import check_misspelt, hint

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FORMAT_VERSION = 1
ConfigLike = TypeVar("ConfigLike", bound="DataclassInstance")


def to_dict(config: "DataclassInstance") -> dict[str, Any]:
    """A config as nested dictionaries of plain values."""
    return dataclasses.asdict(config)


def to_toml(config: "DataclassInstance") -> str:
    """A config as TOML with every field; `from_toml` gives the same config back."""
    return to_text(to_dict(config))


def to_text(values: Mapping[str, Any]) -> str:
    """The fields of a config as TOML."""
    return tomli_w.dumps({"format_version": FORMAT_VERSION, **values})


def present_name(name: str) -> str:
    """The current name of a field: files with a former name can still be read."""
    present = {old: new for names in FORMER_NAMES.values() for new, old in names.items()}
    return present.get(name, name)


def replace_fields(instance: Any, values: Mapping[str, Any], where: str) -> Any:
    """A frozen dataclass with some fields replaced by values read from a file.

    Args:
        instance: the dataclass to start from.
        values: by field name; a mapping goes into the nested dataclass of that name.
        where: name of the source in error messages, such as `my.toml`.

    Raises:
        UserError: unknown field or invalid value.
    """
    kinds = typing.get_type_hints(cast(type[Any], type(instance)))
    changes: dict[str, Any] = {}
    for given, value in values.items():
        name = present_name(given)
        if name not in kinds:
            raise UserError(f"{where}: unknown field {given!r}; {_hint(name, kinds)}")
        if dataclasses.is_dataclass(kinds[name]):
            if not isinstance(value, dict):
                raise UserError(f"{where}: {name} = {value!r}: must be a table [{name}]")
            nested = cast(dict[str, Any], value)
            changes[name] = replace_fields(getattr(instance, name), nested, f"{where} [{name}]")
        elif isinstance(getattr(instance, name), dict) and isinstance(value, dict):
            changes[name] = getattr(instance, name) | value
        else:
            changes[name] = value
    try:
        return dataclasses.replace(instance, **changes)
    except ValueError as error:
        raise UserError(f"{where}: {one_line(error)}") from None


def _hint(name: str, kinds: Mapping[str, Any]) -> str:
    """Where an unknown field belongs, or the nearest known one."""
    for section, kind in kinds.items():
        if dataclasses.is_dataclass(kind) and name in {f.name for f in dataclasses.fields(kind)}:
            return f"it belongs in the table [{section}]"
    return hint(name, kinds)


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file's values.

    Raises:
        UserError: the file cannot be read or is not TOML.
    """
    check_misspelt(path)
    return parse(reading.read_text(path, limits.TOML_BYTES), path)


def parse(text: str, path: Path) -> dict[str, Any]:
    """The values of a TOML text.

    Args:
        text: in TOML.
        path: where it comes from, named in errors.

    Raises:
        UserError: it is not TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number of 5,000 digits, 100,000 brackets
        raise UserError(f"{path}: not TOML: {one_line(error)}") from None


def without_version(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """The values of a TOML file without its `format_version`, which may be missing.

    Raises:
        UserError: it is another.
    """
    values = dict(values)
    records.check_readable(values.pop("format_version", FORMAT_VERSION), [FORMAT_VERSION], path)
    return values


def from_values(values: Mapping[str, Any], base: ConfigLike, path: Path) -> ConfigLike:
    """`base` with the values of a TOML file; error messages name `path`.

    Raises:
        UserError: unknown field, invalid value or another format version.
    """
    return replace_fields(base, without_version(values, path), str(path))
