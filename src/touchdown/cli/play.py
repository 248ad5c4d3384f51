"""The verb `play`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from touchdown.cli.arguments import DEFAULT_RUNS, Force, RunsDir
from touchdown.cli.printing import print_indented

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Play:
    """Fly the lander yourself and race policies, on a page in your browser."""

    policies: Annotated[
        Positional[tuple[str, ...]],
        arg(
            metavar="[POLICY ...]",
            help="Policies to race besides ace, pid and heuristic: names or folders of runs, "
            "random, or files ending in .safetensors or .toml. The first one flies when the page "
            "opens.",
        ),
    ] = ()
    out: Annotated[
        Path | None,
        arg(
            metavar="FILE",
            help="The .html file to write; without it, playground.html, which replaces an earlier "
            "playground.",
        ),
    ] = None
    force: Force = False
    seed: Annotated[int, arg(help="Environment seed of the first start.")] = 7
    browser: Annotated[bool, arg(help="Open the page in a browser.")] = True
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.playing.play`."""
        from touchdown.api import playing  # noqa: PLC0415 - heavy libraries load when used

        path = playing.play(
            *self.policies,
            out=self.out,
            force=self.force,
            seed=self.seed,
            browser=self.browser,
            runs_dir=self.runs_dir,
        )
        print_indented(console, [path])
