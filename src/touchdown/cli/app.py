"""The command line: each verb parses its flags and hands over to one function."""

import difflib
import io
import json
import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, field, fields
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from tyro.conf import OmitArgPrefixes, Positional, arg, subcommand

from touchdown import __version__
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import (
    SECTIONS,
    Algorithm,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TableConfig,
    TrainingConfig,
)
from touchdown.config.toml import from_values, read_toml
from touchdown.core.errors import Interrupted, UserError, one_line

if TYPE_CHECKING:
    from rich.console import Console

RunsDir = Annotated[Path, arg(help="Folder where runs are kept.")]
Json = Annotated[bool, arg(help="Print JSON for scripts instead of a table.")]
Device = Annotated[Literal["cpu", "gpu"], arg(help="Where JAX computes.")]
Engine = Annotated[
    Literal["exact", "gymnasium"] | None,
    arg(
        help="What flies the lander: ours in C++, or stock; the same to the last bit. "
        "None takes ours where it was built. Tests and windows fly stock always."
    ),
]
Episodes = Annotated[int, arg(help="Starts to fly (episodes).")]
FirstSeed = Annotated[
    int, arg(help="Environment seed of the first start; seeds below 1000000 are test starts.")
]
EnvId = Annotated[
    str,
    arg(
        help="World (Gymnasium id) for `random`, a .zip, and an .onnx that names none; the others "
        "know theirs."
    ),
]
PolicyName = Annotated[
    str,
    arg(
        metavar="PILOT",
        help="A run's name or folder, pid, heuristic, random, a policy that comes with touchdown, "
        "or a file: .safetensors, .toml, .onnx, or a .zip of Stable-Baselines3.",
    ),
]
RunName = Annotated[str, arg(metavar="RUN", help="A run's name in the runs folder, or its folder.")]

ResultsDir = Annotated[Path, arg(help="Folder where studies keep their runs and reports.")]
Scale = Annotated[
    Literal["quick", "full"],
    arg(help="Of the paper's studies: quick is for a laptop, full is the paper's."),
]
LastScale = Annotated[
    Literal["quick", "full"] | None,
    arg(help="Of the paper's studies; None is as it was last run."),
]
Seeds = Annotated[
    int | None, arg(help="Training seeds of each level; None is the study's own number.")
]
LastSeeds = Annotated[
    int | None, arg(help="Training seeds of each level; None is as many as were last asked for.")
]
StudyName = Annotated[
    str,
    arg(
        metavar="NAME",
        help="`paper` for all of the paper's, one that `study list` names, or a .toml file.",
    ),
]

INTERRUPTED = 130  # the shell's code for a program that Ctrl-C ended


