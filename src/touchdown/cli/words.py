"""Checks the words of a command line against what its verb takes."""

import re
from collections.abc import Iterable, Mapping, Sequence

from touchdown.cli.flags import Flag
from touchdown.config.synonyms import flag_for
from touchdown.core.errors import UserError
from touchdown.core.names import nearest

_LOOKS_LIKE_A_FLAG = re.compile(r"--|-[A-Za-z]")
_SAYS_YES_OR_NO = ("true", "false", "yes", "no", "on", "off", "1", "0")


def ordered(
    verb: str,
    flags: Sequence[Flag],
    given: Sequence[str],
    former: Mapping[str, str],
    others: Mapping[str, str],
) -> list[str]:
    """The words after a verb, those without a flag first.

    Args:
        verb: such as `train` or `tune agent`.
        flags: what the verb takes.
        given: the words after the verb.
        former: current names of former flags, which are suggested for misspelt former ones.
        others: flags of all verbs, each with a verb that has it.

    Raises:
        UserError: a flag is unknown, is given twice or lacks its value; or a word is missing or
            not expected.
    """
    known = {word: flag for flag in flags if not flag.is_positional for word in flag.words}
    plain: list[str] = []
    flagged: list[str] = []
    counts: dict[str, int] = {}
    position, before = 0, ""
    while position < len(given):
        word = given[position]
        position += 1
        if not _LOOKS_LIKE_A_FLAG.match(word):
            _check_not_a_value(word, known.get(before))
            plain.append(word)
            before = ""
            continue
        name, equals, _ = word.partition("=")
        name = _with_dashes(name)
        flag = known.get(name)
        if flag is None:
            raise UserError(f"{name}: unknown option; {_hint(name, verb, known, former, others)}")
        counts[flag.word] = counts.get(flag.word, 0) + 1
        if counts[flag.word] > 1:
            raise UserError(f"{flag.word}: given 2 times; must be given once")
        end = position
        if flag.is_switch and equals:
            raise UserError(f"{name}: takes no value; write {' or '.join(flag.words)}")
        if not flag.is_switch and not equals:
            limit = len(given) if flag.takes_many else position + 1
            while end < min(limit, len(given)) and not _LOOKS_LIKE_A_FLAG.match(given[end]):
                end += 1
            if end == position:
                raise UserError(f"{name}: needs a value: {name} {flag.metavar}")
        flagged += [name + word[len(name) :], *given[position:end]]
        position, before = end, name
    _check_number(verb, [flag for flag in flags if flag.is_positional], plain)
    return [*plain, *flagged]


def _with_dashes(name: str) -> str:
    return name[:2] + name[2:].replace("_", "-")


def _check_not_a_value(word: str, flag_before: Flag | None) -> None:
    if flag_before and flag_before.is_switch and word.lower() in _SAYS_YES_OR_NO:
        raise UserError(
            f"{flag_before.word} {word}: takes no value; write {' or '.join(flag_before.words)}"
        )


def _check_number(verb: str, positional: Iterable[Flag], given: Sequence[str]) -> None:
    most = 0
    for flag in positional:
        if flag.is_required and len(given) <= most:
            raise UserError(f"{verb}: needs {flag.metavar}; `touchdown {verb} --help` describes it")
        most = len(given) if flag.takes_many else most + 1
    if len(given) > most:
        raise UserError(
            f"{given[most]!r}: unexpected word; `touchdown {verb} --help` shows what it takes"
        )


def _hint(
    name: str,
    verb: str,
    known: Iterable[str],
    former: Mapping[str, str],
    others: Mapping[str, str],
) -> str:
    words = {word: word for word in known} | dict(former)
    near = nearest(name, words)
    meant = flag_for(name.lstrip("-").lower(), {word[2:] for word in known})
    if meant is not None:
        return f"did you mean --{meant}?"
    elsewhere = others.get(name)
    lists = f"`touchdown {verb} --help` lists them"
    if near is not None:
        return f"did you mean {words[near]}?"
    if elsewhere is not None:
        return f"it is an option of `touchdown {elsewhere}`; {lists}"
    return lists
