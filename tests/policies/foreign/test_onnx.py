import os
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from numpy.testing import assert_array_equal
from onnx import TensorProto, helper

from touchdown.core.errors import UserError
from touchdown.core.types import Spaces
from touchdown.policies.foreign import onnx_worker
from touchdown.policies.foreign.onnx import OnnxPolicy, read_onnx
from touchdown.policies.foreign.onnx_session import Session
from touchdown.policies.foreign.worker_model import Input, Result

SPACES = Spaces(observation_size=2, num_actions=3)
WEIGHTS = np.array([[1, 0], [0, 1], [-1, -1]], np.float32)  # Q of o is o₀, o₁ and −o₀ − o₁
OBSERVATIONS = np.array([[5, 1], [1, 5], [-1, -2], [2, 2]], np.float32)
BEST = [0, 1, 2, 0]
FLOAT, INT64 = TensorProto.FLOAT, TensorProto.INT64

Shape = list[int | str]


def model(
    nodes: list[Any],
    outputs: dict[str, tuple[int, Shape]],
    inputs: dict[str, tuple[int, Shape]] | None = None,
    **metadata: str,
) -> bytes:
    """A model of WEIGHTS and these nodes; its input is `o`, [N, 2], by default."""

    def described(values: dict[str, tuple[int, Shape]]) -> list[Any]:
        return [helper.make_tensor_value_info(name, *value) for name, value in values.items()]

    graph = helper.make_graph(
        nodes,
        "test",
        described(inputs or {"o": (FLOAT, ["N", 2])}),
        described(outputs),
        [onnx.numpy_helper.from_array(WEIGHTS.T.copy(), "w")],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(made, metadata)
    return made.SerializeToString()


VALUES = helper.make_node("MatMul", ["o", "w"], ["q"])
CHOICE = helper.make_node("ArgMax", ["q"], ["a"], axis=1, keepdims=0)
COLUMN = helper.make_node("ArgMax", ["q"], ["a"], axis=1, keepdims=1)


@contextmanager
def refused():
    try:
        yield
    except ValueError as error:
        raise UserError(f"m.onnx: {error}") from None


class InThisProcess:
    """A model as its worker has it, without the second that a process needs to start."""

    def __init__(self, data: bytes) -> None:
        with refused():
            self._session = Session(data)
        self.inputs = [Input(port.type, port.shape) for port in self._session.inputs]

    def results(self, observations):
        with refused():
            answer, _ = onnx_worker._run(self._session, observations, None)
        return [Result(*each) for each in answer["results"]]

    def run(self, observations, output):
        with refused():
            return onnx_worker._run(self._session, observations, output)[1]


def policy(data: bytes, spaces: Spaces = SPACES) -> OnnxPolicy:
    return OnnxPolicy(InThisProcess(data), spaces, "m.onnx")


def refusal(data: bytes, spaces: Spaces = SPACES) -> str:
    with pytest.raises(UserError) as said:
        policy(data, spaces)
    assert "\n" not in str(said.value)
    return str(said.value)


@pytest.mark.parametrize(
    "data",
    [
        model([VALUES], {"q": (FLOAT, ["N", 3])}),
        model([VALUES], {"q": (FLOAT, [1, 3])}, {"o": (FLOAT, [1, 2])}),
        model([VALUES], {"q": (FLOAT, [3, 3])}, {"o": (FLOAT, [3, 2])}),
        model([VALUES], {"q": (FLOAT, ["N", "A"])}, {"o": (FLOAT, ["N", "D"])}),
        model([VALUES, CHOICE], {"a": (INT64, ["N"])}),
        model([VALUES, COLUMN], {"a": (INT64, ["N", 1])}),
        model([VALUES, CHOICE], {"a": (INT64, ["N"]), "q": (FLOAT, ["N", 3])}),
    ],
)
def test_a_policy_follows_the_values_or_the_actions_of_its_model(data):
    flown = policy(data)
    assert flown.act(OBSERVATIONS).tolist() == BEST
    assert flown.act(OBSERVATIONS[1:2]).tolist() == BEST[1:2]
    assert flown.act(np.repeat(OBSERVATIONS, 20, axis=0)).tolist() == np.repeat(BEST, 20).tolist()


def test_outputs_that_are_not_values_of_actions_are_ignored():
    """An actor-critic model also gives the value of the state, [N, 1], as its first output."""
    state = helper.make_node("ReduceMax", ["q"], ["v"], axes=[1], keepdims=1)
    data = model([VALUES, state], {"v": (FLOAT, ["N", 1]), "q": (FLOAT, ["N", 3])})
    assert policy(data).act(OBSERVATIONS).tolist() == BEST


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (
            model([VALUES], {"q": (FLOAT, ["N", 3])}, {"o": (TensorProto.DOUBLE, ["N", 2])}),
            "not a complete ONNX model",
        ),
        (
            model(
                [helper.make_node("Add", ["o", "p"], ["q"])],
                {"q": (FLOAT, ["N", 3])},
                {"o": (FLOAT, ["N", 3]), "p": (FLOAT, ["N", 3])},
            ),
            "its inputs are tensor(float) ['N', 3], tensor(float) ['N', 3]; must be one tensor",
        ),
        (
            model(
                [helper.make_node("Cast", ["i"], ["o"], to=FLOAT), VALUES],
                {"q": (FLOAT, ["N", 3])},
                {"i": (INT64, ["N", 2])},
            ),
            "its inputs are tensor(int64) ['N', 2]; must be one tensor(float) [N, 2]",
        ),
        (
            model(
                [helper.make_node("Flatten", ["i"], ["q"])],
                {"q": (FLOAT, ["N", 3])},
                {"i": (FLOAT, ["N", 3, 1])},
            ),
            "its inputs are tensor(float) ['N', 3, 1]; must be one",
        ),
        (
            model(
                [helper.make_node("Identity", ["o"], ["q"])],
                {"q": (FLOAT, ["N", 3])},
                {"o": (FLOAT, ["N", 3])},
            ),
            "takes observations of 3 numbers, but the environment has 2",
        ),
        (
            model([VALUES], {"q": (FLOAT, [2_000, 3])}, {"o": (FLOAT, [2_000, 2])}),
            "takes 2000 observations, must be from 1 to 1024",
        ),
        (
            model([helper.make_node("Identity", ["o"], ["q"])], {"q": (FLOAT, ["N", 2])}),
            "returns q float32[32, 2] for 32 observations, must be values [N, 3] or actions [N]",
        ),
        (b"no model", "m.onnx: not a complete ONNX model"),
        (b"", "m.onnx: not a complete ONNX model"),
    ],
)
def test_a_model_of_other_shapes_is_refused(data, said):
    assert said in refusal(data)


