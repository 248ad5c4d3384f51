import json

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from single_changes import is_refused_in_a_line, single_changes
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.runs.training_flights import (
    TrainingFlightRow,
    pack_actions,
    read_training_flights,
    unpack_actions,
)


def test_four_actions_are_a_byte_the_first_in_its_lowest_bits():
    assert pack_actions(np.array([1, 0, 3, 2, 3], np.uint8)) == bytes([0b10_11_00_01, 3])
    assert_array_equal(unpack_actions(bytes([0b10_11_00_01, 3]), 5), [1, 0, 3, 2, 3])


@pytest.mark.parametrize("steps", [0, 1, 3, 4, 5, 1_000])
def test_actions_are_unpacked_as_they_were_packed(steps):
    actions = np.random.default_rng(steps).integers(0, 4, steps, np.uint8)
    unpacked = unpack_actions(pack_actions(actions), steps)
    assert unpacked.dtype == np.uint8
    assert_array_equal(unpacked, actions)


def test_a_line_has_the_start_and_the_actions(tmp_path):
    path = tmp_path / "training-flights.jsonl"
    path.write_bytes(files.to_json_line(TrainingFlightRow.of(3, 77, [1, 0, 3, 2, 3])))
    assert json.loads(path.read_text()) == {
        "episode": 3, "start": 77, "actions": "sQM=", "steps": 5,
    }  # fmt: skip
    (flight,) = read_training_flights(path)
    assert (flight.episode, flight.start) == (3, 77)
    assert_array_equal(flight.actions, [1, 0, 3, 2, 3])


def test_a_run_without_the_file_has_no_flights(tmp_path):
    assert read_training_flights(tmp_path / "training-flights.jsonl") == []


def test_one_wrong_value_in_a_line_is_reported_in_one_line(tmp_path):
    path = tmp_path / "training-flights.jsonl"
    row = {"episode": 3, "start": 77, "actions": "sQM=", "steps": 5}
    refused = 0
    for other in single_changes(row):
        path.write_text(json.dumps(other) + "\n")
        refused += is_refused_in_a_line(lambda: read_training_flights(path), f"{path}: ")
    assert refused > 30


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"actions": "s?M="}, r"line 1: actions = 's\?M=': must be base64"),
        ({"actions": "sQM"}, "line 1: actions = 'sQM': must be base64"),
        ({"steps": 9}, "line 1: actions: has 2 bytes, must have 3 for steps = 9"),
        ({"steps": 4}, "line 1: actions: has 2 bytes, must have 1 for steps = 4"),
    ],
)
def test_actions_that_do_not_fit_are_refused(tmp_path, changed, said):
    path = tmp_path / "training-flights.jsonl"
    row = {"episode": 3, "start": 77, "actions": "sQM=", "steps": 5} | changed
    path.write_text(json.dumps(row) + "\n")
    with pytest.raises(UserError, match=said):
        read_training_flights(path)
