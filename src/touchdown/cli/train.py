"""The verb `train`."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Fixed, Positional, Suppress, arg

from touchdown.cli.arguments import (
    DEFAULT_RUNS,
    Device,
    Engine,
    RunsDir,
    Trust,
    options_of,
    use_engine,
)
from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.sections import (
    SECTIONS,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TableConfig,
    TrainingConfig,
)
from touchdown.core.errors import UserError, one_line

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, select its best checkpoint, test it, and draw its figures and film.

    Settings come from the preset, then the --config file, then the flags.
    """

    preset: Annotated[
        Positional[str],
        arg(
            metavar="[PRESET]",
            help="Preset to start from, right after `train`; pilot if there is none.",
        ),
    ] = "pilot"
    given_preset: Suppress[Fixed[str | None]] = None
    """The preset on the command line."""
    config: Annotated[
        Path | None,
        arg(metavar="FILE", help="TOML file of settings, such as a run's config.toml."),
    ] = None
    name: Annotated[
        str | None, arg(metavar="NAME", help="Name of the run; without it, PRESET-SEED.")
    ] = None
    resume: Annotated[
        str | None,
        arg(metavar="RUN", help="Resume a stopped run with its own settings."),
    ] = None
    runs_dir: RunsDir = DEFAULT_RUNS
    watch: Annotated[
        bool, arg(help="Watch it learn on a local page, which stays open when training ends.")
    ] = False
    browser: Annotated[bool, arg(help="With --watch: open the page in a browser.")] = True
    logger: Annotated[
        tuple[Literal["wandb", "mlflow"], ...],
        arg(help="Log to Weights & Biases or MLflow too; each needs the extra of its name."),
    ] = ()
    device: Device = "cpu"
    engine: Engine = None
    seed: Annotated[int, arg(help="Training seed, which determines everything random.")] = 0
    env_id: Annotated[
        str,
        arg(
            help="Gymnasium id, module:Id or module:function of an environment with a flat Box or "
            "Discrete observation space and a Discrete action space."
        ),
    ] = "LunarLander-v3"
    algorithm: Annotated[
        str,
        arg(
            metavar="NAME",
            help="How to learn: with a network and a replay memory (dqn), a network without one "
            "(pqn), a table (tabular), the environment's own model (value-iteration), or an agent "
            "of your own (package.module:Class); set by presets.",
        ),
    ] = "dqn"
    options: Annotated[
        tuple[str, ...],
        arg(metavar="NAME=VALUE", help="Settings of your own agent, passed to its class by name."),
    ] = ()
    base_options: Suppress[Fixed[dict[str, bool | int | float | str]]] = field(
        default_factory=dict[str, bool | int | float | str]
    )
    """Those of the preset or the --config file."""
    trust: Trust = False
    network: NetworkConfig = field(default_factory=NetworkConfig)
    replay: ReplayConfig = field(default_factory=ReplayConfig)
    exploration: ExplorationConfig = field(default_factory=ExplorationConfig)
    learning: LearningConfig = field(default_factory=LearningConfig)
    table: TableConfig = field(default_factory=TableConfig)
    rollout: RolloutConfig = field(default_factory=RolloutConfig)
    training: TrainingConfig = field(default_factory=TrainingConfig)

    def settings(self) -> Config:
        """The flags as a config.

        Raises:
            UserError: the settings do not go together.
        """
        sections = {name: getattr(self, name) for name in SECTIONS}
        try:
            return Config(
                preset=self.preset,
                seed=self.seed,
                env_id=self.env_id,
                algorithm=self.algorithm,
                options=self.base_options | options_of(self.options),
                **sections,
            )
        except ValueError as error:
            raise UserError(one_line(error)) from None

    def run(self, console: "Console") -> None:
        """Call `api.training.train` or `api.training.resume`."""
        from touchdown.api import runs, training  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import device  # noqa: PLC0415 - heavy libraries load when used

        device.use(self.device)
        use_engine(self.engine)
        if self.resume is None:
            training.train(
                self.settings(),
                name=self.name,
                runs_dir=self.runs_dir,
                logger=self.logger,
                watch=self.watch,
                browser=self.browser,
                console=console,
            )
            return
        base = presets.preset(self.given_preset or "pilot")
        # these may name the run's own code
        given = replace(self.settings(), env_id=base.env_id, algorithm=base.algorithm)
        if given != base or self.config or self.name:
            raise UserError(
                f"resume {self.resume!r}: a run resumes with its own settings; "
                "leave out the other flags"
            )
        if self.given_preset is not None:
            started = runs.show(self.resume, self.runs_dir).config.preset
            if self.given_preset != started:
                raise UserError(
                    f"preset {self.given_preset!r}: run {self.resume!r} was started with "
                    f"{started!r}; leave the preset out"
                )
        training.resume(
            self.resume,
            env=None if self.env_id == base.env_id else self.env_id,
            agent=None if self.algorithm == base.algorithm else self.algorithm,
            runs_dir=self.runs_dir,
            logger=self.logger,
            watch=self.watch,
            browser=self.browser,
            console=console,
        )