def _preset_help() -> str:
    # tyro keeps a line's end where the next does not begin with a letter
    lines = [f"\n- {name}: {text}" for name, text in presets.SECTIONS_OF_THE_PAPER.items()]
    return "Settings to start from, right after `train`." + "".join(lines) + "\n"


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, choose its best checkpoint, test it and draw its pictures.

    Settings come from the preset, then from the --config file, then from the flags.
    """

    preset: Annotated[Positional[str], arg(metavar="[PRESET]", help=_preset_help())] = "pilot"
    config: Annotated[
        Path | None,
        arg(metavar="FILE", help="TOML file of settings, such as a run's config.toml."),
    ] = None
    name: Annotated[
        str | None, arg(metavar="NAME", help="Name of the run; None makes PRESET-SEED.")
    ] = None
    resume: Annotated[
        str | None,
        arg(metavar="RUN", help="Go on with a stopped run, with the settings it has."),
    ] = None
    runs_dir: RunsDir = Path("runs")
    device: Device = "cpu"
    engine: Engine = None
    seed: Annotated[int, arg(help="Training seed: everything random follows from it.")] = 0
    env_id: Annotated[
        str,
        arg(
            help="Gymnasium id of a world with a flat Box or Discrete observation and Discrete "
            "actions."
        ),
    ] = "LunarLander-v3"
    algorithm: Annotated[
        Algorithm,
        arg(
            help="What learns: a network with a memory, one without, a table, or a plan made from "
            "the world's own model; presets choose it."
        ),
    ] = "dqn"
    network: NetworkConfig = field(default_factory=NetworkConfig)
    replay: ReplayConfig = field(default_factory=ReplayConfig)
    exploration: ExplorationConfig = field(default_factory=ExplorationConfig)
    learning: LearningConfig = field(default_factory=LearningConfig)
    table: TableConfig = field(default_factory=TableConfig)
    rollout: RolloutConfig = field(default_factory=RolloutConfig)
    training: TrainingConfig = field(default_factory=TrainingConfig)

    def settings(self) -> Config:
        """The flags as a config."""
        sections = {name: getattr(self, name) for name in SECTIONS}
        try:
            return Config(
                preset=self.preset,
                seed=self.seed,
                env_id=self.env_id,
                algorithm=self.algorithm,
                **sections,
            )
        except ValueError as error:
            raise UserError(one_line(error)) from None

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.train` or `verbs.resume`."""
        from touchdown.api import verbs  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import device  # noqa: PLC0415

        device.use(self.device)
        _use_engine(self.engine)
        if self.resume is None:
            verbs.train(self.settings(), name=self.name, runs_dir=self.runs_dir, console=console)
            return
        if self.settings() != presets.preset("pilot") or self.config or self.name:
            raise UserError(
                f"resume {self.resume!r}: goes on with the run's own settings; "
                "leave out the preset and the other flags"
            )
        verbs.resume(self.resume, runs_dir=self.runs_dir, console=console)


