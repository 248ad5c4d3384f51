from dataclasses import replace

import pytest

from power_loss import Disk, lay_out
from small_configs import lake
from touchdown.agents.registry import make_agent
from touchdown.core.seeding import streams
from touchdown.envs import environment
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.training.checkpoint import restore_newest
from touchdown.training.trainer import Trainer

BASE = lake()
CONFIG = replace(
    BASE,
    training=replace(BASE.training, max_env_steps=40, checkpoint_seconds=0.0, validation_period=15),
)


def train(folder: RunFolder) -> None:
    trainer = Trainer(folder)
    trainer.run()
    trainer.close()


@pytest.fixture(scope="module")
def losses(tmp_path_factory):
    """A run, and what power losses at each of its moments could have left of its disk."""
    root = tmp_path_factory.mktemp("disk")
    folder = folders.create(root, CONFIG, "run")
    disk = Disk(root)
    with disk.watched():
        train(folder)
    return folder, list(disk.trees)


def test_a_power_loss_at_any_moment_leaves_the_last_checkpoint_whole(losses, tmp_path):
    spaces = environment.spaces_of(CONFIG.env_id)
    seen = [0]
    for number, tree in enumerate(losses[1]):
        checkpoints = lay_out(tree, tmp_path / str(number)) / "run" / "checkpoints"
        agent = make_agent(CONFIG, spaces, streams(0))
        progress = restore_newest(checkpoints, CONFIG.digest, agent, streams(0))
        seen.append(0 if progress is None else progress.env_steps)
    assert seen == sorted(seen)  # nothing that was saved is lost again
    assert len(set(seen)) >= 4


@pytest.mark.slow
def test_a_run_goes_on_exactly_after_a_power_loss_at_any_moment(losses, tmp_path):
    whole, trees = losses
    for number, tree in enumerate(trees):
        folder = RunFolder(lay_out(tree, tmp_path / str(number)) / "run")
        train(folder)
        assert folder.best.read_bytes() == whole.best.read_bytes()
        assert folder.validations.read_bytes() == whole.validations.read_bytes()
