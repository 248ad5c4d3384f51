import numpy as np
import pytest

from touchdown.core.errors import UserError
from touchdown.studies.changes import nested


def test_dotted_names_and_sections_are_merged():
    changes = {"learning.gamma": 0.9, "learning": {"double": True}, "preset": "dqn", "table": {}}
    assert nested(changes) == {"learning": {"gamma": 0.9, "double": True}, "preset": "dqn"}


def test_values_are_such_as_toml_has():
    found = nested({"a": np.int64(3), "b": (1, (2.5,)), "c": np.array([1.0, 2.0]), "d": "x"})
    assert found == {"a": 3, "b": [1, [2.5]], "c": [1.0, 2.0], "d": "x"}
    assert [type(found["a"]), type(found["c"][0])] == [int, float]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"a.b": 1, "a": {"b": 1}}, "'a.b': is set twice"),
        ({"a.b": 1, "a": 2}, "'a': is set twice"),
        ({"a": 2, "a.b": 1}, "'a': is set both as a field and as a section"),
    ],
)
def test_a_field_is_set_once(changes, said):
    with pytest.raises(UserError, match=said):
        nested(changes)
