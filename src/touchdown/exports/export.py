"""Exports a policy to a folder: the model, its card, and an example program."""

import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal, cast, get_args

from touchdown.agents.models import Network
from touchdown.agents.qtable import QTable
from touchdown.core import files, limits, reading
from touchdown.core.errors import UserError
from touchdown.core.names import hint
from touchdown.core.terminal import printable
from touchdown.core.version import __version__
from touchdown.exports import agreement as agreements
from touchdown.exports import graph
from touchdown.exports.agreement import Agreement
from touchdown.exports.card import model_card
from touchdown.exports.source import Source
from touchdown.lander import rules
from touchdown.policies import weights as policy_weights
from touchdown.policies.foreign.onnx_session import Session
from touchdown.policies.weights import Weights

Format = Literal["onnx", "safetensors"]
CARD, EXAMPLE, FILM = "README.md", "fly_onnx.py", "flight.gif"


@dataclass(frozen=True, slots=True)
class Export:
    """The files of an export."""

    folder: Path
    files: tuple[Path, ...]
    """The model first."""
    agreement: Agreement | None
    """Agreement of an ONNX model with its policy; None for other formats."""
    note: str = ""
    """What a user should know about the exported policy; "" if nothing."""


def write_export(
    source: Source, file_format: Format, out: Path | None = None, *, force: bool = False
) -> Export:
    """Export a policy to a new folder, which is written completely or not at all.

    Args:
        source: the policy.
        file_format: `onnx`, or `safetensors`, the format of a run's weights.
        out: folder to create; None uses `<name>-<format>` in the current folder.
        force: whether to replace the files of an earlier export in an existing folder.

    Raises:
        UserError: the folder exists already or cannot be written, the policy's files are broken, a
            library is not installed, or the model does not act like the policy.
    """
    if file_format not in get_args(Format):
        raise UserError(f"format {file_format!r}: {hint(file_format, get_args(Format))}")
    folder = out if out is not None else Path(f"{source.name}-{file_format}")
    files.check_new(folder, force=force)
    if file_format == "onnx":
        graph.check_installed()
    weights = policy_weights.read_weights(source.weights)
    if file_format == "onnx" and weights.model is None:
        raise UserError(
            f"format 'onnx': the policy of algorithm {source.config.algorithm!r} is its own code, "
            "which no ONNX graph describes; choose safetensors"
        )
    name = f"{source.name}.{file_format}"
    agreement, content = None, dict[str, bytes]()
    if file_format == "onnx":
        content[name], agreement = _checked_onnx(source, weights)
        example = resources.files("touchdown.exports") / EXAMPLE
        content[EXAMPLE] = example.read_bytes()
    else:
        content[name] = reading.read_bytes(source.weights, limits.WEIGHTS_BYTES)
    film = source.film()
    if film is not None:
        content[FILM] = film
    card = model_card(source, weights.spaces, name, agreement, FILM if film is not None else "")
    content[CARD] = card.encode()

    with files.complete_folder(folder) as temporary:
        for each, data in content.items():
            (temporary / each).write_bytes(data)
    note = ""
    if source.resume:
        note = (
            f"run {source.name!r} is not finished: these are its best weights so far; "
            f"finish it with: {source.resume}"
        )
    return Export(folder, tuple(folder / each for each in content), agreement, note)


def _made_by(env_id: str) -> dict[str, str]:
    """How Gymnasium alone makes a variant of the lander; nothing for other environments."""
    settings = rules.settings_of(env_id)
    if not settings:
        return {}
    return {"gymnasium_id": rules.LANDER_ID, "gymnasium_settings": json.dumps(settings)}


def _checked_onnx(source: Source, weights: Weights) -> tuple[bytes, Agreement]:
    model, spaces = cast("Network | QTable", weights.model), weights.spaces
    config = source.config
    metadata = {
        "env_id": weights.env_id,
        **_made_by(weights.env_id),
        "run": printable(source.name),
        "preset": config.preset,
        "seed": str(config.seed),
        "config_digest": config.digest,
        "touchdown": __version__,
        **{name: json.dumps(value) for name, value in model.describe().items()},
    }
    data = graph.onnx_model(
        model, weights.params, spaces.observation_size, spaces.num_actions, metadata
    )
    policy = model.policy(weights.params)
    seen = agreements.seen_in_flight(policy, weights.env_id)
    largest_term = 0.0
    if not isinstance(model, QTable) and model.config.atoms:
        largest_term = max(abs(model.config.v_min), abs(model.config.v_max))
    # in this process, as no stranger has made it
    return data, agreements.check(Session(data), policy, seen, largest_term)
