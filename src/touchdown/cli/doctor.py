"""The verb `doctor`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from touchdown.cli.arguments import DEFAULT_RUNS, Json, RunsDir
from touchdown.cli.printing import print_json
from touchdown.core.errors import UserError

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check the installation and say how to fix problems; exit code 2 if a check fails."""

    json: Json = False
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.doctor.check_up`."""
        from touchdown.api import doctor  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.cli import tables  # noqa: PLC0415 - heavy libraries load when used

        findings = doctor.check_up(self.runs_dir)
        if self.json:
            print_json([finding.to_dict() for finding in findings])
        else:
            console.print(tables.findings_table(findings))
        bad = [finding.name for finding in findings if finding.state == "bad"]
        if bad:
            raise UserError(f"{', '.join(bad)}: will not work; the table says how to fix it")
