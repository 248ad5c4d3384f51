"""Parses a command line into a verb and its settings."""

import io
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any

import tyro
from tyro.conf import OmitArgPrefixes, subcommand

from touchdown.cli import messages
from touchdown.cli.doctor import Doctor
from touchdown.cli.former_flags import FORMER_FLAGS, with_present_names
from touchdown.cli.policies import Evaluate, Export, Fly
from touchdown.cli.runs import Compare, Runs, Show
from touchdown.cli.study import Study, StudyList, StudyReport, StudyRun, StudyStatus
from touchdown.cli.train import Train
from touchdown.cli.tune import Tune, TuneAgent, TunePid
from touchdown.config import presets
from touchdown.config.fields import bare_names
from touchdown.config.sections import SECTIONS
from touchdown.config.toml import from_values, read_toml
from touchdown.core.errors import UserError

Verb = Train | Evaluate | Fly | Tune | Study | Compare | Runs | Show | Export | Doctor
VERBS: dict[str, type[Verb]] = {
    "train": Train,
    "evaluate": Evaluate,
    "fly": Fly,
    "tune": Tune,
    "study": Study,
    "compare": Compare,
    "runs": Runs,
    "show": Show,
    "export": Export,
    "doctor": Doctor,
}
_SECOND_WORDS: dict[str, dict[str, type[Any]]] = {
    "tune": {"pid": TunePid, "agent": TuneAgent},
    "study": {"run": StudyRun, "status": StudyStatus, "report": StudyReport, "list": StudyList},
}
"""Second words of two-word verbs, which the flags belong to."""


def parse(argv: Sequence[str]) -> Verb:
    """The verb and its settings.

    Args:
        argv: the words after `touchdown`.

    Raises:
        UserError: there is no such verb, or its arguments are invalid.
        SystemExit: help was printed.
    """
    if argv and not argv[0].startswith("-") and argv[0] not in VERBS:
        raise UserError(f"verb {argv[0]!r}: unknown; choose one of {', '.join(VERBS)}")
    argv = with_present_names(argv)
    defaults = _train_defaults(argv)
    # the preset is known by now; removing it makes --help show where it goes
    rest = argv[2:] if _preset_in(argv) else argv[1:]
    verbs = (
        Annotated[Train, subcommand("train", default=defaults)]
        | Annotated[Evaluate, subcommand("evaluate")]
        | Annotated[Fly, subcommand("fly")]
        | Annotated[Tune, subcommand("tune")]
        | Annotated[Study, subcommand("study")]
        | Annotated[Compare, subcommand("compare")]
        | Annotated[Runs, subcommand("runs")]
        | Annotated[Show, subcommand("show")]
        | Annotated[Export, subcommand("export")]
        | Annotated[Doctor, subcommand("doctor")]
    )
    complaint = io.StringIO()
    try:
        with redirect_stderr(complaint):
            verb: Verb = tyro.cli(
                verbs,  # pyright: ignore[reportArgumentType] - a union of types is a type to tyro
                args=[*argv[:1], *rest],
                prog="touchdown",
                description="A deep Q-learning laboratory for the lunar lander.",
                config=(OmitArgPrefixes,),
            )
    except SystemExit as error:
        if error.code in (0, None):
            raise
        words = _verb_in(argv)
        flags = {flag: flag for flag in _flags_of(words)} | dict(FORMER_FLAGS.get(words, {}))
        raise UserError(
            messages.one_line_of(complaint.getvalue(), " ".join(words), flags)
        ) from None
    if isinstance(verb, Train) and verb.preset != defaults.preset:
        raise UserError(f"preset {verb.preset!r}: must be given once, right after `train`")
    return verb


def named_in(argv: Sequence[str]) -> list[str]:
    """The environments and agents that a user named by flags: their code may be imported."""
    flags = ("--env-id", "--env_id", "--algorithm")
    return [value for flag in flags for value in _values_of(argv, flag)]


def _train_defaults(argv: Sequence[str]) -> Train:
    """The defaults of `train`'s flags, which depend on the given preset and TOML file."""
    if not argv or argv[0] != "train":
        return Train()
    given = _preset_in(argv)
    file = _value_of(argv, "--config")
    values = {} if file is None else read_toml(Path(file))
    named = str(values.get("preset"))
    config = presets.preset(given or (named if named in presets.PRESETS else "pilot"))
    if file is not None:
        config = from_values(values, config, Path(file))
    sections = {section: getattr(config, section) for section in SECTIONS}
    return Train(
        preset=given or config.preset,
        seed=config.seed,
        env_id=config.env_id,
        algorithm=config.algorithm,
        base_options=dict(config.options),
        **sections,
    )


def _preset_in(argv: Sequence[str]) -> str | None:
    if len(argv) > 1 and argv[0] == "train" and not argv[1].startswith("-"):
        return argv[1]
    return None


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


def _verb_in(argv: Sequence[str]) -> tuple[str, ...]:
    """The verb's one or two words; empty if the line does not begin with a verb."""
    if not argv or argv[0] not in VERBS:
        return ()
    return tuple(argv[: 2 if set(argv[1:2]) & _SECOND_WORDS.get(argv[0], {}).keys() else 1])


def _flags_of(words: Sequence[str]) -> Iterator[str]:
    """The current flags of a verb; for a lone first word, those of all its second words."""
    if not words:
        return
    inner = _SECOND_WORDS.get(words[0], {"": VERBS[words[0]]})
    for kind in [inner[words[1]]] if len(words) > 1 else inner.values():
        names = (name for name in bare_names(kind) if name != "base_options")  # not a flag
        yield from (f"--{name.replace('_', '-')}" for name in names)
