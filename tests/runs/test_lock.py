import threading

import pytest

from small_configs import tiny
from touchdown.core.errors import UserError
from touchdown.runs import folder as folders


@pytest.fixture
def folder(tmp_path):
    return folders.create(tmp_path, tiny(), "x")


def test_a_run_is_locked_while_it_is_trained(folder):
    assert not folders.is_locked(folder)
    assert not (folder.path / "lock").exists()  # to ask changes nothing
    with folders.lock(folder):
        assert folders.is_locked(folder)
        with pytest.raises(UserError, match="run 'x': another process is training it"):
            folders.lock(folder)
    assert not folders.is_locked(folder)


def test_who_asks_never_keeps_a_training_from_starting(folder):
    folders.lock(folder).close()
    done = threading.Event()

    def ask() -> None:
        while not done.is_set():
            folders.is_locked(folder)

    asking = threading.Thread(target=ask)
    asking.start()
    try:
        for _ in range(50):
            folders.lock(folder).close()
    finally:
        done.set()
        asking.join()


def test_what_is_not_a_lock_is_none(folder, tmp_path):
    (folder.path / "lock").symlink_to(tmp_path / "x" / "config.toml")
    assert not folders.is_locked(folder)
