"""The verb `train`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from touchdown.cli.arguments import DEFAULT_RUNS, Device, Engine, RunsDir, use_engine
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
from touchdown.core.errors import UserError, one_line

if TYPE_CHECKING:
    from rich.console import Console


def _preset_help() -> str:
    # tyro keeps a line break only if the next line does not begin with a letter
    lines = [f"\n- {name}: {text}" for name, text in presets.SECTIONS_OF_THE_PAPER.items()]
    return "Settings to start from, given right after `train`:" + "".join(lines) + "\n"


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, choose its best checkpoint, test it, and draw its figures and film.

    Settings come from the preset, then from the --config file, then from the flags.
    """

    preset: Annotated[Positional[str], arg(metavar="[PRESET]", help=_preset_help())] = "pilot"
    config: Annotated[
        Path | None,
        arg(metavar="FILE", help="TOML file of settings, such as a run's config.toml."),
    ] = None
    name: Annotated[
        str | None, arg(metavar="NAME", help="Name of the run; None takes PRESET-SEED.")
    ] = None
    resume: Annotated[
        str | None,
        arg(metavar="RUN", help="Continue a stopped run, with the settings that it has."),
    ] = None
    runs_dir: RunsDir = DEFAULT_RUNS
    logger: Annotated[
        tuple[Literal["wandb", "mlflow"], ...],
        arg(
            help="Log to Weights & Biases or MLflow too; each needs its extra, such as "
            "touchdown[wandb]."
        ),
    ] = ()
    device: Device = "cpu"
    engine: Engine = None
    seed: Annotated[int, arg(help="Training seed: everything random follows from it.")] = 0
    env_id: Annotated[
        str,
        arg(
            help="Gymnasium id of an environment with a flat Box or Discrete observation space and "
            "a Discrete action space."
        ),
    ] = "LunarLander-v3"
    algorithm: Annotated[
        Algorithm,
        arg(
            help="What learns: a network with a replay memory, a network without one, a table, or "
            "planning with the environment's own model; presets choose it."
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
        """The flags as a config.

        Raises:
            UserError: the settings do not fit each other.
        """
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
        """Call `api.training.train` or `api.training.resume`."""
        from touchdown.api import training  # noqa: PLC0415 - heavy libraries load when used
        from touchdown.core import device  # noqa: PLC0415 - heavy libraries load when used

        device.use(self.device)
        use_engine(self.engine)
        if self.resume is None:
            training.train(
                self.settings(),
                name=self.name,
                runs_dir=self.runs_dir,
                logger=self.logger,
                console=console,
            )
            return
        if self.settings() != presets.preset("pilot") or self.config or self.name:
            raise UserError(
                f"resume {self.resume!r}: continues with the run's own settings; "
                "leave out the preset and the other flags"
            )
        training.resume(self.resume, runs_dir=self.runs_dir, logger=self.logger, console=console)
