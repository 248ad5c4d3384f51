import numpy as np
import pytest
from numpy.testing import assert_array_equal
from safetensors.numpy import save_file

from touchdown.core.errors import UserError
from touchdown.evaluation.paths import PathRecorder, load_paths, save_paths


def test_the_first_paths_are_kept_whatever_the_order_of_the_steps():
    recorder = PathRecorder([40, 30, 20], count=2)
    # episodes 0 and 1 begin, then 1 steps; episode 2, which is not kept, takes its place
    recorder(np.array([0, 1]), np.array([[1, 2, 9], [3, 4, 9]], np.float32))
    recorder(np.array([1]), np.array([[5, 6, 9]], np.float32))
    recorder(np.array([2]), np.array([[7, 8, 9]], np.float32))
    recorder(np.array([0, 2]), np.array([[1, 3, 9], [7, 7, 9]], np.float32))
    assert list(recorder.paths) == [40, 30]
    assert_array_equal(recorder.paths[40], [[1, 2], [1, 3]])
    assert_array_equal(recorder.paths[30], [[3, 4], [5, 6]])


def test_paths_are_read_as_they_were_written(tmp_path):
    paths = {9: np.array([[1, 2]], np.float32), 3: np.array([[0, 1], [2, 3]], np.float32)}
    save_paths(tmp_path / "paths.safetensors", paths)
    found = load_paths(tmp_path / "paths.safetensors")
    assert list(found) == [9, 3]
    assert all(found[start].tobytes() == paths[start].tobytes() for start in paths)


@pytest.mark.parametrize(
    ("tensors", "metadata", "message"),
    [
        ({}, {"format_version": "9", "starts": "[]"}, "format_version = '9': must be 1 in"),
        ({}, {"format_version": "1"}, "not recorded paths"),
        ({}, {"format_version": "1", "starts": "[3]"}, "not recorded paths"),
        ({"3": np.zeros((2, 3))}, {"format_version": "1", "starts": "[3]"}, r"is \(2, 3\), not"),
    ],
)
def test_a_broken_file_gets_one_line_that_names_it(tmp_path, tensors, metadata, message):
    path = tmp_path / "paths.safetensors"
    save_file(tensors, path, metadata)
    with pytest.raises(UserError, match=message) as error:
        load_paths(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)
