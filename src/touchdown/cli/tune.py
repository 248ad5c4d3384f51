"""The verbs `tune pid` and `tune agent`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from touchdown.cli.arguments import DEFAULT_RESULTS, Engine, Force, ResultsDir, use_engine
from touchdown.cli.printing import print_indented, print_line

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class TunePid:
    """Tune the PID controller's gains and dead band with Twiddle, on training starts."""

    rule: Annotated[
        Literal["signed", "absolute"],
        arg(
            help="When the main engine fires: `absolute` compares the absolute vertical control "
            "value, as printed in the paper; `signed` keeps its sign."
        ),
    ] = "signed"
    starts: Annotated[int, arg(help="Training starts per trial (one episode each).")] = 200
    seed: Annotated[int, arg(help="Seed that selects the training starts.")] = 0
    tolerance: Annotated[
        float, arg(help="Stop once every step size is below this fraction of its initial value.")
    ] = 0.2
    begin: Annotated[
        Path | None,
        arg(
            metavar="FILE",
            help="TOML file of gains to start from, such as an earlier result; without it, "
            "hand-picked gains.",
        ),
    ] = None
    out: Annotated[Path, arg(metavar="FILE", help="TOML file for the gains.")] = Path("pid.toml")
    force: Force = False
    engine: Engine = None

    def run(self, console: "Console") -> None:
        """Call `api.tuning.tune_pid`."""
        from touchdown.api import tuning  # noqa: PLC0415 - heavy libraries load when used

        use_engine(self.engine)
        best = tuning.tune_pid(
            rule=self.rule,
            starts=self.starts,
            seed=self.seed,
            tolerance=self.tolerance,
            begin=self.begin,
            out=self.out,
            force=self.force,
            console=console,
        )
        console.print(f"{best}\n  {self.out}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class TuneAgent:
    """Tune a preset's hyper-parameters with Optuna, over several training seeds per trial.

    Needs the extra optuna. Tuning never uses the seeds that studies report. The same command
    resumes a stopped search.
    """

    preset: Annotated[Positional[str], arg(metavar="PRESET", help="Preset to start from.")]
    trials: Annotated[int, arg(help="Total number of trials, including earlier ones.")] = 30
    seeds: Annotated[
        int, arg(help="Training seeds per trial; a trial's value is the mean over them.")
    ] = 3
    env_steps: Annotated[
        int | None, arg(help="Environment steps per run; without it, the preset's limit.")
    ] = None
    seed: Annotated[int, arg(help="Seed of Optuna's sampler.")] = 0
    space: Annotated[
        Path | None,
        arg(
            metavar="FILE",
            help="TOML file of the settings to search, with a list of values or a range for each; "
            "without it, the settings that the algorithm depends on most.",
        ),
    ] = None
    storage: Annotated[
        str | None,
        arg(
            metavar="URL",
            help="Optuna storage, such as postgresql://… to share the search between machines; "
            "without it, SQLite in the results folder.",
        ),
    ] = None
    out: Annotated[
        Path | None,
        arg(metavar="FILE", help="TOML file for the best settings; without it, PRESET-tuned.toml."),
    ] = None
    force: Force = False
    results_dir: ResultsDir = DEFAULT_RESULTS

    def run(self, console: "Console") -> None:
        """Call `api.studies.tune_agent`."""
        from touchdown.api import studies  # noqa: PLC0415 - heavy libraries load when used

        out = self.out or Path(f"{self.preset}-tuned.toml")
        found = studies.tune_agent(
            self.preset,
            trials=self.trials,
            seeds=self.seeds,
            env_steps=self.env_steps,
            seed=self.seed,
            space=self.space,
            storage=self.storage,
            out=out,
            force=self.force,
            results_dir=self.results_dir,
            console=console,
        )
        print_line(console, found)
        print_indented(console, found.files)
