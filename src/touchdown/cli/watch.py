"""The verb `watch`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from touchdown.cli.arguments import DEFAULT_RUNS, Force, RunsDir
from touchdown.cli.printing import print_indented

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Watch:
    """Watch runs learn, on a local page; finished runs too.

    The page is served on this machine alone, until Ctrl-C.
    """

    names: Annotated[
        Positional[tuple[str, ...]],
        arg(
            metavar="[RUN ...]",
            help="Names or folders of runs, or the name of a study for all its runs; without one, "
            "a list of all runs.",
        ),
    ] = ()
    out: Annotated[
        Path | None,
        arg(metavar="FILE", help="An .html file to write instead; it opens without a server."),
    ] = None
    force: Force = False
    port: Annotated[int, arg(help="Port of the page; 0 takes a free one.")] = 0
    browser: Annotated[bool, arg(help="Open the page in a browser.")] = True
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.watching.watch`."""
        from touchdown.api import watching  # noqa: PLC0415 - heavy libraries load when used

        written = watching.watch(
            self.names,
            runs_dir=self.runs_dir,
            port=self.port,
            out=self.out,
            force=self.force,
            browser=self.browser,
            console=console,
        )
        if written is not None:
            print_indented(console, [written])
