"""Checkpoints changed as a careful hand would change them: with the right SHA-256."""

import hashlib
import json
from pathlib import Path
from typing import Any


def write_state(checkpoint: Path, state: Any) -> None:
    """Write `state.json` of a checkpoint, and its SHA-256."""
    data = json.dumps(state).encode()
    (checkpoint / "state.json").write_bytes(data)
    digest = hashlib.sha256(data).hexdigest()
    (checkpoint / "state.sha256").write_text(f"{digest}  state.json\n")


def read_state(checkpoint: Path) -> Any:
    """`state.json` of a checkpoint."""
    return json.loads((checkpoint / "state.json").read_text())