@dataclass(frozen=True, kw_only=True)
class Evaluate:
    """Fly a policy greedily on stock Gymnasium from many starts and print what came of it."""

    policy: Positional[PolicyName]
    episodes: Episodes = 100
    seed: FirstSeed = 0
    env_id: EnvId = "LunarLander-v3"
    json: Json = False
    runs_dir: RunsDir = Path("runs")
    device: Device = "cpu"

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.evaluate`."""
        from touchdown.api import verbs  # noqa: PLC0415
        from touchdown.core import device  # noqa: PLC0415
        from touchdown.evaluation import table  # noqa: PLC0415

        device.use(self.device)
        evaluation = verbs.evaluate(
            self.policy,
            episodes=self.episodes,
            seed=self.seed,
            env_id=self.env_id,
            runs_dir=self.runs_dir,
            console=console,
        )
        if self.json:
            _print_json(evaluation.to_json())
        else:
            console.print(table.evaluation_table([evaluation]))


@dataclass(frozen=True, kw_only=True)
class Fly:
    """Fly one episode and film it."""

    policy: Positional[PolicyName]
    seed: Annotated[int, arg(help="Environment seed of the start.")] = 0
    out: Annotated[
        str | None,
        arg(
            metavar="FILE", help="A .gif or .mp4 to write, or `window`; None makes PILOT-SEED.gif."
        ),
    ] = None
    env_id: EnvId = "LunarLander-v3"
    runs_dir: RunsDir = Path("runs")
    device: Device = "cpu"
    engine: Engine = None

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.fly`."""
        from touchdown.api import verbs  # noqa: PLC0415
        from touchdown.core import device  # noqa: PLC0415

        device.use(self.device)
        _use_engine(self.engine)
        out = self.out or f"{Path(self.policy).stem}-{self.seed}.gif"
        flight = verbs.fly(
            self.policy, seed=self.seed, out=out, env_id=self.env_id, runs_dir=self.runs_dir
        )
        console.print(
            f"{self.policy} from start {self.seed}: {flight.outcome}, "
            f"return {flight.episode_return:.1f}, {flight.steps} steps, fuel {flight.fuel:.1f}",
            markup=False,
        )
        if out != "window":
            console.print(f"  {out}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class TunePid:
    """Tune the PID controller: Twiddle over its gains and dead band, on training starts."""

    rule: Annotated[
        Literal["signed", "absolute"],
        arg(help="Action rule: `absolute` as the paper prints it, or the vertical sign kept."),
    ] = "signed"
    starts: Annotated[int, arg(help="Training starts that each trial flies (episodes).")] = 200
    seed: Annotated[int, arg(help="Chooses the training starts.")] = 0
    tolerance: Annotated[
        float, arg(help="Stop when every step is below this share of its first size.")
    ] = 0.2
    begin: Annotated[
        Path | None,
        arg(
            metavar="FILE",
            help="TOML file of gains to begin from, such as an earlier tuning's; None begins from "
            "gains picked by hand.",
        ),
    ] = None
    out: Annotated[Path, arg(metavar="FILE", help="TOML file for the gains.")] = Path("pid.toml")
    engine: Engine = None

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.tune_pid`."""
        from touchdown.api import verbs  # noqa: PLC0415

        _use_engine(self.engine)
        best = verbs.tune_pid(
            rule=self.rule,
            starts=self.starts,
            seed=self.seed,
            tolerance=self.tolerance,
            begin=self.begin,
            out=self.out,
            console=console,
        )
        console.print(f"{best}\n  {self.out}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class TuneAgent:
    """Search a preset's settings with Optuna (touchdown[optuna]); several training seeds a trial.

    Seeds that tune are never those that studies report. The same command goes on with a search
    that was stopped.
    """

    preset: Annotated[Positional[str], arg(metavar="PRESET", help="Settings to start from.")]
    trials: Annotated[int, arg(help="Trials to make in all, those made before too.")] = 30
    seeds: Annotated[int, arg(help="Training seeds a trial; its value is their mean.")] = 3
    observations: Annotated[
        int | None, arg(help="Observations a training; None takes the preset's own.")
    ] = None
    seed: Annotated[int, arg(help="Chooses what the sampler draws.")] = 0
    storage: Annotated[
        str | None,
        arg(
            metavar="URL",
            help="Optuna's storage, such as postgresql://… for many machines; None is SQLite in "
            "the results' folder.",
        ),
    ] = None
    out: Annotated[
        Path | None,
        arg(metavar="FILE", help="TOML file for the winner; None makes PRESET-tuned.toml."),
    ] = None
    results_dir: ResultsDir = Path("runs") / "studies"

    def run(self, console: "Console") -> None:
        """Hand over to `studying.tune_agent`."""
        from touchdown.api import studies  # noqa: PLC0415

        out = self.out or Path(f"{self.preset}-tuned.toml")
        found = studies.tune_agent(
            self.preset,
            trials=self.trials,
            seeds=self.seeds,
            observations=self.observations,
            seed=self.seed,
            storage=self.storage,
            out=out,
            results_dir=self.results_dir,
            console=console,
        )
        console.print(str(found), soft_wrap=True, markup=False, highlight=False)
        for path in found.files:
            console.print(f"  {path}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Tune a controller, or an agent's settings."""

    what: Annotated[TunePid, subcommand("pid")] | Annotated[TuneAgent, subcommand("agent")]

    def run(self, console: "Console") -> None:
        """Hand over to what is tuned."""
        self.what.run(console)


@dataclass(frozen=True, kw_only=True)
class StudyRun:
    """Run what is missing of a study; the same command goes on with one that was stopped."""

    name: Positional[StudyName]
    scale: Scale = "quick"
    seeds: Seeds = None
    on: Annotated[
        str,
        arg(
            metavar="local|ray|ray://…",
            help="Who runs it: worker processes here, a Ray cluster that is already started, or "
            "one far away (needs touchdown[ray]).",
        ),
    ] = "local"
    workers: Annotated[int | None, arg(help="Runs at a time; None takes a worker a core.")] = None
    dry_run: Annotated[
        bool, arg(help="Only say what is missing and how long it will take, measured here.")
    ] = False
    results_dir: ResultsDir = Path("runs") / "studies"

    def run(self, console: "Console") -> None:
        """Hand over to `studying.run_study`."""
        from touchdown.api import studies  # noqa: PLC0415
        from touchdown.core import progress  # noqa: PLC0415

        if self.dry_run or self.scale == "full":
            estimated = studies.estimate_study(
                self.name,
                scale=self.scale,
                seeds=self.seeds,
                workers=self.workers,
                results_dir=self.results_dir,
                console=console,
            )
            console.print(str(estimated), soft_wrap=True, markup=False, highlight=False)
        if self.dry_run:
            return
        began = time.monotonic()
        state = studies.run_study(
            self.name,
            scale=self.scale,
            seeds=self.seeds,
            executor=studies.executor_of(self.on, self.workers),
            results_dir=self.results_dir,
            console=console,
        )
        took = progress.clock(time.monotonic() - began)
        console.print(f"{state.done} of {state.total} runs are done, after {took}", markup=False)
        if state.failed:
            raise UserError(
                f"{len(state.failed)} runs failed; `touchdown study status` names them, and the "
                "same command tries them again"
            )


@dataclass(frozen=True, kw_only=True)
class StudyStatus:
    """Say how far studies are, and which runs failed and why."""

    name: Annotated[
        Positional[str | None], arg(metavar="[NAME]", help="Of one; None takes all begun.")
    ] = None
    scale: LastScale = None
    seeds: LastSeeds = None
    json: Json = False
    results_dir: ResultsDir = Path("runs") / "studies"

    def run(self, console: "Console") -> None:
        """Hand over to `studying.study_status`."""
        from touchdown.api import studies  # noqa: PLC0415
        from touchdown.cli import tables  # noqa: PLC0415

        found = studies.study_status(
            self.name, scale=self.scale, seeds=self.seeds, results_dir=self.results_dir
        )
        if self.json:
            _print_json([each.to_dict() for each in found])
            return
        console.print(tables.studies_table(found))
        for each in found:
            for name, why in each.failed.items():
                console.print(f"  {name}: {why}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class StudyReport:
    """Write a study's page: figures, a verdict on each claim, flights, tables."""

    name: Annotated[
        Positional[str | None],
        arg(metavar="[NAME]", help="Of the study; None takes the one that was begun."),
    ] = None
    scale: LastScale = None
    seeds: LastSeeds = None
    out: Annotated[
        Path | None,
        arg(metavar="FOLDER", help="Folder for the page; None makes reports/NAME in the results."),
    ] = None
    results_dir: ResultsDir = Path("runs") / "studies"

    def run(self, console: "Console") -> None:
        """Hand over to `studying.study_report`."""
        from touchdown.api import studies  # noqa: PLC0415
        from touchdown.cli import tables  # noqa: PLC0415

        report = studies.study_report(
            self.name,
            scale=self.scale,
            seeds=self.seeds,
            out=self.out,
            results_dir=self.results_dir,
            console=console,
        )
        if report.decisions:
            console.print(tables.claims_table(report.decisions))
        console.print(f"  {report.page}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class StudyList:
    """List the paper's studies: what they vary, how many runs they are, what is claimed."""

    scale: Scale = "quick"
    json: Json = False

    def run(self, console: "Console") -> None:
        """Hand over to `studying.list_studies`."""
        from touchdown.api import studies  # noqa: PLC0415
        from touchdown.cli import tables  # noqa: PLC0415

        found = studies.list_studies(self.scale)
        if self.json:
            _print_json([each.to_dict() for each in found])
        else:
            console.print(tables.topics_table(found))


@dataclass(frozen=True, kw_only=True)
class Study:
    """Many runs: a factor's levels over training seeds, with intervals and verdicts."""

    what: (
        Annotated[StudyRun, subcommand("run")]
        | Annotated[StudyStatus, subcommand("status")]
        | Annotated[StudyReport, subcommand("report")]
        | Annotated[StudyList, subcommand("list")]
    )

    def run(self, console: "Console") -> None:
        """Hand over to what is to be done."""
        self.what.run(console)


@dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare runs on one page; the first is what the others are beside."""

    names: Annotated[
        Positional[tuple[str, ...]],
        arg(
            metavar="RUN [RUN ...]",
            help="Runs in the runs folder; those that differ in nothing but the seed count as one.",
        ),
    ]
    out: Annotated[Path, arg(metavar="FOLDER", help="Folder for the page.")] = Path("comparison")
    runs_dir: RunsDir = Path("runs")

    def run(self, console: "Console") -> None:
        """Hand over to `studying.compare`."""
        from touchdown.api import studies  # noqa: PLC0415

        page = studies.compare(self.names, out=self.out, runs_dir=self.runs_dir, console=console)
        console.print(f"  {page}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class Runs:
    """List the runs in a folder."""

    json: Json = False
    runs_dir: RunsDir = Path("runs")

    def run(self, console: "Console") -> None:
        """Hand over to `list_facts`."""
        from touchdown.cli import tables  # noqa: PLC0415
        from touchdown.runs.run import list_facts  # noqa: PLC0415

        facts = list_facts(self.runs_dir)
        if self.json:
            _print_json(facts)
            return
        if not facts:
            console.print(f"no runs in {self.runs_dir}; `touchdown train` makes one", markup=False)
            return
        console.print(tables.runs_table(facts))
        for run in facts:
            if run["status"] == "broken":
                console.print(f"  {run['error']}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class Show:
    """Show one run: its settings, its results, its pictures' paths."""

    name: Annotated[Positional[RunName], arg(metavar="RUN")]
    json: Json = False
    runs_dir: RunsDir = Path("runs")

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.show`."""
        from touchdown.api import verbs  # noqa: PLC0415
        from touchdown.cli import tables  # noqa: PLC0415
        from touchdown.config import toml  # noqa: PLC0415
        from touchdown.evaluation import table  # noqa: PLC0415
        from touchdown.runs.run import evaluations_of, run_facts  # noqa: PLC0415

        run = verbs.show(self.name, self.runs_dir)
        facts = run_facts(run)
        pictures = [str(path) for path in run.pictures]
        if self.json:
            _print_json({**facts, "config": toml.to_dict(run.config), "pictures": pictures})
            return
        console.print(tables.runs_table([facts]))
        console.print(toml.to_toml(run.config), markup=False, highlight=False)
        evaluated = evaluations_of(run)
        if evaluated:
            console.print(table.evaluation_table(evaluated))
        for path in pictures:
            console.print(f"  {path}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class Export:
    """Write a policy for others to fly, with a card that says what it is."""

    name: Annotated[
        Positional[str],
        arg(
            metavar="RUN",
            help="A run's name in the runs folder, or its folder; ace comes with touchdown.",
        ),
    ]
    format: Annotated[
        Literal["onnx", "safetensors"],
        arg(
            help="onnx: for any ONNX runtime, checked against the policy before it is written "
            "(needs touchdown[onnx]); safetensors: touchdown's own."
        ),
    ] = "onnx"
    out: Annotated[
        Path | None,
        arg(metavar="FOLDER", help="Folder to make; None makes RUN-FORMAT here."),
    ] = None
    runs_dir: RunsDir = Path("runs")

    def run(self, console: "Console") -> None:
        """Hand over to `verbs.export`."""
        from touchdown.api import verbs  # noqa: PLC0415

        export = verbs.export(self.name, self.format, out=self.out, runs_dir=self.runs_dir)
        if export.agreement is not None:
            console.print(str(export.agreement), soft_wrap=True, markup=False, highlight=False)
        for path in export.files:
            console.print(f"  {path}", soft_wrap=True, markup=False)


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Say what this machine has, what is missing and what would help; exit code 2 if it is bad."""

    json: Json = False
    runs_dir: RunsDir = Path("runs")

    def run(self, console: "Console") -> None:
        """Hand over to `doctor.check_up`."""
        from touchdown.api import doctor  # noqa: PLC0415
        from touchdown.cli import tables  # noqa: PLC0415

        findings = doctor.check_up(self.runs_dir)
        if self.json:
            _print_json([finding.to_dict() for finding in findings])
        else:
            console.print(tables.findings_table(findings))
        bad = [finding.name for finding in findings if finding.state == "bad"]
        if bad:
            raise UserError(f"{', '.join(bad)}: will not work; the table says what would help")


Verb = Train | Evaluate | Fly | Tune | Study | Compare | Runs | Show | Export | Doctor
VERBS: dict[str, type[Verb]] = {
    "train": Train,
    "evaluate": Evaluate,
    "fly": Fly,
    "tune": Tune,
    "study": Study,
    "compare": Compare,
    "runs": Runs,
    "show": Show,
    "export": Export,
    "doctor": Doctor,
}


# what comes after a verb that is two words, whose flags are its own
_INNER: dict[str, tuple[type[Any], ...]] = {
    "tune": (TunePid, TuneAgent),
    "study": (StudyRun, StudyStatus, StudyReport, StudyList),
}


def _use_engine(engine: Literal["exact", "gymnasium"] | None) -> None:
    from touchdown.lander import engine as engines  # noqa: PLC0415

    if engine is not None:
        engines.use_engine(engine)


def _print_json(value: object) -> None:
    sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def _train_defaults(argv: Sequence[str]) -> Train:
    """Defaults for `train`'s flags: they hang on the preset and the TOML file given beside them."""
    if not argv or argv[0] != "train":
        return Train()
    given = _preset_in(argv)
    file = _value_of(argv, "--config")
    values = {} if file is None else read_toml(Path(file))
    named = str(values.get("preset"))
    config = presets.preset(given or (named if named in presets.PRESETS else "pilot"))
    if file is not None:
        config = from_values(values, config, Path(file))
    sections = {section: getattr(config, section) for section in SECTIONS}
    return Train(
        preset=given or config.preset,
        seed=config.seed,
        env_id=config.env_id,
        algorithm=config.algorithm,
        **sections,
    )


def _preset_in(argv: Sequence[str]) -> str | None:
    if len(argv) > 1 and argv[0] == "train" and not argv[1].startswith("-"):
        return argv[1]
    return None


def _value_of(argv: Sequence[str], flag: str) -> str | None:
    given = [
        value
        for token, following in zip_longest(argv, argv[1:])
        for name, _, after in [token.partition("=")]
        if name == flag and (value := after or following) is not None
    ]
    if len(given) > 1:
        raise UserError(f"{flag}: given {len(given)} times; must be given once")
    return given[0] if given else None


_FORMER_FLAGS = {"--max-observations": "--max-env-steps", "--finalists": "--candidate-checkpoints"}


def _present_flag(token: str) -> str:
    """A flag's present name: scripts may still use a former one."""
    flag, equals, value = token.partition("=")
    return f"{_FORMER_FLAGS.get(flag.replace('_', '-'), flag)}{equals}{value}"


def parse(argv: Sequence[str]) -> Verb:
    """The verb and its flags.

    Raises:
        UserError: they are not of the verb's form.
        SystemExit: help was printed.
    """
    if argv and not argv[0].startswith("-") and argv[0] not in VERBS:
        raise UserError(f"verb {argv[0]!r}: unknown; choose one of {', '.join(VERBS)}")
    argv = [_present_flag(token) for token in argv]
    defaults = _train_defaults(argv)
    # the preset is known by now; without it in the way, --help shows where it goes
    rest = argv[2:] if _preset_in(argv) else argv[1:]
    verbs = (
        Annotated[Train, subcommand("train", default=defaults)]
        | Annotated[Evaluate, subcommand("evaluate")]
        | Annotated[Fly, subcommand("fly")]
        | Annotated[Tune, subcommand("tune")]
        | Annotated[Study, subcommand("study")]
        | Annotated[Compare, subcommand("compare")]
        | Annotated[Runs, subcommand("runs")]
        | Annotated[Show, subcommand("show")]
        | Annotated[Export, subcommand("export")]
        | Annotated[Doctor, subcommand("doctor")]
    )
    complaint = io.StringIO()
    try:
        with redirect_stderr(complaint):
            verb: Verb = tyro.cli(
                verbs,  # pyright: ignore[reportArgumentType] - a union of types is a type to tyro
                args=[*argv[:1], *rest],
                prog="touchdown",
                description="A deep Q-learning laboratory for the lunar lander.",
                config=(OmitArgPrefixes,),
            )
    except SystemExit as error:
        if error.code in (0, None):
            raise
        raise UserError(_one_line_of(complaint.getvalue(), argv)) from None
    if isinstance(verb, Train) and verb.preset != defaults.preset:
        raise UserError(f"preset {verb.preset!r}: must be given once, right after `train`")
    return verb


def _one_line_of(complaint: str, argv: Sequence[str]) -> str:
    """What tyro complains of, on one line, with the nearest flag where one is unknown."""
    text = re.sub(r"^Error parsing (__tyro\S*: )?", "", _first_paragraph(complaint))
    unknown = re.match(r"Unrecognized options: (--[^\s,=]+)", text)
    if not unknown or argv[0] not in VERBS:
        return text
    flags = [f"--{name.replace('_', '-')}" for name in _field_names(argv[0])]
    near = difflib.get_close_matches(unknown[1].replace("_", "-"), flags, n=1)
    hint = f"did you mean {near[0]}?" if near else f"`touchdown {argv[0]} --help` lists them"
    return f"{unknown[1]}: unknown option; {hint}"


def _field_names(verb: str) -> Iterator[str]:
    kinds = _INNER.get(verb, (VERBS[verb],))
    for item in (item for kind in kinds for item in fields(kind)):
        if item.name in SECTIONS:
            yield from (inner.name for inner in fields(SECTIONS[item.name]))
        else:
            yield item.name


def _first_paragraph(complaint: str) -> str:
    """The first paragraph of tyro's complaint, without its frame and its title.

    Paragraphs are parted by ruled lines. Where the terminal speaks no UTF-8 there is no frame, and
    the title is a paragraph of its own.
    """
    paragraphs: list[list[str]] = [[]]
    for line in complaint.splitlines():
        text = line.strip(" │")
        if text[:1] in ("╭", "╰"):
            continue
        if text and not text.strip("─-"):
            paragraphs.append([])
        else:
            paragraphs[-1].append(text)
    framed = "╭" in complaint
    return " ".join(" ".join(paragraphs[0 if framed else 1]).split())


def main(argv: Sequence[str] | None = None) -> None:
    """Run a verb; bad input is one line on stderr and exit code 2."""
    from rich.console import Console  # noqa: PLC0415

    args = list(sys.argv[1:] if argv is None else argv)
    if args == ["--version"]:
        sys.stdout.write(f"touchdown {__version__}\n")
        return
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without UTF-8 still gets its table
    console = Console(width=None if sys.stdout.isatty() else 120, stderr="--json" in args)
    try:
        parse(args).run(console)
    except UserError as error:
        _fail(str(error))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _fail(f"{where}{one_line(error)}")
    except Interrupted as stopped:
        _fail(str(stopped), INTERRUPTED)
    except KeyboardInterrupt:
        _fail("stopped", INTERRUPTED)


def _fail(message: str, code: int = 2) -> None:
    sys.stderr.write(f"touchdown: {message}\n")
    sys.stderr.flush()
    raise SystemExit(code)


if __name__ == "__main__":
    main()
