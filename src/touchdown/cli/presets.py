"""The verb `presets`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from touchdown.cli import helps
from touchdown.cli.arguments import Json
from touchdown.cli.printing import print_json, print_line
from touchdown.config import presets, toml
from touchdown.config.config import usable_toml

if TYPE_CHECKING:
    from rich.console import Console


_ALGORITHMS: Mapping[str, str] = {
    "dqn": "dqn, a network that learns from a replay memory",
    "pqn": "pqn, a network that learns from many environments",
    "tabular": "tabular, a table of action values",
    "value-iteration": "value-iteration, from the environment's own model",
}


@dataclass(frozen=True, kw_only=True)
class Presets:
    """List the presets, or show the settings of one."""

    name: Annotated[
        Positional[str | None],
        arg(
            metavar="[PRESET]", help="Preset whose settings are shown; without it, all are listed."
        ),
    ] = None
    json: Json = False

    def run(self, console: "Console") -> None:
        """List the presets, or print one as TOML."""
        if self.name is None:
            listed = [presets.summary_of(name) for name in presets.PRESETS]
            if self.json:
                print_json(listed)
            else:
                print_line(console, _listing(listed))
            return
        config = presets.preset(self.name)
        if self.json:
            print_json(toml.to_dict(config))
            return
        print_line(console, f"# {presets.DESCRIPTIONS[self.name]}")
        print_line(console, usable_toml(config))


def _listing(listed: Sequence[Mapping[str, str]]) -> str:
    """The presets by algorithm, one line each, without the sources that their pages name."""
    parts: list[str] = []
    for algorithm, title in _ALGORITHMS.items():
        rows: list[tuple[str, str]] = []
        for each in listed:
            if each["algorithm"] == algorithm:
                time = f", about {each['time']}" if each["time"] else ""
                rows.append((each["preset"], re.sub(r" \([^)]*\)$", "", each["text"]) + time))
        parts.append(helps.group(title, rows))
    return "\n\n".join(
        (*parts, "`touchdown presets NAME` shows its settings, `touchdown train NAME` trains it.")
    )
