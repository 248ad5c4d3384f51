import pytest

from touchdown.replay.transition import field_offsets, transition_dtype


@pytest.mark.parametrize("size", [1, 8])
def test_a_packed_transition_has_two_observations_and_five_more_entries(size: int):
    assert transition_dtype(size).itemsize == 4 * (2 * size + 5)


def test_offsets_count_the_entries_before_each_field():
    assert field_offsets(3) == {
        "o_tm1": 0,
        "a_tm1": 3,
        "r_t": 4,
        "discount_t": 5,
        "terminated": 6,
        "a_t": 7,
        "o_t": 8,
    }
