"""Settings by their bare names, without their section: as flags and as keyword arguments."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, cast

from touchdown.config.config import Config
from touchdown.config.sections import SECTIONS
from touchdown.config.synonyms import flag_for
from touchdown.config.toml import present_name, to_dict
from touchdown.core.errors import UserError, one_line
from touchdown.core.names import hint

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_NOT_SETTINGS = {"preset"}  # only a label: as a keyword it would not select a preset


def bare_names(kind: "type[DataclassInstance]") -> Iterator[str]:
    """The names of a dataclass's fields in order; a section is replaced by its fields.

    Args:
        kind: `Config`, or the flags of a command.
    """
    for item in dataclasses.fields(kind):
        inner = dataclasses.fields(SECTIONS[item.name]) if item.name in SECTIONS else (item,)
        yield from (each.name for each in inner)


def flat(config: Config) -> dict[str, Any]:
    """All settings by section and name, such as `learning.gamma` and `options.alpha`."""
    values: dict[str, Any] = {}
    for name, value in to_dict(config).items():
        if isinstance(value, dict):
            section = cast(dict[str, Any], value)
            values |= {f"{name}.{inner}": of for inner, of in section.items()}
        else:
            values[name] = value
    return values


def with_settings(config: Config, settings: Mapping[str, Any]) -> Config:
    """A config with some settings replaced, by their names on the command line.

    Args:
        config: the config to start from.
        settings: values by name without section, such as `learning_rate`; also whole sections,
            such as `network`, which are replaced first.

    Raises:
        UserError: an unknown name, or a value that is refused.
    """
    section_of = {
        item.name: section
        for section, kind in SECTIONS.items()
        for item in dataclasses.fields(kind)
    }
    known = set(bare_names(Config)) - _NOT_SETTINGS
    changed: dict[str, Any] = {}
    inner: dict[str, dict[str, Any]] = {}
    for given, value in settings.items():
        name = present_name(given)
        if name in section_of:
            inner.setdefault(section_of[name], {})[name] = value
        elif name in known or name in SECTIONS:
            changed[name] = value
        else:
            raise UserError(f"{given}: unknown setting; {_hint(given, value, known)}")
    try:
        for section, changes in inner.items():
            whole = changed.get(section, getattr(config, section))
            if isinstance(whole, SECTIONS[section]):  # anything else is refused by the config
                changed[section] = dataclasses.replace(whole, **changes)
        return dataclasses.replace(config, **changed)
    except ValueError as error:
        raise UserError(one_line(error)) from None


def _hint(given: str, value: object, known: Iterable[str]) -> str:
    if given in _NOT_SETTINGS:
        return f"a preset is the first argument: touchdown.train({value!r})"
    meant = flag_for(given, {name.replace("_", "-") for name in known})
    if meant is not None:
        return f"did you mean {meant.replace('-', '_')}?"
    return hint(given, known, "`touchdown train PRESET --help` lists them")
