"""Hostile ONNX models, each made here; every one ends in one line, within its limits."""

import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from touchdown.core.errors import UserError
from touchdown.core.limits import MIB, WorkerLimits
from touchdown.policies.foreign import onnx_worker, worker_model
from touchdown.policies.foreign.worker_model import WorkerModel

ROW = np.zeros((1, 2), np.float32)
FLOAT = TensorProto.FLOAT


def saved(path: Path, nodes: list[Any], initializer: list[Any] = []) -> Path:  # noqa: B006
    """A model with the input `o`, [1, 2], and the output `q`."""
    graph = helper.make_graph(
        nodes,
        "hostile",
        [helper.make_tensor_value_info("o", FLOAT, [1, 2])],
        [helper.make_tensor_value_info("q", FLOAT, None)],
        initializer,
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    path.write_bytes(made.SerializeToString())
    return path


def constant(name: str, **value: Any) -> Any:
    return helper.make_node("Constant", [], [name], **value)


def looping(path: Path) -> Path:
    """A model that loops for ever."""
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["go"], ["still"]),
            helper.make_node("Sin", ["value"], ["next"]),
        ],
        "body",
        [
            helper.make_tensor_value_info("round", TensorProto.INT64, []),
            helper.make_tensor_value_info("go", TensorProto.BOOL, []),
            helper.make_tensor_value_info("value", FLOAT, [1, 2]),
        ],
        [
            helper.make_tensor_value_info("still", TensorProto.BOOL, []),
            helper.make_tensor_value_info("next", FLOAT, [1, 2]),
        ],
    )
    nodes = [
        constant("rounds", value_int=2**62),
        constant("go", value=helper.make_tensor("go", TensorProto.BOOL, [], [True])),
        helper.make_node("Loop", ["rounds", "go", "o"], ["q"], body=body),
    ]
    return saved(path, nodes)


def is_alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_a_model_that_loops_for_ever_ends_at_the_limit_and_so_does_its_process(tmp_path):
    model = WorkerModel(looping(tmp_path / "m.onnx"), WorkerLimits(act_seconds=0.3))
    process = model._process.pid
    assert is_alive(process)
    with pytest.raises(UserError, match=r"m\.onnx: needs more than 0\.3 seconds to compute an act"):
        model.results(ROW)
    assert not is_alive(process)
    with pytest.raises(UserError, match=r"m\.onnx: ended the process .*SIGKILL"):
        model.results(ROW)


def test_a_model_that_asks_for_gigabytes_is_refused_at_the_limit(tmp_path):
    nodes = [
        constant("size", value_ints=[1 << 10, 1 << 20]),
        helper.make_node("ConstantOfShape", ["size"], ["zeros"]),
        helper.make_node("ReduceSum", ["o"], ["s"], keepdims=0),
        helper.make_node("Add", ["zeros", "s"], ["q"]),
    ]
    path = saved(tmp_path / "m.onnx", nodes)
    with pytest.raises(UserError, match=r"^[^\n]*m\.onnx: [^\n]*$"):
        WorkerModel(path, WorkerLimits(memory=1024 * MIB)).results(ROW)


def test_a_model_that_becomes_a_terabyte_when_it_is_loaded_is_refused_at_the_limit(tmp_path):
    """40 nodes, each of which doubles its input, and which onnxruntime computes in advance."""
    names = [*(f"x{index}" for index in range(40)), "q"]
    nodes = [constant("x0", value_floats=[1.0])]
    for one, two in pairwise(names):
        nodes.append(helper.make_node("Concat", [one, one], [two], axis=0))
    path = saved(tmp_path / "m.onnx", nodes)
    with pytest.raises(UserError, match=r"^[^\n]*m\.onnx: [^\n]*$"):
        WorkerModel(path, WorkerLimits(memory=512 * MIB)).results(ROW)


def test_a_result_that_is_too_large_stays_in_its_process(tmp_path):
    nodes = [
        helper.make_node("ReduceSum", ["o"], ["s"], keepdims=0),
        constant("size", value_ints=[1 << 10, (1 << 12) + 1]),  # above 16 MiB
        helper.make_node("Expand", ["s", "size"], ["q"]),
    ]
    model = WorkerModel(saved(tmp_path / "m.onnx", nodes))
    (result,) = model.results(ROW)
    assert result.shape == [1 << 10, (1 << 12) + 1]
    with pytest.raises(UserError, match=r"m\.onnx: returns too large a value as q"):
        model.run(ROW, "q")


def test_a_model_that_crashes_its_process_is_refused_with_the_signal(tmp_path):
    model = WorkerModel(looping(tmp_path / "m.onnx"))
    os.kill(model._process.pid, signal.SIGSEGV)
    with pytest.raises(UserError, match=r"ended the process that was to .* \(signal SIGSEGV\); .*"):
        model.results(ROW)


