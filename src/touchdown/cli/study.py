"""The verbs `study run`, `status`, `report`, `list`, `export`, `import` and `check`."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from touchdown.cli.arguments import (
    DEFAULT_RESULTS,
    Force,
    Json,
    LastScale,
    LastSeeds,
    ResultsDir,
    Scale,
    Seeds,
    StudyName,
    Trust,
)
from touchdown.cli.printing import print_indented, print_json, print_line
from touchdown.core.errors import UserError

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class StudyRun:
    """Run a study. Finished runs are kept, so the same command resumes a stopped study."""

    name: Positional[StudyName]
    scale: Scale = "quick"
    seeds: Seeds = None
    on: Annotated[
        str,
        arg(
            metavar="local|ray|ray://…",
            help="Where to run: in worker processes on this machine, on the Ray cluster that it "
            "belongs to, or on a remote one (Ray needs the extra ray).",
        ),
    ] = "local"
    workers: Annotated[
        int | None, arg(help="Number of parallel runs; without it, one per core.")
    ] = None
    until_decided: Annotated[
        bool,
        arg(
            help="Run from one of the study's looks to the next, with more seeds only where a "
            "claim is still open, until each claim is decided or given up."
        ),
    ] = False
    dry_run: Annotated[
        bool,
        arg(help="Only print which runs are missing and an estimate of their time, measured here."),
    ] = False
    trust: Trust = False
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.estimate_study` and `api.studies.run_study`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import progress  # noqa: PLC0415 - heavy libraries load when used

        if self.dry_run or self.scale == "full":
            estimated = studies.estimate_study(
                self.name,
                scale=self.scale,
                seeds=self.seeds,
                until_decided=self.until_decided,
                workers=self.workers,
                results_dir=self.results_dir,
                console=console,
            )
            print_line(console, estimated)
        if self.dry_run:
            return
        began = time.monotonic()
        state = studies.run_study(
            self.name,
            scale=self.scale,
            seeds=self.seeds,
            until_decided=self.until_decided,
            executor=studies.executor_of(self.on, self.workers),
            results_dir=self.results_dir,
            console=console,
        )
        took = progress.clock(time.monotonic() - began)
        console.print(f"{state.done} of {state.total} runs are done, in {took}", markup=False)
        if state.failed:
            raise UserError(
                f"{len(state.failed)} runs failed; `touchdown study status` names them, and the "
                "same command tries them again"
            )


@dataclass(frozen=True, kw_only=True)
class StudyStatus:
    """Show the progress of each study, and which runs failed and why."""

    name: Annotated[
        Positional[str | None],
        arg(metavar="[NAME]", help="Name of a study; without it, all started studies."),
    ] = None
    scale: LastScale = None
    seeds: LastSeeds = None
    json: Json = False
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.study_status`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used

        found = studies.study_status(
            self.name, scale=self.scale, seeds=self.seeds, results_dir=self.results_dir
        )
        if self.json:
            print_json([each.to_dict() for each in found])
            return
        console.print(tables.studies_table(found))
        for each in found:
            print_indented(console, [f"{name}: {why}" for name, why in each.failed.items()])
            if each.error is not None:
                print_indented(console, [f"{each.name}: {each.error}"])
        for command in dict.fromkeys(each.command for each in found if each.command):
            print_line(console, f"run the rest: {command}")


@dataclass(frozen=True, kw_only=True)
class StudyReport:
    """Write a study's page: figures, a verdict on each claim, flights and tables."""

    name: Annotated[
        Positional[str | None],
        arg(metavar="[NAME]", help="Name of a study; without it, the only started one."),
    ] = None
    scale: LastScale = None
    seeds: LastSeeds = None
    out: Annotated[
        Path | None,
        arg(
            metavar="FOLDER",
            help="Folder for the page; without it, reports/NAME in the results folder.",
        ),
    ] = None
    force: Force = False
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.study_report`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used

        report = studies.study_report(
            self.name,
            scale=self.scale,
            seeds=self.seeds,
            out=self.out,
            force=self.force,
            results_dir=self.results_dir,
            console=console,
        )
        if report.decisions:
            console.print(tables.claims_table(report.decisions))
        print_indented(console, [report.page])
        missing = sum(each.missing for each in report.results.values())
        if missing:
            planned = sum(each.planned for each in report.results.values())
            print_line(
                console,
                f"{missing} of {planned} runs are not done; `study run` continues them",
            )


@dataclass(frozen=True, kw_only=True)
class StudyList:
    """List the paper's studies with their questions and numbers of runs and claims."""

    scale: Scale = "quick"
    json: Json = False

    def run(self, console: "Console") -> None:
        """Call `api.studies.list_studies`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used

        found = studies.list_studies(self.scale)
        if self.json:
            print_json([each.to_dict() for each in found])
        else:
            console.print(tables.topics_table(found))


@dataclass(frozen=True, kw_only=True)
class StudyExport:
    """Write the results of a study's runs to one file, to continue the study elsewhere."""

    name: Positional[StudyName]
    out: Annotated[Path, arg(metavar="FILE.jsonl", help="The file.")]
    scale: LastScale = None
    force: Force = False
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.export_results`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used

        count = studies.export_results(
            self.name,
            self.out,
            scale=self.scale,
            force=self.force,
            results_dir=self.results_dir,
        )
        console.print(f"results of {count} runs:", markup=False)
        print_indented(console, [self.out])


@dataclass(frozen=True, kw_only=True)
class StudyImport:
    """Add results from `study export`; the study then continues with the remaining runs."""

    file: Annotated[Positional[Path], arg(metavar="FILE.jsonl", help="A file from `study export`.")]
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.import_results`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used

        found = studies.import_results(self.file, results_dir=self.results_dir)
        print_line(console, f"{found.added} runs added, {found.known} were there already")


@dataclass(frozen=True, kw_only=True)
class StudyCheck:
    """Simulate how often the tests, intervals and verdicts of studies are wrong."""

    repetitions: Annotated[
        int, arg(help="Simulated data sets of each row; slow procedures get a share of them.")
    ] = 20_000
    seed: Annotated[int, arg(help="Seed of the simulation.")] = 0
    out: Annotated[
        Path | None,
        arg(
            metavar="FILE.md",
            help="Markdown file for the tables; the rows are written beside it as CSV.",
        ),
    ] = None
    force: Force = False

    def run(self, console: "Console") -> None:
        """Call `api.studies.check_statistics`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used

        rows = studies.check_statistics(
            repetitions=self.repetitions,
            seed=self.seed,
            out=self.out,
            force=self.force,
            console=console,
        )
        console.print(tables.check_table(rows))
        if self.out is not None:
            print_indented(console, [self.out, self.out.with_suffix(".csv")])
