"""Help texts, as wide as the terminal."""

import inspect
import shutil
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING
from typing import Any, cast

from touchdown.cli.flags import Flag, flags_of
from touchdown.config.sections import SECTIONS

_WIDEST = 100  # longer lines are hard to read
_INDENT, _GAP = 2, 2
_WIDEST_NAME = 26  # of a flag beside its text; longer ones have a line of their own
_MAIN = (
    *("seed", "env_id", "episodes", "max_env_steps", "num_envs"),
    *("learning_rate", "gamma", "batch_size", "hidden_sizes"),
)
"""Settings in the short help of `train`."""
_OWN_CODE = ("algorithm", "options", "trust")


def of_program(verbs: Mapping[str, str]) -> str:
    """The help of `touchdown` alone: its verbs."""
    return _joined(
        "usage: touchdown VERB ...",
        _paragraph("A deep Q-learning laboratory for the lunar lander."),
        group("verbs", list(verbs.items())),
        _paragraph(
            "`touchdown VERB --help` describes a verb. `touchdown --version` prints the version."
        ),
    )


def of_words(verb: str, text: str, words: Mapping[str, type[Any]]) -> str:
    """The help of a verb that has second words, such as `study`."""
    rows = [(f"{verb} {name}", summary(each)) for name, each in words.items()]
    return _joined(
        f"usage: touchdown {verb} {'|'.join(words)} ...",
        _paragraph(text),
        group("verbs", rows),
        _paragraph(f"`touchdown {verb} {next(iter(words))} --help` describes one of them."),
    )


def of_verb(verb: str, kind: type[Any]) -> str:
    """The help of a verb: its words and flags with their defaults."""
    flags = flags_of(kind)
    positional = [flag for flag in flags if flag.is_positional]
    others = [flag for flag in flags if not flag.is_positional]
    return _joined(
        _usage(verb, flags),
        _paragraph(_description(kind)),
        group("", _rows(positional, {})),
        group("flags", _rows(others, {})),
    )


def of_training(
    kind: type[Any], preset: str | None, defaults: object, usable: Mapping[str, set[str]]
) -> str:
    """The help of `train`: short, or with all settings that a preset can use.

    Args:
        kind: the verb's dataclass.
        preset: the preset given on the command line; None for the short help.
        defaults: the verb with the preset's settings.
        usable: the fields that the preset can use, by section.
    """
    values: dict[str, Any] = {}
    for flag in flags_of(kind):
        where = getattr(defaults, flag.section) if flag.section else defaults
        values[flag.name] = getattr(where, flag.name)
    flags = flags_of(kind)
    if preset is not None:
        flags = [
            each for each in flags if not each.section or each.name in usable.get(each.section, ())
        ]
    positional = [flag for flag in flags if flag.is_positional]
    of_run = [flag for flag in flags if not flag.section and not flag.is_positional]
    own = [flag for flag in of_run if flag.name in _OWN_CODE]
    of_run = [flag for flag in of_run if flag.name not in (*_OWN_CODE, *_MAIN)]
    if preset is None:
        main = [flag for name in _MAIN for flag in flags if flag.name == name]
        settings = [group("the most used settings (defaults of pilot)", _rows(main, values))]
        ending = (
            "`touchdown presets` lists the presets. `touchdown train PRESET --help` shows every "
            "setting that a preset can use."
        )
    else:
        first = [flag for flag in flags if not flag.section and flag.name in _MAIN]
        settings = [group("what to train", _rows(first, values))]
        settings += [
            group(f"{name}: {_description(of).rstrip('.')}", _rows(of_section, values))
            for name, of in SECTIONS.items()
            if (of_section := [flag for flag in flags if flag.section == name])
        ]
        ending = f"Only the settings that {preset} can use are listed, with its own defaults."
    return _joined(
        _usage(f"train {preset or ''}".strip(), flags if preset is None else flags[1:]),
        _paragraph(_description(kind)),
        group("", _rows(positional, values)) if preset is None else "",
        *settings,
        group("the run", _rows(of_run, values)),
        group("code of your own", _rows(own, values)),
        _paragraph(ending),
    )


def _usage(verb: str, flags: Sequence[Flag]) -> str:
    words = [flag.word for flag in flags if flag.is_positional]
    return " ".join(["usage: touchdown", verb, *words, "[flags]"])


def _rows(flags: Iterable[Flag], values: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for flag in flags:
        name = flag.word if flag.is_positional else f"{flag.word} {flag.metavar}".rstrip()
        default = _default_of(flag, values.get(flag.name, flag.default))
        rows.append((name, f"{flag.text} {default}".rstrip()))
    return rows


def _default_of(flag: Flag, value: Any) -> str:
    if flag.is_switch:
        return f"(default: on; {flag.words[1]} turns it off)" if value else ""
    if flag.is_positional or value is None or value is MISSING or value == ():
        return ""
    text = (
        " ".join(map(str, cast(tuple[Any, ...], value))) if isinstance(value, tuple) else str(value)
    )
    return f"(default: {text})"


def group(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Names with their texts beside them, under a title."""
    if not rows:
        return ""
    fitting = [len(name) for name, _ in rows if len(name) <= _WIDEST_NAME]
    column = _INDENT + max(fitting, default=0) + _GAP
    lines = [*_wrapped(f"{title}:", 0)] if title else []
    for name, text in rows:
        beside = f"{' ' * _INDENT}{name}".ljust(column)
        if len(name) > column - _INDENT - _GAP:
            lines += [beside, *_wrapped(text, column)]
        else:
            first, *more = _wrapped(text, column) or [""]
            lines += [f"{beside}{first[column:]}".rstrip(), *more]
    return "\n".join(lines)


def _wrapped(text: str, indent: int) -> list[str]:
    space = " " * indent
    return textwrap.wrap(
        text,
        _width(),
        initial_indent=space,
        subsequent_indent=space,
        break_on_hyphens=False,
        break_long_words=False,
    )


def _width() -> int:
    return max(40, min(_WIDEST, shutil.get_terminal_size((80, 24)).columns))


def _paragraph(text: str) -> str:
    return "\n".join(_wrapped(text, 0))


def _joined(*parts: str) -> str:
    """The parts that are not empty, with blank lines between them."""
    return "\n\n".join(part for part in parts if part) + "\n"


def _description(kind: type[Any]) -> str:
    """A class's docstring on one line."""
    return " ".join((inspect.getdoc(kind) or "").split())


def summary(kind: type[Any]) -> str:
    """The first paragraph of a class's docstring."""
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())
