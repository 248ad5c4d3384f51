import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from torch_files import saved, state, tensor, text
from touchdown.policies.foreign.archive import Archive
from touchdown.policies.foreign.torch_state import read_state

REAL = Path(__file__).parent / "sb3" / "dqn.zip"


def test_an_array_is_laid_out_by_its_strides():
    arrays = read_state(
        saved(
            state(
                rows=tensor((2, 3), (3, 1)),
                turned=tensor((3, 2), (1, 3)),
                part=tensor((2,), (2,), offset=3),
                single=tensor((), (), offset=4),
            )
        )
    )
    assert_array_equal(arrays["rows"], [[0, 1, 2], [3, 4, 5]])
    assert_array_equal(arrays["turned"], [[0, 3], [1, 4], [2, 5]])
    assert_array_equal(arrays["part"], [3, 5])
    assert_array_equal(arrays["single"], 4)
    assert {array.dtype for array in arrays.values()} == {np.dtype("<f4")}


@pytest.mark.parametrize(
    ("storage", "dtype"),
    [("DoubleStorage", "<f8"), ("HalfStorage", "<f2"), ("LongStorage", "<i8")],
)
def test_numbers_keep_their_types(storage, dtype):
    program = state(a=tensor((6,), (1,), storage=storage))
    data = np.arange(6, dtype=dtype).tobytes()
    (array,) = read_state(saved(program, **{"data/0": data})).values()
    assert array.dtype == dtype
    assert_array_equal(array, range(6))


def test_values_that_are_not_arrays_are_left_out():
    program = state(a=tensor((6,), (1,)), note=text("hello"))
    assert list(read_state(saved(program))) == ["a"]


class Evil:
    """Unpickled, it makes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.path,)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_pickle_that_would_run_something_is_refused_and_runs_nothing(tmp_path, protocol):
    marker = tmp_path / "run"
    program = pickle.dumps(Evil(marker), protocol)
    with pytest.raises(ValueError, match="which is not needed"):
        read_state(saved(program))
    assert not marker.exists()
    pickle.loads(program)  # noqa: S301 - the decoy shows that it would run
    assert marker.exists()


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (b"\x80\x02cos\nsystem\n" + text("true") + b"\x85R.", "names 'os.system'"),
        (b"\x80\x02cnumpy\nload\n.", "names 'numpy.load'"),
        (b"\x80\x02ctorch\nFloatStorage.__init__\n.", "names 'torch.FloatStorage.__init__'"),
        (b"(S'a'\nios\nsystem\n.", "has STRING, which is not needed"),
        (b"\x80\x02]" + b".", "is not a state dict"),
        (b"\x80\x02)R.", "broken"),
        (b"\x80\x02h\x05.", "broken"),
        (b"\x80\x02u.", "broken"),
        (b"\x80\x02(K\x01s.", "broken"),
        (b"\x80\x02}(K\x01u.", "broken"),
        (b"\x80\x02})K\x01s.", "not a name"),
        (b"\x80\x02K\x01.", "is not a state dict"),
        (b"\x80\x02ccollections\nOrderedDict\nK\x01R.", "not a call"),
        (b"\x80\x02K\x01Q.", "is not a state dict"),
        (b"", "not a complete pickle"),
        (b"\x80\x02X\xff\xff\xff\x7fab", "not a complete pickle"),
        (b"\xff\xfe", "not a complete pickle"),
        (b"N" * 2_000_000 + b".", "has 2000001 bytes, must be at most"),
    ],
)
def test_a_program_of_anything_else_is_refused(program, said):
    with pytest.raises(ValueError, match=said):
        read_state(saved(program))


@pytest.mark.parametrize(
    "array",
    [
        tensor((7,), (1,)),
        tensor((2, 3), (4, 1)),
        tensor((6,), (1,), offset=1),
        tensor((2,), (-1,), offset=3),
        tensor((-2, -3), (1, 1)),
        tensor((6,), (0,), count=2),
        tensor((2, 3), (3,)),
        tensor((0,), (1,)),
        tensor((1,), (2**31 - 1,)),
        tensor((1,) * 9, (1,) * 9),
        tensor((2**31 - 1,), (1,), count=2**31 - 1),
    ],
)
def test_an_array_that_reaches_beyond_its_storage_is_refused(array):
    with pytest.raises(ValueError, match=r"its data\.pkl has an array"):
        read_state(saved(state(a=array)))


@pytest.mark.parametrize(
    "identity",
    [
        text("storage"),
        b"(" + text("memory") + b"ctorch\nFloatStorage\n" + text("0") + text("cpu") + b"K\x06t",
        b"(" + text("storage") + text("float") + text("0") + text("cpu") + b"K\x06t",
    ],
)
def test_an_array_of_something_else_than_a_storage_is_refused(identity):
    array = b"ctorch._utils\n_rebuild_tensor_v2\n(" + identity + b"QK\x00K\x06\x85K\x01\x85tR"
    with pytest.raises(ValueError, match="has an array of an unknown kind"):
        read_state(saved(state(a=array)))


def test_a_state_dict_within_a_dictionary_has_the_name_of_its_entry():
    array = tensor((6,), (1,))
    inner = state(w=array).removeprefix(b"\x80\x02").removesuffix(b".")
    program = b"\x80\x02}(" + text("model_weights") + inner + text("epoch") + b"K\x03u."
    assert list(read_state(saved(program))) == ["model_weights.w"]


def test_too_many_numbers_are_refused_before_any_is_read():
    huge = {f"a{n}": tensor((1,), (1,), count=2**23, key="none") for n in range(3)}
    with pytest.raises(ValueError, match="more than 16777216 numbers"):
        read_state(saved(state(**huge)))


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (tensor((6,), (1,), key="../0"), "has no"),
        (tensor((6,), (1,), key="1"), "has no"),
        (tensor((6,), (1,), count=7), "has 24 bytes, must be 28"),
        (tensor((5,), (1,), count=5), "has 24 bytes, must be at most 20"),
        (tensor((6,), (1,), storage="BFloat16Storage"), "names 'torch.BFloat16Storage'"),
    ],
)
def test_missing_numbers_are_refused(array, said):
    with pytest.raises(ValueError, match=said):
        read_state(saved(state(a=array)))


def test_big_endian_numbers_are_refused():
    with pytest.raises(ValueError, match="not little-endian"):
        read_state(saved(state(), byteorder=b"big"))
    assert read_state(saved(state(), byteorder=b"little")) == {}


def test_a_file_without_a_program_is_refused():
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("x/data/0", b"")
    with pytest.raises(ValueError, match=r"has no data\.pkl"):
        read_state(file.getvalue())


def test_a_program_with_an_altered_byte_is_read_or_refused_but_never_breaks():
    policy = Archive(REAL.read_bytes()).read("policy.pth", 100_000)
    with zipfile.ZipFile(io.BytesIO(policy)) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    chance = np.random.default_rng(0)
    name = next(name for name in members if name.endswith("data.pkl"))
    refused = 0
    for _ in range(500):
        program = bytearray(members[name])
        program[chance.integers(len(program))] = chance.integers(256)
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w") as archive:
            for member, data in (members | {name: bytes(program)}).items():
                archive.writestr(member, data)
        try:
            read_state(file.getvalue())
        except ValueError:
            refused += 1
    assert 50 < refused < 500
