from dataclasses import dataclass
from typing import Annotated, Any, Literal

import msgspec
import pytest
from msgspec import Meta

from touchdown.core.complaints import complaint

Share = Annotated[float, Meta(ge=0, le=1)]


@dataclass
class Inner:
    share: Share
    names: tuple[str, ...] = ()


class Outer(msgspec.Struct, rename={"env_steps": "observations"}):
    env_steps: int
    inner: Inner | None = None
    by_name: dict[str, list[float]] = {}

    def __post_init__(self) -> None:
        if self.env_steps == 13:
            raise ValueError("observations = 13: must be lucky")


class Closed(msgspec.Struct, forbid_unknown_fields=True):
    seeds: int = 1
    of: list[Outer] = []


@pytest.mark.parametrize(
    ("value", "kind", "said"),
    [
        (1.5, Share, "x = 1.5: must be from 0 to 1"),
        (True, Share, "x = True: must be a number"),
        (float("nan"), Share, "x = nan: must be a finite number"),
        (10**400, float, "must be a finite number"),
        (0.0, Annotated[float, Meta(gt=0)], "x = 0.0: must be above 0"),
        (-1, Annotated[int, Meta(ge=0)], "x = -1: must be 0 or more"),
        (0, Annotated[int, Meta(ge=1)], "x = 0: must be at least 1"),
        (9, Annotated[int, Meta(le=8, description="8 at most")], "x = 9: must be 8 at most"),
        ("9", Annotated[int, Meta(le=8, description="8 at most")], "x = '9': must be a whole"),
        (3, Annotated[str, Meta(title="a preset's name")], "x = 3: must be a preset's name"),
        ([], Annotated[list[int], Meta(min_length=1)], "x = []: must be 1 or more values"),
        (
            "xyz",
            Annotated[str, Meta(pattern="^a", description="a word with a")],
            "x = 'xyz': must be a word with a",
        ),
        ("no", Literal["yes", "maybe"], "x = 'no': must be one of yes, maybe"),
        (1, Literal["yes", "maybe"], "x = 1: must be one of yes, maybe"),
        (True, Literal[0, 1], "x = True: must be one of 0, 1"),
        ("1", int | None, "x = '1': must be a whole number or null"),
        (-1, Annotated[int, Meta(ge=0)] | None, "x = -1: must be 0 or more"),
        ([1, 2.5], list[int], "x[1] = 2.5: must be a whole number"),
        ({"a": [1, "b"]}, dict[str, list[float]], "x.a[1] = 'b': must be a number"),
        ({}, Outer, "x.observations: missing"),
        ({"observations": 1, "inner": {"share": 2}}, Outer, "x.inner.share = 2: must be from 0"),
        ({"observations": 1, "inner": {}}, Outer, "x.inner.share: missing"),
        ({"observations": 1, "inner": []}, Outer, "x.inner = []: must be an object or null"),
        ({"observations": 1, "by_name": {"a": 0}}, Outer, "x.by_name.a = 0: must be a list"),
        ({"observations": 13}, Outer, "x.observations = 13: must be lucky"),
        (
            {"sede": 1},
            Closed,
            "x: unknown field 'sede'; must be one of seeds, of; did you mean seeds?",
        ),
        ({"of": [{"observations": None}]}, Closed, "x.of[0].observations = None: must be a whole"),
        ("a" * 100, int, f"x = '{'a' * 56}...: must be a whole number"),
    ],
)
def test_what_is_wrong_is_said_by_its_place_its_value_and_what_would_be_right(value, kind, said):
    found = complaint(value, kind, "x")
    assert found is not None
    assert said in found


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (0, Share),
        (1, float),
        (None, int | None),
        ("anything", Any),
        ([], list[int]),
        ({"observations": 1, "later": 2}, Outer),
        ({"observations": 1, "inner": {"share": 0.5, "names": ["a"]}}, Outer),
        (1, Literal[0, 1]),
    ],
)
def test_of_what_is_right_nothing_is_said(value, kind):
    assert complaint(value, kind, "x") is None


def test_a_value_without_a_name_is_described_by_its_type():
    assert complaint([], Outer) == "is of type list, must be an object"
