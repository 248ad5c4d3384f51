"""Parses a command line into a verb and its settings."""

import io
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

import tyro
from tyro.conf import OmitArgPrefixes

from touchdown.cli import helps, messages
from touchdown.cli.doctor import Doctor
from touchdown.cli.flags import flags_of
from touchdown.cli.former_flags import FORMER_FLAGS, with_present_names
from touchdown.cli.play import Play
from touchdown.cli.policies import Evaluate, Export, Fly
from touchdown.cli.presets import Presets
from touchdown.cli.runs import Compare, Runs, Show
from touchdown.cli.study import (
    StudyCheck,
    StudyExport,
    StudyImport,
    StudyList,
    StudyReport,
    StudyRun,
    StudyStatus,
)
from touchdown.cli.train import Train
from touchdown.cli.tune import TuneAgent, TunePid
from touchdown.cli.values import registry
from touchdown.cli.watch import Watch
from touchdown.cli.words import ordered
from touchdown.config import presets
from touchdown.config.rules import usable
from touchdown.config.sections import SECTIONS
from touchdown.config.toml import from_values, read_toml
from touchdown.core import processes
from touchdown.core.errors import UserError
from touchdown.core.names import hint, nearest

if TYPE_CHECKING:
    from rich.console import Console


class Verb(Protocol):
    """A parsed command line."""

    def run(self, console: "Console") -> None:
        """Do what it says."""
        ...


COMMANDS: Mapping[str, type[Any]] = {
    "train": Train,
    "presets": Presets,
    "evaluate": Evaluate,
    "fly": Fly,
    "play": Play,
    "tune pid": TunePid,
    "tune agent": TuneAgent,
    "study run": StudyRun,
    "study status": StudyStatus,
    "study report": StudyReport,
    "study list": StudyList,
    "study export": StudyExport,
    "study import": StudyImport,
    "study check": StudyCheck,
    "compare": Compare,
    "watch": Watch,
    "runs": Runs,
    "show": Show,
    "export": Export,
    "doctor": Doctor,
}
_OF_TWO_WORDS: Mapping[str, str] = {
    "tune": "Tune the PID controller or an agent's hyper-parameters.",
    "study": "Compare settings over several training seeds, with intervals and verdicts.",
}
"""First words of verbs of two words, and what they are for."""
VERBS: Mapping[str, str] = {
    first: _OF_TWO_WORDS.get(first) or helps.summary(kind)
    for verb, kind in COMMANDS.items()
    for first in [verb.split()[0]]
}
"""First words, and what they are for."""
_HELP = {"-h", "--help"}
_MEANT: Mapping[str, str] = {
    **dict.fromkeys(("learn", "fit"), "train"),
    "resume": "train --resume",
    **dict.fromkeys(("test", "eval"), "evaluate"),
    **dict.fromkeys(("film", "render"), "fly"),
    **dict.fromkeys(("ls", "list"), "runs"),
    "info": "show",
    "diff": "compare",
    "check": "doctor",
    "onnx": "export",
    "optimize": "tune",
}
"""Verbs, by what they are called elsewhere."""


def parse(argv: Sequence[str]) -> Verb:
    """The verb and its settings.

    Args:
        argv: the words after `touchdown`.

    Raises:
        UserError: there is no such verb, or its arguments are invalid.
        SystemExit: help was printed.
    """
    argv = [*argv[1:], "--help"] if argv[:1] == ["help"] else argv
    if not argv or argv[0] in _HELP:
        _print_help(helps.of_program(VERBS))
    first, *rest = argv
    if first not in VERBS:
        raise UserError(f"command {first!r}: unknown; {_hint_of_verb(first)}")
    words = (first,)
    if first in _OF_TWO_WORDS:
        seconds = {
            verb.split()[1]: kind for verb, kind in COMMANDS.items() if verb.startswith(f"{first} ")
        }
        if not rest or rest[0] in _HELP:
            _print_help(helps.of_words(first, VERBS[first], seconds))
        second, *rest = rest
        if second not in seconds:
            raise UserError(f"{first} {second!r}: unknown; {hint(second, seconds)}")
        words = (first, second)
    return _parsed(words, with_present_names([*words, *rest])[len(words) :])


