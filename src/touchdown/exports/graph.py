"""A trained model as an ONNX graph: `observations` in, `q_values` and the greedy `action` out."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchdown.agents.models import Network
from touchdown.agents.qtable import QTable
from touchdown.agents.states import Grid
from touchdown.core import installation
from touchdown.core.types import FloatArray
from touchdown.core.version import __version__
from touchdown.policies.foreign.onnx_session import missing_package

# of 2022: old enough for most runtimes, new enough for LayerNormalization
OPSET, IR_VERSION = 17, 8
_EPSILON = 1e-5  # as in equinox's layer normalisation


def check_installed() -> None:
    """Check that the libraries for an export to ONNX are installed.

    Raises:
        UserError: onnx or onnxruntime is not installed.
    """
    missing = missing_package()
    if missing is not None:
        raise installation.missing("format 'onnx'", missing, "onnx", "choose --format safetensors")


def onnx_model(
    model: Network | QTable,
    params: FloatArray,
    observation_size: int,
    num_actions: int,
    metadata: Mapping[str, str],
) -> bytes:
    """The bytes of an ONNX file.

    Its input `observations` is float32 [N, D], for any N. Its outputs are `q_values`, float32
    [N, A], and `action`, int64 [N]: the first of the best actions.

    Args:
        model: a network (noisy weights are replaced by their means) or a table.
        params: flat parameters, [P].
        observation_size: D; Discrete observations are one-hot.
        num_actions: A.
        metadata: text to store in the file.
    """
    onnx: Any = import_module("onnx")
    helper, kinds = onnx.helper, onnx.TensorProto
    graph = _Graph(onnx)
    if isinstance(model, QTable):
        q = _table(graph, model, params)
    else:
        q = _network(graph, model, params)
    graph.add("ArgMax", q, output="action", axis=1, keepdims=0)
    # a table's values are in double precision until here
    graph.add("Cast", q, output="q_values", to=kinds.FLOAT)
    made = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "touchdown",
            [helper.make_tensor_value_info("observations", kinds.FLOAT, ["N", observation_size])],
            [
                helper.make_tensor_value_info("q_values", kinds.FLOAT, ["N", num_actions]),
                helper.make_tensor_value_info("action", kinds.INT64, ["N"]),
            ],
            graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="touchdown",
        producer_version=__version__,
    )
    helper.set_model_props(made, dict(metadata))
    onnx.checker.check_model(made, full_check=True)
    return made.SerializeToString()


class _Graph:
    """A graph under construction: nodes and constants, each with a name."""

    def __init__(self, onnx: Any) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []
        self._onnx = onnx

    def add(self, operator: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Add a node; return the name of its output."""
        name = output or f"{operator}.{len(self.nodes)}"
        self.nodes.append(self._onnx.helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(self, value: NDArray[Any], name: str = "") -> str:
        """Add a constant; return its name."""
        name = name or f"constant.{len(self.constants)}"
        self.constants.append(self._onnx.numpy_helper.from_array(np.array(value), name))
        return name

    def cast(self, name: str, dtype: type[np.generic]) -> str:
        """Add a cast to another dtype; return the name of its output."""
        to = self._onnx.helper.np_dtype_to_tensor_dtype(np.dtype(dtype))
        return self.add("Cast", name, to=to)


def _network(graph: _Graph, network: Network, params: FloatArray) -> str:
    """Q(s,·), [N, A], of a network, layer by layer."""
    config = network.config
    layers = {name: np.asarray(value) for name, value in network.layers(params).items()}
    x = "observations"
    for number in range(len(config.hidden_sizes)):
        x = _linear(graph, x, layers, f"layers.{number}")
        if config.layer_norm:
            names = [f"norms.{number}.{kind}" for kind in ("weight", "bias")]
            scale, shift = (graph.constant(layers[name], name) for name in names)
            x = graph.add("LayerNormalization", x, scale, shift, axis=-1, epsilon=_EPSILON)
        x = _activated(graph, x, config.activation)
    outputs = max(1, config.quantiles, config.atoms)
    by_action = graph.constant(np.array([0, network.num_actions, outputs]))  # 0: as in the input
    if config.dueling:
        advantage = _linear(graph, x, layers, "advantage")
        advantage = graph.add("Reshape", advantage, by_action)
        mean = graph.add("ReduceMean", advantage, axes=[1], keepdims=1)
        value = _linear(graph, x, layers, "value")
        value = graph.add("Reshape", value, graph.constant(np.array([0, 1, outputs])))
        z = graph.add("Sub", graph.add("Add", value, advantage), mean)
    else:
        x = _linear(graph, x, layers, f"layers.{len(config.hidden_sizes)}")
        z = graph.add("Reshape", x, by_action)
    if config.atoms:
        atoms = np.linspace(config.v_min, config.v_max, config.atoms, dtype=np.float32)
        support = graph.constant(atoms, "support")
        return graph.add("MatMul", graph.add("Softmax", z, axis=-1), support)
    # the value itself if there is one output
    return graph.add("ReduceMean", z, axes=[2], keepdims=0)


def _linear(graph: _Graph, x: str, layers: Mapping[str, NDArray[Any]], name: str) -> str:
    """W·x + b; the means of noisy weights have the same names as plain weights."""
    names = [f"{name}.{kind}" for kind in ("weight", "bias")]
    weight, bias = (graph.constant(layers[each], each) for each in names)
    return graph.add("Gemm", x, weight, bias, transB=1)


def _activated(graph: _Graph, x: str, activation: str) -> str:
    if activation == "silu":
        return graph.add("Mul", x, graph.add("Sigmoid", x))
    return graph.add({"relu": "Relu", "tanh": "Tanh"}[activation], x)


def _table(graph: _Graph, table: QTable, params: FloatArray) -> str:
    """Q(s,·), [N, A], looked up by the number of the state, in double precision like the table."""
    q = graph.constant(table.layers(params)["q"], "q")
    states = table.states
    if not isinstance(states, Grid):
        return graph.add("Gather", q, graph.add("ArgMax", "observations", axis=1, keepdims=0))
    low, high, bins = np.array(states.low), np.array(states.high), np.array(states.bins)
    strides = np.append(np.cumprod(bins[:0:-1])[::-1], 1)  # the last dimension varies fastest
    x = graph.cast("observations", np.double)
    x = graph.add("Max", x, graph.constant(low))
    x = graph.add("Min", x, graph.constant(high))
    x = graph.add("Sub", x, graph.constant(low))
    x = graph.add("Div", x, graph.constant(high - low))
    x = graph.add("Mul", x, graph.constant(bins.astype(np.double)))
    cells = graph.add("Min", graph.cast(x, np.int64), graph.constant(bins - 1))
    weighed = graph.add("Mul", cells, graph.constant(strides))
    axis = graph.constant(np.array([1]))
    return graph.add("Gather", q, graph.add("ReduceSum", weighed, axis, keepdims=0))
