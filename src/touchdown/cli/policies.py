"""The verbs that use a trained policy: `evaluate`, `fly` and `export`."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from touchdown.cli.arguments import (
    DEFAULT_RUNS,
    Device,
    Engine,
    EnvId,
    Episodes,
    FirstSeed,
    Force,
    Json,
    PolicyName,
    RunsDir,
    Trust,
    VecNormalize,
    use_engine,
)
from touchdown.cli.printing import print_indented, print_json, print_line

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Evaluate:
    """Run greedy episodes of a policy on stock Gymnasium and print the results."""

    policy: Positional[PolicyName]
    episodes: Episodes = 100
    seed: FirstSeed = 0
    env_id: EnvId = None
    vecnormalize: VecNormalize = None
    trust: Trust = False
    json: Json = False
    runs_dir: RunsDir = DEFAULT_RUNS
    device: Device = "cpu"

    def run(self, console: "Console") -> None:
        """Call `api.flying.evaluate`."""
        from touchdown.api import flying  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import device  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.evaluation import table  # noqa: PLC0415 - heavy libraries load when used

        device.use(self.device)
        evaluation = flying.evaluate(
            self.policy,
            episodes=self.episodes,
            seed=self.seed,
            env_id=self.env_id,
            vecnormalize=self.vecnormalize,
            runs_dir=self.runs_dir,
            console=console,
        )
        if self.json:
            print_json(evaluation.to_json())
        else:
            console.print(table.evaluation_table([evaluation]))


@dataclass(frozen=True, kw_only=True)
class Fly:
    """Run one greedy episode of a policy and film it."""

    policy: Positional[PolicyName]
    over_training: Annotated[
        bool,
        arg(
            help="Film a run's learning instead: policies saved over its training fly the start, "
            "side by side."
        ),
    ] = False
    seed: Annotated[int, arg(help="Environment seed of the start.")] = 0
    out: Annotated[
        str | None,
        arg(
            metavar="FILE",
            help="A .gif or .mp4 file to write, or `window` to watch it live; without it, "
            "POLICY-SEED.gif.",
        ),
    ] = None
    force: Force = False
    env_id: EnvId = None
    vecnormalize: VecNormalize = None
    trust: Trust = False
    runs_dir: RunsDir = DEFAULT_RUNS
    device: Device = "cpu"
    engine: Engine = None

    def run(self, console: "Console") -> None:
        """Call `api.flying.fly`."""
        from touchdown.api import flying  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import device  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.envs.frames import NotDrawable  # noqa: PLC0415 - heavy libraries load

        device.use(self.device)
        use_engine(self.engine)
        if self.over_training:
            self._fly_over_training(console)
            return
        out: str | None = self.out or f"{Path(self.policy).stem}-{self.seed}.gif"
        fly = partial(
            flying.fly,
            self.policy,
            seed=self.seed,
            force=self.force,
            env_id=self.env_id,
            vecnormalize=self.vecnormalize,
            runs_dir=self.runs_dir,
        )
        try:
            flight = fly(out=out)
        except NotDrawable as error:
            if self.out:
                raise
            console.print(f"no film: {error}", markup=False, soft_wrap=True)
            out, flight = None, fly()
        console.print(
            f"{self.policy} from start {self.seed}: {flight.outcome}, "
            f"return {flight.episode_return:.1f}, {flight.steps} steps, fuel {flight.fuel:.1f}",
            markup=False,
        )
        if out and out != "window":
            print_indented(console, [out])

    def _fly_over_training(self, console: "Console") -> None:
        """Call `api.learning_film.fly_over_training`."""
        from touchdown.api import learning_film  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core.errors import UserError  # noqa: PLC0415 - as above

        for name, value in (("env-id", self.env_id), ("vecnormalize", self.vecnormalize)):
            if value is not None:
                raise UserError(f"--{name}: a run has its own; leave it out with --over-training")
        out = self.out or f"{Path(self.policy).stem}-{self.seed}-over-training.gif"
        flights = learning_film.fly_over_training(
            self.policy,
            seed=self.seed,
            out=out,
            force=self.force,
            runs_dir=self.runs_dir,
        )
        for flight in flights:
            print_line(
                console,
                f"{flight.policy}: {flight.outcome}, return {flight.episode_return:.1f}",
            )
        print_indented(console, [out])


@dataclass(frozen=True, kw_only=True)
class Export:
    """Export a policy for use outside touchdown, with a model card."""

    name: Annotated[
        Positional[str],
        arg(
            metavar="RUN",
            help="Name or folder of a run, or `ace`, a policy that comes with touchdown.",
        ),
    ]
    format: Annotated[
        Literal["onnx", "safetensors"],
        arg(
            help="onnx: for any ONNX runtime, checked against the policy before it is written "
            "(needs the extra onnx); safetensors: touchdown's own format."
        ),
    ] = "onnx"
    out: Annotated[
        Path | None,
        arg(metavar="FOLDER", help="Folder to create; without it, RUN-FORMAT here."),
    ] = None
    force: Force = False
    trust: Trust = False
    runs_dir: RunsDir = DEFAULT_RUNS

    def run(self, console: "Console") -> None:
        """Call `api.exporting.export`."""
        from touchdown.api import exporting  # noqa: PLC0415 - heavy libraries load when used

        export = exporting.export(
            self.name,
            self.format,
            out=self.out,
            force=self.force,
            runs_dir=self.runs_dir,
            console=console,
        )
        if export.note:
            print_line(console, export.note)
        if export.agreement is not None:
            print_line(console, export.agreement)
        print_indented(console, export.files)
