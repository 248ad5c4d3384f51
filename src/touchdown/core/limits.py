"""Limits on files from strangers: on their bytes, and on the memory and time that they may take.

A file that exceeds a limit is refused with a message that states the limit. The limits are far
above what policies and records need, and low enough for a small machine.
"""

from dataclasses import dataclass

KIB, MIB, GIB = 1 << 10, 1 << 20, 1 << 30

# --- text ---

TOML_BYTES = 4 * MIB
"""A config, a study file, gains."""
RECORD_BYTES = 2 * GIB
"""A JSON or JSON Lines file of a run: 20 million episodes."""
PICTURE_BYTES = 256 * MIB
"""A picture or a film of a run, for a report."""

# --- safetensors ---

TENSORS_HEADER_BYTES = 16 * MIB
"""Names, shapes and metadata in a safetensors file."""
WEIGHTS_BYTES = 512 * MIB
"""A file of a policy's weights."""
WEIGHTS_TEXT_BYTES = MIB
"""One text in its metadata, such as the description of the network."""
WEIGHTS_TENSORS = 10_000
"""Arrays in it."""
LAYERS = 100
"""Hidden layers of a network; each adds to the time of compilation."""

# --- archives of Stable-Baselines3 and PyTorch ---

ARCHIVE_BYTES = 128 * MIB
"""An archive, and each member that is read."""
ARCHIVE_MEMBERS = 10_000
ARCHIVE_FACTS_BYTES = 16 * MIB
"""`data` of Stable-Baselines3, of which only the needed fields are read."""
PICKLE_BYTES = MIB
"""A pickle, which is interpreted and never executed: a network of a thousand layers needs less."""
PICKLE_NUMBERS = 1 << 24
"""Numbers in all arrays of a PyTorch file together."""
ARRAY_DIMENSIONS = 8

# --- ONNX ---

ONNX_BYTES = 512 * MIB
"""A model, including its weights in other files."""
ONNX_NODES = 100_000
"""Nodes, including those of nested graphs and functions."""
ONNX_TENSORS = 100_000
"""Constant tensors."""
ONNX_ROWS = 1_024
"""Observations in one call of a model with a fixed number of them."""
ONNX_RESULT_BYTES = 16 * MIB
"""Values or actions from one call."""


@dataclass(frozen=True, slots=True)
class WorkerLimits:
    """Limits of the process that runs an ONNX model."""

    memory: int = 4 * GIB
    """Address space in bytes. macOS does not enforce it."""
    load_seconds: float = 60.0
    """Wall-clock time to load the model."""
    act_seconds: float = 10.0
    """Wall-clock time of one call, for up to `ONNX_ROWS` observations."""
