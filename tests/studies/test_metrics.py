import numpy as np
import pytest

from touchdown.studies.metrics import formatter


@pytest.mark.parametrize(
    ("metric", "numbers", "shown"),
    [
        ("best_return", [222.4, 3.14159], ["222", "3"]),
        ("best_return", [-0.25, 3.14159], ["-0.25", "3.14"]),
        ("area", [-9.9, 10.0], ["-10", "10"]),
        ("hover_share", [0.1284], ["12.8%"]),
        ("ratio", [1.23456], ["1.235"]),
    ],
)
def test_numbers_beside_each_other_have_as_many_decimals_as_tell_them_apart(metric, numbers, shown):
    text = formatter(metric, [np.array(numbers)])
    assert [text(number) for number in numbers] == shown


def test_no_numbers_need_no_decimals():
    assert formatter("best_return", [np.array([])])(0.5) == "0"
