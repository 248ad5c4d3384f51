"""The study files that made the documentation's tables."""

from pathlib import Path

import pytest

from touchdown.config.presets import PRESETS
from touchdown.studies import paper
from touchdown.studies.plan import FIRST_TUNING_SEED
from touchdown.studies.study_file import from_toml

FOLDER = Path(__file__).parents[2] / "studies"
FILES = sorted(FOLDER.glob("*.toml"))
CELLS = {
    "ace": 1,
    "classic-control": 3,
    "frugal": 1,
    "presets": 2,
    "rungs": 21,
    "search-paper-best": 10,
    "search-pilot": 5,
    "search-quick": 8,
    "sensitivity": 180,
    "swift": 1,
}


def test_there_are_no_others():
    assert [file.stem for file in FILES] == list(CELLS)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_file_plans_what_it_says(file):
    study = from_toml(file)
    assert study.name == file.stem  # what `study report` and its tables are called
    assert study.name not in {"paper", *paper.topics("quick")}
    cells = study.cells()
    assert len(cells) == len({cell.config.digest for cell in cells}) == CELLS[file.stem]
    is_search = file.stem.startswith("search-")
    seeds = [run.seed for run in study.runs()]
    assert all((seed >= FIRST_TUNING_SEED) == is_search for seed in seeds)
    untested = is_search or file.stem == "sensitivity"
    assert all((not cell.config.training.test_episodes) == untested for cell in cells)
    assert study.metric == ("validation_return" if untested else "best_return")


def test_all_rungs_have_equally_many_steps_and_looks():
    for cell in from_toml(FOLDER / "rungs.toml").cells():
        training = cell.config.training
        assert (training.max_env_steps, training.validation_period) == (180_000, 5_000)
        assert not training.stop_when_solved
        assert cell.config.preset == cell.name


def test_every_preset_that_flies_the_lander_until_its_steps_are_over_is_a_rung():
    known = {
        name
        for name, config in PRESETS.items()
        if config.env_id == "LunarLander-v3" and not config.training.stop_when_solved
    }
    rungs = {cell.name for cell in from_toml(FOLDER / "rungs.toml").cells()}
    assert known - rungs == {"ace"}  # its checkpoints take minutes to validate


def test_what_the_quick_scale_trains_with_is_among_the_settings_that_were_tried():
    tried = {cell.name: cell.config for cell in from_toml(FOLDER / "search-quick.toml").cells()}
    quick = paper.studies("quick")["size"].base_cell().config
    chosen = tried["rate-5e-4"]
    assert (chosen.learning, chosen.network) == (quick.learning, quick.network)
    assert chosen.training.num_envs == quick.training.num_envs