def test_a_model_cut_off_anywhere_is_refused_or_whole():
    data = model([VALUES], {"q": (FLOAT, ["N", 3])})
    for length in range(len(data) - 1):
        with pytest.raises(UserError):
            policy(data[:length])


def test_an_action_that_the_environment_does_not_have_is_refused():
    data = model([VALUES, CHOICE], {"a": (INT64, ["N"])})
    flown = policy(data, Spaces(observation_size=2, num_actions=2))
    assert flown.act(OBSERVATIONS[:2]).tolist() == [0, 1]
    with pytest.raises(UserError, match=r"m\.onnx: action 2: must be from 0 to 1"):
        flown.act(OBSERVATIONS)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_refused(value):
    flown = policy(model([VALUES], {"q": (FLOAT, ["N", 3])}))
    with pytest.raises(
        UserError, match=rf"m\.onnx: value -?{abs(value)} of an action: must be fin"
    ):
        flown.act(np.array([[1, 1], [value, 0]], np.float32))


def test_an_output_that_changes_its_shape_is_refused():
    """The trial call is with zeros, for which this model gives [N, 3]; for others it gives less."""
    nodes = [
        VALUES,
        helper.make_node("ReduceSum", ["o"], ["s"], keepdims=0),
        helper.make_node("Constant", [], ["zero"], value_float=0.0),
        helper.make_node("Equal", ["s", "zero"], ["is_zero"]),
        helper.make_node("Constant", [], ["one"], value_ints=[1]),
        helper.make_node("Reshape", ["is_zero", "one"], ["flag"]),
        helper.make_node("Constant", [], ["others"], value_ints=[1] * 31),
        helper.make_node("Cast", ["others"], ["kept"], to=TensorProto.BOOL),
        helper.make_node("Concat", ["flag", "kept"], ["rows"], axis=0),
        helper.make_node("Compress", ["q", "rows"], ["some"], axis=0),
    ]
    flown = policy(model(nodes, {"some": (FLOAT, ["M", 3])}))
    with pytest.raises(
        UserError, match=r"returns some float32\[31, 3\], and for other .*\[32, 3\]"
    ):
        flown.act(OBSERVATIONS)


