"""Logs scalars to Weights & Biases; importing this module needs the extra `wandb`."""

from collections.abc import Mapping

from wandb import Settings, init, setup

from touchdown.config.config import Config
from touchdown.config.toml import to_dict
from touchdown.core.version import __version__

_PROJECT = "touchdown"
_LONGEST_TAG = 64  # characters that W&B accepts
_STEPS = "env_steps"


class WandbLogger:
    """A Weights & Biases run, with environment steps as the x-axis of its charts.

    W&B's own environment variables and settings files are respected, such as WANDB_PROJECT,
    WANDB_MODE and WANDB_DIR.

    Args:
        name: name of the run.
        config: logged completely.
        run_id: id of the run to continue; None starts a new one.

    Raises:
        wandb.errors.Error: W&B refuses, for example because nobody is logged in.
    """

    def __init__(self, name: str, config: Config, run_id: str | None) -> None:
        self._run = init(
            project=setup().settings.project or _PROJECT,
            name=name,
            id=run_id,
            resume="allow",
            reinit="create_new",  # other open runs of the user stay open
            config={**to_dict(config), "digest": config.digest, "touchdown": __version__},
            tags=[config.preset[:_LONGEST_TAG], config.env_id[:_LONGEST_TAG]],
            settings=Settings(console="off", quiet=True),  # progress bars do not belong in a log
        )
        # not W&B's own step, which allows one value per tag: two episodes may end in the same step
        self._run.define_metric(_STEPS)
        self._run.define_metric("*", step_metric=_STEPS)

    @property
    def run_id(self) -> str:
        """The run's id at W&B."""
        return self._run.id

    @property
    def where(self) -> str:
        """The run's URL, or its folder if it is offline."""
        if self._run.offline:
            return self._run.settings.sync_dir
        return self._run.url or "disabled"

    def log(self, step: int, scalars: Mapping[str, float]) -> None:
        """Pass scalars to W&B's own process, which sends or stores them."""
        self._run.log({_STEPS: step, **scalars})

    def close(self) -> None:
        """Wait until everything is sent or stored."""
        self._run.finish()
