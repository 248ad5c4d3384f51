import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.runs.folder import RunFolder
from touchdown.training.loggers import JsonLinesLogger, Recorder, TensorBoardLogger


def test_json_lines_have_the_step_and_the_scalars_and_are_appended(tmp_path):
    path = tmp_path / "scalars.jsonl"
    logger = JsonLinesLogger(path)
    logger.log(5, {"train/loss": 0.25, "train/mean_q": -1.0})
    assert path.read_text() == '{"step": 5, "train/loss": 0.25, "train/mean_q": -1.0}\n'
    logger.close()
    again = JsonLinesLogger(str(path))
    again.log(6, {"eval/mean_reward": 200.0})
    again.close()
    assert files.read_jsonl(path) == [
        {"step": 5, "train/loss": 0.25, "train/mean_q": -1.0},
        {"step": 6, "eval/mean_reward": 200.0},
    ]


def test_a_file_that_cannot_be_written_is_refused_in_one_line(tmp_path):
    with pytest.raises(UserError, match=r"none/scalars.jsonl': cannot be written: No such file"):
        JsonLinesLogger(tmp_path / "none" / "scalars.jsonl")


def test_tensorboard_reads_what_its_logger_writes(tmp_path):
    logger = TensorBoardLogger(tmp_path / "new")
    logger.log(5, {"train/loss": 0.25})
    logger.log(9, {"train/loss": 0.125, "eval/mean_reward": 200.0})
    logger.close()
    accumulator = EventAccumulator(str(tmp_path / "new"))
    accumulator.Reload()
    losses = [(event.step, event.value) for event in accumulator.Scalars("train/loss")]
    assert losses == [(5, 0.25), (9, 0.125)]
    (mean,) = accumulator.Scalars("eval/mean_reward")
    assert (mean.step, mean.value) == (9, 200.0)


def test_a_tensorboard_logger_that_is_told_nothing_writes_nothing(tmp_path):
    logger = TensorBoardLogger(tmp_path)
    logger.flush()
    logger.close()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["episodes.jsonl", "validations.jsonl", "events.out.tfevents.1.x"])
def test_a_record_that_is_a_link_is_refused_and_what_it_leads_to_stays(tmp_path, name):
    thesis, run = tmp_path / "thesis", RunFolder(tmp_path / "run")
    thesis.write_text("mine")
    run.path.mkdir()
    run.updates.write_text("{}\n")
    (run.path / name).symlink_to(thesis)
    with pytest.raises(UserError, match=f"{name}: is a symbolic link, must be a regular file"):
        Recorder(run, {name: 0})
    assert thesis.read_text() == "mine"
    assert run.updates.read_text() == "{}\n"
