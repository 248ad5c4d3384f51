"""The lander's JavaScript interface: snapshots, settings, the end of an episode, and misuse."""

from typing import Any

from javascript import MODULE, encoded, in_node


def use(name: str) -> Any:
    return in_node("landers.js", "use", {"module": encoded(MODULE), "name": name})


def test_a_snapshot_continues_to_the_last_bit_in_any_lander():
    said = use("aSnapshotContinues")
    assert said["steps"] == said["restoredSteps"] == 60
    assert said["restored"] == said["again"] == said["expected"]
    assert len({tuple(step) for step in said["expected"]}) > 100


def test_a_snapshot_of_an_ended_episode_has_its_outcome():
    end, restored = use("aSnapshotHasTheEnd")
    assert restored == end
    assert end[0] == "landed"


def test_settings_change_at_the_next_reset_and_survive_a_snapshot():
    said = use("settingsChangeAtTheNextReset")
    assert said["afterRestoring"] == said["same"]
    assert (said["first"], said["changed"]) == (said["expectedFirst"], said["expected"])
    assert said["changed"] != said["same"]


def test_steps_beyond_the_end_move_the_lander_and_leave_the_episode_as_it_was():
    end, after, bodies, moved = use("theEndStays")
    assert after == end
    assert bodies != moved


def test_arrays_are_the_callers_own():
    said = use("resultsAreOnesOwn")
    assert said["kept"] == said["copy"] != said["differs"]
    assert said["bodies"] == said["bodiesBefore"]


def test_many_landers_fly_apart_while_memory_grows():
    assert use("manyLandersFlyApart") == 3


def test_freed_memory_is_used_again():
    assert use("freedMemoryIsUsedAgain") == 0


def test_misuse_is_refused_in_one_line_and_harms_nothing():
    for case in in_node("landers.js", "misuse", {"module": encoded(MODULE)}):
        assert case["expected"] in case["said"]
        assert "\n" not in case["said"]
        assert case["unharmed"], case