def test_a_process_ends_with_its_model(tmp_path):
    model = WorkerModel(looping(tmp_path / "m.onnx"))
    process = model._process.pid
    assert is_alive(process)
    del model
    assert not is_alive(process)


PARENT = """
import sys
from pathlib import Path
import numpy as np
from touchdown.policies.foreign.worker_model import WorkerModel
model = WorkerModel(Path(sys.argv[1]))
print(model._process.pid, flush=True)
model.results(np.zeros((1, 2), np.float32))
"""


def test_a_process_ends_with_its_parent_even_while_it_computes_and_the_parent_is_killed(tmp_path):
    path = looping(tmp_path / "m.onnx")
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, str(path)], stdout=subprocess.PIPE, text=True
    ) as parent:
        process = int(parent.stdout.readline())
        time.sleep(0.2)  # it computes
        assert is_alive(process)
        parent.kill()
    deadline = time.monotonic() + 5
    while is_alive(process) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_alive(process)


def test_a_fork_of_this_process_has_a_model_of_its_own_and_imports_nothing_from_the_current_folder(
    tmp_path, monkeypatch
):
    (tmp_path / "onnxruntime.py").write_text("raise SystemExit('imported')")
    monkeypatch.chdir(tmp_path)
    path = saved(tmp_path / "m.onnx", [helper.make_node("Neg", ["o"], ["q"])])
    model = WorkerModel(path)
    first = model._process
    model._owner = -1  # as in a fork, which has another process id
    assert model.run(ROW + 1, "q").tolist() == [[-1, -1]]
    assert model._process.pid != first.pid
    assert is_alive(first.pid)
    worker_model._end(first, os.getpid())


# --- what is checked before a model is loaded ---


def external(path: Path, location: str, count: int = 2) -> Path:
    """A model with weights in another file."""
    tensor = TensorProto(name="w", data_type=FLOAT, dims=[count])
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value=location)
    return saved(path, [helper.make_node("Add", ["o", "w"], ["q"])], [tensor])


def refusal(path: Path) -> str:
    with pytest.raises(ValueError, match=r"^[^\n]*$") as said:
        onnx_worker._check(str(path))
    return str(said.value)


def test_weights_in_a_pipe_a_device_or_a_folder_are_never_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name in ("pipe", "folder", "zero"):
        path = external(tmp_path / "m.onnx", name)
        assert refusal(path) == f"weights in {name}: must be a regular file"
    assert "no such file" in refusal(external(tmp_path / "m.onnx", "gone"))


@pytest.mark.parametrize("location", ["/etc/passwd", "../other/w", "", "a/../../w"])
def test_weights_outside_the_folder_of_the_model_are_refused(tmp_path, location):
    path = external(tmp_path / "m.onnx", location)
    assert refusal(path) == f"weights in {location!r}: must be in the model's folder"


def test_weights_in_another_file_count_once(tmp_path):
    with (tmp_path / "w").open("wb") as file:
        file.truncate(512 * MIB)
    assert "bytes of weights, must be at most 536870912" in refusal(
        external(tmp_path / "m.onnx", "w")
    )
    with (tmp_path / "w").open("wb") as file:
        file.truncate(300 * MIB)
    path = external(tmp_path / "m.onnx", "w")
    twice = onnx.load(path, load_external_data=False)
    twice.graph.initializer.append(twice.graph.initializer[0])
    path.write_bytes(twice.SerializeToString())
    onnx_worker._check(str(path))


def test_nodes_and_tensors_of_nested_graphs_count(tmp_path, monkeypatch):
    path = looping(tmp_path / "m.onnx")  # 3 nodes and 2 in the loop; one constant tensor
    onnx_worker._check(str(path))
    monkeypatch.setattr("touchdown.core.limits.ONNX_NODES", 4)
    assert refusal(path) == "has more than 4 nodes or 100000 tensors"
    monkeypatch.setattr("touchdown.core.limits.ONNX_NODES", 5)
    onnx_worker._check(str(path))
    monkeypatch.setattr("touchdown.core.limits.ONNX_TENSORS", 0)
    assert refusal(path) == "has more than 5 nodes or 0 tensors"


def test_what_a_worker_answers_is_checked(tmp_path):
    """A worker that a model has taken over may send anything."""
    model = WorkerModel(looping(tmp_path / "m.onnx"))
    sizes = onnx_worker.SIZES.pack(1 << 31, 0)
    for answer in (sizes, onnx_worker.SIZES.pack(1, 0) + b"{", b""):
        reader, writer = os.pipe()
        os.write(writer, answer)
        os.close(writer)
        with os.fdopen(reader, "rb") as pipe, pytest.MonkeyPatch.context() as patch:
            patch.setattr(model._process, "stdout", pipe)
            patch.setattr(model, "_end", lambda: None)
            patch.setattr(model._process, "wait", lambda **_: 1)
            with pytest.raises(UserError, match=r"ended the process .*\(exit status 1\)"):
                model._receive("compute an action", 1.0)
