from touchdown.config import ladder
from touchdown.config.presets import PRESETS


def test_a_rungs_changes_are_the_fields_that_its_base_has_otherwise():
    assert ladder.changes("double-dqn") == {"double": True}
    assert ladder.changes("polyak-dqn") == {"target_period": 0, "polyak": 0.005}
    assert ladder.changes("paper-best") == {"target_period": 800}


def test_every_rung_leads_down_to_value_iteration():
    for rung in ladder.BUILDS_ON:
        below = [rung]
        while below[-1] in ladder.BUILDS_ON:
            below.append(ladder.BUILDS_ON[below[-1]])
            assert len(set(below)) == len(below), below
        assert below[-1] == "value-iteration"


def test_every_preset_is_a_rung_or_no_part_of_the_ladder():
    others = {"cartpole", "acrobot", "mountain-car", "swift", "ace", "frugal"}
    assert set(PRESETS) - others == {"value-iteration", *ladder.BUILDS_ON}
