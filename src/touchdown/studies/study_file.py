"""Reads and writes studies as TOML files."""

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import msgspec
import tomli_w
from msgspec import Meta, Struct

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.core import records
from touchdown.core.errors import UserError, one_line
from touchdown.core.names import hint
from touchdown.stats import spending
from touchdown.studies.claim_tests import KINDS, Test
from touchdown.studies.claims import Claim
from touchdown.studies.metrics import DEFAULT_METRIC
from touchdown.studies.plan import Factor, Level, Study

FORMAT_VERSION = 1
_OF_A_LEVEL = ("label", "position", "series")  # its other fields are changes
_OF_A_CLAIM = ("sentence", "kind", "metric", "section")  # its other fields are its kind's


class _FactorTable(Struct, frozen=True, forbid_unknown_fields=True):
    """`[[factor]]` of a study file."""

    name: str = ""
    field: Annotated[str, Meta(title="a field such as 'learning.gamma'")] = ""
    values: Annotated[list[Any], Meta(title="a list of values")] = msgspec.field(
        default_factory=list[Any]
    )
    level: Annotated[list[dict[str, Any]], Meta(title="tables [[factor.level]]")] = msgspec.field(
        default_factory=list[dict[str, Any]]
    )


class _StudyFile(Struct, frozen=True, forbid_unknown_fields=True):
    """A study file."""

    format_version: Any = FORMAT_VERSION
    name: str = ""
    title: str = ""
    question: str = ""
    base: Annotated[
        str | dict[str, Any], Meta(title="a preset's name or a table [base] of settings")
    ] = "paper-best"
    base_level: Annotated[str, Meta(title="a level's label")] = ""
    seeds: int = 5
    looks: Annotated[list[int], Meta(title="a list of numbers of seeds")] = msgspec.field(
        default_factory=list[int]
    )
    spending: Annotated[str, Meta(title="the name of a shape")] = spending.OBRIEN_FLEMING
    first_seed: int = 0
    metric: Annotated[str, Meta(title="a metric's name")] = DEFAULT_METRIC
    config: Annotated[dict[str, Any], Meta(title="a table [config]")] = msgspec.field(
        default_factory=dict[str, Any]
    )
    factor: Annotated[list[_FactorTable], Meta(title="tables [[factor]]")] = msgspec.field(
        default_factory=list[_FactorTable]
    )
    claim: Annotated[list[dict[str, Any]], Meta(title="tables [[claim]]")] = msgspec.field(
        default_factory=list[dict[str, Any]]
    )


def from_toml(path: Path) -> Study:
    """The study in a TOML file.

    Raises:
        UserError: the file cannot be read or has another format version, a field is unknown, a
            factor is empty, the config refuses a value, or a claim cannot be decided.
    """
    file = records.convert(toml.read_toml(path), _StudyFile, path)
    records.check_readable(file.format_version, [FORMAT_VERSION], path)
    base = file.base
    if not isinstance(base, str):
        base = toml.replace_fields(Config(), base, f"{path} [base]")
    try:
        return Study(
            name=file.name or path.stem,
            title=file.title,
            question=file.question,
            base=base,
            base_level=file.base_level,
            seeds=file.seeds,
            looks=tuple(file.looks),
            spending=file.spending,
            first_seed=file.first_seed,
            metric=file.metric,
            changes=file.config,
            factors=tuple(map(_factor_from, file.factor)),
            claims=tuple(_claim_from(i, table) for i, table in enumerate(file.claim, start=1)),
            from_file=True,
        )
    except UserError as error:
        raise UserError(f"{path}: {one_line(error)}") from None


def to_toml(study: Study) -> str:
    """A study as TOML with all fields; `from_toml` returns an equal study."""
    base = study.base if isinstance(study.base, str) else toml.to_dict(study.base)
    return tomli_w.dumps(
        {
            "format_version": FORMAT_VERSION,
            "name": study.name,
            "title": study.title,
            "question": study.question,
            "base": base,
            "base_level": study.base_level,
            "seeds": study.seeds,
            "looks": list(study.looks),
            "spending": study.spending,
            "first_seed": study.first_seed,
            "metric": study.metric,
            "config": study.changes,
            "factor": [
                {"name": factor.name, "level": list(map(_table_of, factor.levels))}
                for factor in study.factors
            ],
            "claim": [
                {
                    "sentence": claim.sentence,
                    "kind": claim.test.kind,
                    "metric": claim.metric,
                    "section": claim.section,
                    **_fields_of(claim.test),
                }
                for claim in study.claims
            ],
        }
    )


def _fields_of(test: Test) -> dict[str, Any]:
    """The fields of a test; TOML has no word for those that are None."""
    return {name: value for name, value in dataclasses.asdict(test).items() if value is not None}


def _factor_from(table: _FactorTable) -> Factor:
    if table.field:
        return Factor.of(table.field, table.values, table.name)
    if not table.name:
        raise UserError("[[factor]]: must have a field, or a name and [[factor.level]]")
    return Factor(table.name, tuple(map(_level_from, table.level)))


def _level_from(table: dict[str, Any]) -> Level:
    if not isinstance(table.get("label"), str):
        raise UserError(f"[[factor]]: level = {table!r}: must be a table with a label")
    own = {name: value for name, value in table.items() if name in _OF_A_LEVEL}
    return Level(**own, changes={name: table[name] for name in table if name not in own})


def _table_of(level: Level) -> dict[str, Any]:
    place = {} if level.position is None else {"position": level.position}
    return {"label": level.label, **place, "series": level.series, **level.changes}


def _claim_from(number: int, table: dict[str, Any]) -> Claim:
    """The claim in a table.

    Args:
        number: number of the table, from 1.
        table: `[[claim]]`.
    """
    where = f"[[claim]] {number}"
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        said = "kind: missing" if kind is None else f"kind = {kind!r}: unknown"
        raise UserError(f"{where}: {said}; {hint(kind, KINDS)}")
    fields = {each.name: each for each in dataclasses.fields(KINDS[kind])}
    unknown = next((name for name in table if name not in (*_OF_A_CLAIM, *fields)), None)
    if unknown is not None:
        known = hint(unknown, (*_OF_A_CLAIM, *fields))
        raise UserError(f"{where}: unknown field {unknown!r} for {kind}; {known}")
    required = [name for name, of in fields.items() if of.default is dataclasses.MISSING]
    missing = next((name for name in ("sentence", *required) if name not in table), None)
    if missing is not None:
        raise UserError(f"{where}: {missing}: missing")
    try:
        test = KINDS[kind](**{name: value for name, value in table.items() if name in fields})
        own = ("sentence", "metric", "section")
        return Claim(test=test, **{name: table[name] for name in own if name in table})
    except UserError as error:
        raise UserError(f"{where}: {error}") from None
