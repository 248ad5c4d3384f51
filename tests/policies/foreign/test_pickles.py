import pickle
import tracemalloc

import pytest

from touchdown.policies.foreign import pickles
from touchdown.policies.foreign.pickles import Made, Name

PLAIN = {"a": [1, -(2**40), 2.5, None, True, False], "b": ("x", b"y", ()), 3: {"deep": [[]]}}


@pytest.mark.parametrize("protocol", range(3, pickle.HIGHEST_PROTOCOL + 1))
def test_plain_values_are_read_as_pickle_reads_them(protocol):
    assert pickles.read(pickle.dumps(PLAIN, protocol), "it") == PLAIN


def test_a_call_is_recorded_and_not_made():
    program = b"\x80\x02cos\nsystem\nX\x04\0\0\0true\x85R}X\x01\0\0\0aK\x07sb."
    made = pickles.read(program, "it")
    assert isinstance(made, Made)
    assert (made.name, made.arguments, made.state) == (Name("os system"), ("true",), {"a": 7})
    with pytest.raises(ValueError, match=r"it names 'os\.system', which is not needed"):
        pickles.read(program, "it", frozenset({"os path"}))


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (b"N" * (1 << 20) + b".", "it has 1048577 bytes, must be at most 1048576"),
        (b"\x80\x02(lp0\n.", "it has LIST, which is not needed"),
        (b"\x80\x02}]K\x01s.", "it is broken: not a name"),
        (b"\x80\x02K\x01K\x02a", "it is not a complete pickle"),
        (b"\x80\x02.", "it is broken"),
        (b"", "it is not a complete pickle"),
    ],
)
def test_another_program_is_refused(program, said):
    with pytest.raises(ValueError, match=f"^{said}"):
        pickles.read(program, "it")


def test_many_operations_take_little_memory():
    """Each makes an empty dictionary, the largest value that one byte makes."""
    tracemalloc.start()
    pickles.read(b"\x80\x04" + b"}" * 50_000 + b".", "it")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5e6  # a megabyte of them, the limit, takes 20 times as much


def test_nesting_without_end_is_read():
    assert isinstance(pickles.read(b"\x80\x02)" + b"\x85" * 500_000 + b".", "it"), tuple)
