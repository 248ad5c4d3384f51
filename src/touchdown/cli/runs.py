"""The verbs that inspect runs: `runs`, `show` and `compare`."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from touchdown.cli.arguments import DEFAULT_RESULTS, DEFAULT_RUNS, Force, Json, RunName, RunsDir
from touchdown.cli.printing import print_indented, print_json, print_line

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Runs:
    """List the runs in a folder."""

    json: Json = False
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `runs.run.list_facts`."""
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.runs.run import list_facts  # noqa: PLC0415 - heavy libraries load when used

        facts = list_facts(self.runs_dir)
        if self.json:
            print_json(facts)
            return
        if facts:
            console.print(tables.runs_table(facts, console.width))
            print_indented(console, [run["error"] for run in facts if run["status"] == "broken"])
        else:
            console.print(f"no runs in {self.runs_dir}; start one: touchdown train")
        of_studies = self.runs_dir / DEFAULT_RESULTS.name / "runs"
        if (
            of_studies.is_dir()
        ):  # named by digest, and often hundreds, so they are a list of their own
            where = shlex.quote(str(of_studies))
            print_line(console, f"runs of studies: touchdown runs --runs-dir {where}")


@dataclass(frozen=True, kw_only=True)
class Show:
    """Show one run: its results, the paths of its pictures, and its settings."""

    name: Annotated[Positional[RunName], arg(metavar="RUN")]
    json: Json = False
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.runs.show`."""
        from touchdown.api import runs  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.config import toml  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.config.config import usable_toml  # noqa: PLC0415 - as above
        from touchdown.evaluation import table  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.runs.run import (  # noqa: PLC0415 - heavy libraries load when used
            evaluations_of,
            run_facts,
        )

        run = runs.show(self.name, self.runs_dir)
        facts = run_facts(run)
        pictures = [str(path) for path in run.pictures]
        if self.json:
            print_json({**facts, "config": toml.to_dict(run.config), "pictures": pictures})
            return
        console.print(tables.runs_table([facts], console.width))
        evaluated = evaluations_of(run)
        if evaluated:
            console.print(table.evaluation_table(evaluated))
        print_indented(console, pictures)
        print_line(console, f"\n{usable_toml(run.config).rstrip()}")


@dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare runs on one page; the first run is the baseline."""

    names: Annotated[
        Positional[tuple[str, ...]],
        arg(
            metavar="RUN [RUN ...]",
            help="Names or folders of runs; runs that differ only in their seed are grouped.",
        ),
    ]
    out: Annotated[Path, arg(metavar="FOLDER", help="Folder for the page.")] = Path("comparison")
    force: Force = False
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.studies.compare`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used

        page = studies.compare(
            self.names, out=self.out, force=self.force, runs_dir=self.runs_dir, console=console
        )
        if len(self.names) == 1:
            print_line(console, "the page shows one run; name several to compare them")
        print_indented(console, [page])
