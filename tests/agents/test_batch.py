import jax
import numpy as np
import pytest

from touchdown.agents.batch import unpack_transitions
from touchdown.replay.transition import transition_dtype

RECORDS = [
    # o_tm1, a_tm1, r_t, discount_t, terminated, a_t, o_t
    ((1.0, 2.0), 3, -4.0, 0.99, 0, 2, (5.0, 6.0)),
    ((-0.5, 1e-30), 0, 100.0, 0.0, 1, 1, (7.0, -8.0)),
    ((9.0, 10.0), 1, 0.25, 0.5, 0, 3, (11.0, 12.0)),
]


def packed_of(records: np.ndarray) -> np.ndarray:
    return records.view(np.float32).reshape(len(records), -1)


@pytest.mark.parametrize(
    "unpack", [unpack_transitions, jax.jit(unpack_transitions, static_argnums=1)]
)
def test_packed_transitions_come_back_field_by_field(unpack):
    records = np.array(RECORDS, transition_dtype(2))
    batch = unpack(packed_of(records), 2)
    for name in ("o_tm1", "a_tm1", "r_t", "discount_t", "o_t", "a_t"):
        array = np.asarray(getattr(batch, name))
        assert array.dtype == records[name].dtype, name
        assert np.array_equal(array, records[name]), name


def test_an_action_survives_though_its_bits_are_no_normal_float():
    records = np.zeros(4, transition_dtype(8))
    records["a_tm1"] = [0, 1, 2, 3]  # as floats: zero and denormals, which arithmetic may flush
    records["a_t"] = [3, 2, 1, 0]
    records["terminated"] = 7
    batch = jax.jit(unpack_transitions, static_argnums=1)(packed_of(records), 8)
    assert np.asarray(batch.a_tm1).tolist() == [0, 1, 2, 3]
    assert np.asarray(batch.a_t).tolist() == [3, 2, 1, 0]
    assert not np.any(batch.o_t)
    assert not np.any(batch.discount_t)
