from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from PIL import Image

from touchdown.core.errors import UserError
from touchdown.figures import wall_clock

# the policies of two seeds: each is held until the next, with no interpolation
EARLY = ([1.0, 10.0, 100.0], [-100.0, 200.0, 200.0])
LATE = ([2.0, 50.0, 80.0], [-300.0, 100.0, 100.0])


def test_a_range_begins_where_all_seeds_hold_a_policy_and_ends_with_the_last():
    at, *_ = wall_clock.range_over_seeds([EARLY, LATE])
    assert_allclose((at[0], at[-1]), (2.0, 100.0))
    assert_allclose(np.diff(np.log(at)), np.log(50) / 399)  # even on a logarithmic axis


def test_a_policy_is_held_until_the_next_one_and_the_last_is_kept():
    at, mean, least, most = wall_clock.range_over_seeds([EARLY, LATE])
    for seconds, early, late in ((3.0, -100, -300), (20.0, 200, -300), (90.0, 200, 100)):
        index = np.searchsorted(at, seconds)
        assert (least[index], most[index], mean[index]) == (late, early, (early + late) / 2)
    assert (least[-1], most[-1]) == (100, 200)  # LATE ended at 80 and keeps its policy


def test_a_policy_is_held_from_its_own_second():
    _, mean, *_ = wall_clock.range_over_seeds([LATE])
    assert (mean[0], mean[-1]) == (-300, 100)


def test_each_system_has_a_line_a_dot_at_its_end_and_a_name():
    ax = wall_clock.draw_wall_clock(
        Figure().subplots(), {"mine": [EARLY, LATE], "theirs": [LATE]}, solved=77.0
    )
    mine, dot, theirs, _, solved = ax.get_lines()
    assert (mine.get_label(), theirs.get_label()) == ("mine", "theirs")
    assert_allclose(dot.get_xydata(), [[100.0, 150.0]])
    assert set(np.asarray(solved.get_ydata())) == {77.0}
    assert ax.get_xscale() == "log"
    assert "(1 to 2)" in ax.get_xlabel()
    assert mine.get_color() == dot.get_color() != theirs.get_color()


def test_systems_are_written_as_a_picture(tmp_path: Path):
    path = tmp_path / "peers.png"
    wall_clock.save_wall_clock(path, {"mine": [EARLY, LATE]})
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        assert picture.width > picture.height > 300
    with pytest.raises(UserError, match="cannot be written"):
        wall_clock.save_wall_clock(tmp_path / "none" / "peers.png", {"mine": [LATE]})
