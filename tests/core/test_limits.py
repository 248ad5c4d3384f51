from pathlib import Path

import pytest

from touchdown.core import limits
from touchdown.core.limits import MIB, WorkerLimits

GUIDE = Path(__file__).parents[2] / "docs" / "guide.md"
BOUNDS = WorkerLimits()


@pytest.mark.parametrize(
    "row",
    [
        f"a `.toml` | {limits.TOML_BYTES // MIB} MiB",
        f"a record (`.json`, `.jsonl`) | {limits.RECORD_BYTES // limits.GIB} GiB",
        (
            f"a `.safetensors` of a policy | {limits.WEIGHTS_BYTES // MIB} MiB, "
            f"{limits.WEIGHTS_TENSORS:,} arrays, {limits.WEIGHTS_TEXT_BYTES // MIB} MiB for each "
            "text"
        ),
        f"the header of any `.safetensors` | {limits.TENSORS_HEADER_BYTES // MIB} MiB",
        f"hidden layers | {limits.LAYERS}",
        (
            "a `.zip`, `.pth`, `.pt` or `.cleanrl_model`, and each member | "
            f"{limits.ARCHIVE_BYTES // MIB} MiB, {limits.ARCHIVE_MEMBERS:,} members"
        ),
        f"`data` of Stable-Baselines3 | {limits.ARCHIVE_FACTS_BYTES // MIB} MiB, of which",
        f"a pickle that is interpreted | {limits.PICKLE_BYTES // MIB} MiB",
        f"the arrays of a PyTorch file | {limits.PICKLE_NUMBERS:,} numbers",
        (
            f"an `.onnx` with the files of its weights | {limits.ONNX_BYTES // MIB} MiB, "
            f"{limits.ONNX_NODES:,} nodes, {limits.ONNX_TENSORS:,} tensors"
        ),
        f"memory of an ONNX model | {BOUNDS.memory // MIB:,} MiB of address space",
        (
            f"time of an ONNX model | {BOUNDS.load_seconds:g} seconds to load, "
            f"{BOUNDS.act_seconds:g} seconds for each call"
        ),
        f"values or actions from a call | {limits.ONNX_RESULT_BYTES // MIB} MiB",
    ],
)
def test_the_guide_shows_each_limit_as_it_is(row):
    assert f"| {row}" in GUIDE.read_text("utf-8")