def test_a_model_that_cannot_be_computed_says_so():
    reshape = helper.make_node("Reshape", ["o", "s"], ["r"])
    seven = helper.make_node("Constant", [], ["s"], value_ints=[7, 2])
    data = model([seven, reshape], {"r": (FLOAT, [7, 2])})
    assert "m.onnx: cannot be computed: " in refusal(data)


def test_an_action_does_not_depend_on_the_other_observations():
    rng = np.random.default_rng(0)
    weights = rng.normal(size=(2, 3)).astype(np.float32)
    many = np.random.default_rng(1).normal(size=(70, 2)).astype(np.float32)
    node = helper.make_node("MatMul", ["o", "x"], ["q"])
    constant = helper.make_node(
        "Constant", [], ["x"], value=onnx.numpy_helper.from_array(weights, "x")
    )
    flown = policy(model([constant, node], {"q": (FLOAT, ["N", 3])}))
    alone = [flown.act(row[None])[0] for row in many]
    assert_array_equal(flown.act(many), alone)
    assert_array_equal(alone, (many @ weights).argmax(axis=1))


def cart(path: Path, **metadata: str) -> Path:
    """A model for CartPole-v1: right where the pole leans right."""
    weights = np.array([[0, 0], [0, 0], [-1, 1], [0, 0]], np.float32)
    nodes = [
        helper.make_node("Constant", [], ["x"], value=onnx.numpy_helper.from_array(weights, "x")),
        helper.make_node("MatMul", ["o", "x"], ["q"]),
    ]
    path.write_bytes(model(nodes, {"q": (FLOAT, ["N", 2])}, {"o": (FLOAT, ["N", 4])}, **metadata))
    return path


def test_the_environment_is_the_one_that_the_model_names_or_else_the_given_one(tmp_path):
    named = cart(tmp_path / "named.onnx", env_id="CartPole-v1")
    assert read_onnx(named, "LunarLander-v3")[1] == "CartPole-v1"
    flown, env_id = read_onnx(cart(tmp_path / "cart.onnx"), "CartPole-v1")
    assert env_id == "CartPole-v1"
    assert flown.act(np.array([[9, 9, -0.1, 9], [-9, -9, 0.1, -9]])).tolist() == [0, 1]


def test_weights_in_a_file_beside_the_model_are_found(tmp_path):
    made = onnx.load(cart(tmp_path / "whole.onnx"))
    (constant, _) = made.graph.node
    made.graph.initializer.append(constant.attribute[0].t)
    made.graph.initializer[-1].name = "x"
    made.graph.node.remove(constant)
    onnx.save(
        made,
        tmp_path / "cart.onnx",
        save_as_external_data=True,
        location="cart.data",
        size_threshold=0,
    )
    flown, _ = read_onnx(tmp_path / "cart.onnx", "CartPole-v1")
    assert flown.act(np.array([[9, 9, -0.1, 9], [-9, -9, 0.1, -9]])).tolist() == [0, 1]
    (tmp_path / "cart.data").unlink()
    with pytest.raises(UserError, match="not a complete ONNX model"):
        read_onnx(tmp_path / "cart.onnx", "CartPole-v1")


def test_a_file_cannot_cause_an_import(tmp_path, monkeypatch):
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    path = cart(tmp_path / "evil.onnx", env_id="evil:CartPole-v1")
    with pytest.raises(UserError, match="'evil:CartPole-v1': names code that would be imported"):
        read_onnx(path, "LunarLander-v3")


@pytest.mark.parametrize("package", ["onnx", "onnxruntime"])
def test_without_a_package_it_says_what_to_install(tmp_path, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UserError, match=f"needs {package}, which is not installed; "):
        read_onnx(cart(tmp_path / "cart.onnx"), "CartPole-v1")


@pytest.mark.parametrize(("given", "seen"), [({}, "1"), ({"ORT_DISABLE_TELEMETRY": "0"}, "0")])
def test_telemetry_is_off_before_the_first_import_unless_it_is_asked_for(
    tmp_path, monkeypatch, given, seen
):
    code = "import os; raise RuntimeError(os.environ['ORT_DISABLE_TELEMETRY'])"
    (tmp_path / "onnxruntime.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    del sys.modules["onnxruntime"]
    monkeypatch.setattr(os, "environ", given)
    with pytest.raises(RuntimeError, match=seen):
        Session(b"")
