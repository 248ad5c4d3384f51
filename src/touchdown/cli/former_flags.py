"""Former names of flags, which scripts may still use."""

from collections.abc import Mapping, Sequence

FORMER_FLAGS: Mapping[tuple[str, ...], Mapping[str, str]] = {
    ("train",): {
        "--max-observations": "--max-env-steps",
        "--finalists": "--candidate-checkpoints",
    },
    ("tune", "agent"): {"--observations": "--env-steps"},
}
"""Current name of each former flag, by verb."""


def with_present_names(argv: Sequence[str]) -> list[str]:
    """The command line with every former flag replaced by the current one."""
    names = {
        former: present
        for verb, flags in FORMER_FLAGS.items()
        if tuple(argv[: len(verb)]) == verb
        for former, present in flags.items()
    }
    return [_renamed(token, names) for token in argv]


def _renamed(token: str, names: Mapping[str, str]) -> str:
    flag, equals, value = token.partition("=")
    return f"{names.get(flag.replace('_', '-'), flag)}{equals}{value}"