def _parsed(words: tuple[str, ...], rest: Sequence[str]) -> Verb:
    """The verb from the words that follow it."""
    verb = " ".join(words)
    kind = COMMANDS[verb]
    defaults = None
    preset = None
    if kind is Train:
        if any(_with_value(word, "--preset") for word in rest):
            raise UserError("--preset: a preset is a word of its own, such as `train pilot`")
        preset = rest[0] if rest and not rest[0].startswith("-") else None
        rest = rest if preset is None else rest[1:]
        defaults = _train_defaults(preset, rest)
    if not _HELP.isdisjoint(rest):
        if isinstance(defaults, Train):
            can_use = usable(defaults.settings())
            _print_help(helps.of_training(Train, preset, defaults, can_use))
        _print_help(helps.of_verb(verb, kind))
    args = ordered(verb, flags_of(kind), rest, FORMER_FLAGS.get(words, {}), _flags_of_verbs())
    if defaults is not None and args and not args[0].startswith("-"):
        raise UserError(f"preset {args[0]!r}: must be given once, right after `train`")
    complaint = io.StringIO()
    try:
        with redirect_stderr(complaint):
            return tyro.cli(
                kind,
                args=args,
                default=defaults,
                prog="touchdown",
                config=(OmitArgPrefixes,),
                registry=registry(),
            )
    except SystemExit:
        raise UserError(messages.one_line_of(complaint.getvalue())) from None


@cache
def _flags_of_verbs() -> Mapping[str, str]:
    """The flags of all verbs, each with a verb that has it."""
    found: dict[str, str] = {}
    for verb, kind in COMMANDS.items():
        for flag in flags_of(kind):
            for word in flag.words:
                found.setdefault(word, verb)
    return found


def _print_help(text: str) -> NoReturn:
    processes.print_out(text)
    raise SystemExit(0)


def _hint_of_verb(word: str) -> str:
    """What to type instead of an unknown verb."""
    if word in _MEANT:
        return f"did you mean `touchdown {_MEANT[word]}`?"
    if word in presets.PRESETS:
        return f"did you mean `touchdown train {word}`?"
    near = nearest(word, (*VERBS, "--version"))
    listed = "`touchdown --help` lists them"
    return listed if near is None else f"did you mean `touchdown {near}`?"


def _with_value(word: str, flag: str) -> bool:
    return word.partition("=")[0] == flag


def named_in(argv: Sequence[str]) -> list[str]:
    """The environments and agents that a user named by flags: their code may be imported."""
    flags = ("--env-id", "--env_id", "--algorithm")
    return [value for flag in flags for value in _values_of(argv, flag)]


def _train_defaults(given: str | None, argv: Sequence[str]) -> Train:
    """The defaults of `train`'s flags, which depend on the given preset and TOML file."""
    if given is not None:
        presets.preset(given)
    file = _value_of(argv, "--config")
    values = {} if file is None else read_toml(Path(file))
    named = str(values.get("preset"))
    config = presets.preset(given or (named if named in presets.PRESETS else "pilot"))
    if file is not None:
        config = from_values(values, config, Path(file))
    sections = {section: getattr(config, section) for section in SECTIONS}
    return Train(
        preset=given or config.preset,
        given_preset=given,
        seed=config.seed,
        env_id=config.env_id,
        algorithm=config.algorithm,
        base_options=dict(config.options),
        **sections,
    )


def _values_of(argv: Sequence[str], flag: str) -> list[str]:
    return [
        value
        for token, following in zip_longest(argv, argv[1:])
        for name, _, after in [token.partition("=")]
        if name == flag and (value := after or following) is not None
    ]


def _value_of(argv: Sequence[str], flag: str) -> str | None:
    given = _values_of(argv, flag)
    if len(given) > 1:
        raise UserError(f"{flag}: given {len(given)} times; must be given once")
    return given[0] if given else None
