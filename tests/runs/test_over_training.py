import pytest

from touchdown.core.errors import UnreadableError
from touchdown.runs.folder import RunFolder
from touchdown.runs.over_training import path_at, policies_over_training


def test_policies_are_listed_by_their_env_steps_and_other_files_are_not(tmp_path):
    folder = RunFolder(tmp_path)
    folder.over_training.mkdir(parents=True)
    for env_steps in (123_456_789, 20_000, 0):
        path_at(folder, env_steps).touch()
    for name in ("best.safetensors", "123.safetensors", ".00000001.5-ab.tmp.safetensors"):
        (folder.over_training / name).touch()
    assert policies_over_training(folder) == [
        (0, folder.over_training / "00000000.safetensors"),
        (20_000, folder.over_training / "00020000.safetensors"),
        (123_456_789, folder.over_training / "123456789.safetensors"),
    ]


def test_a_run_that_saved_none_has_none(tmp_path):
    assert policies_over_training(RunFolder(tmp_path)) == []


def test_a_link_or_a_file_in_place_of_the_folder_is_refused(tmp_path):
    folder = RunFolder(tmp_path / "run")
    folder.checkpoints.mkdir(parents=True)
    folder.over_training.symlink_to(tmp_path)
    with pytest.raises(UnreadableError, match="over-training: is a symbolic link, must be a fold"):
        policies_over_training(folder)
    folder.over_training.unlink()
    folder.over_training.touch()
    with pytest.raises(UnreadableError, match="over-training: cannot be read: Not a directory"):
        policies_over_training(folder)
