"""What pages say about a run beside its records: its state, its settings, its test, its files."""

import stat
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from touchdown.config.config import Config
from touchdown.core.errors import UnreadableError, UserError, one_line
from touchdown.core.terminal import printable_line
from touchdown.lander.rules import LANDER_ID, SOLVED_RETURN, is_lander
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.over_training import policies_over_training
from touchdown.runs.run import Run, evaluations_of

Status = Literal["training", "finished", "stopped", "gone", "damaged"]


_MISSING = 0, 0  # instead of the identity of a file that is not there


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """A run at one time. Texts are printable, and not escaped for HTML."""

    label: str
    group: str
    status: Status
    error: str = ""
    """Why something of the run cannot be shown."""
    env_id: str = ""
    seed: int = 0
    alike: str = ""
    """Equal for runs that differ only in their seed."""
    settings: dict[str, Any] | None = None
    """Those that the page needs, by name; None if they cannot be read."""
    is_lander: bool = False
    can_replay: bool = False
    """Whether the page can fly it: the lander, but none of its variants."""
    threshold: float | None = None
    """Episode return that counts as solved."""
    has_flights: bool = False
    """Whether training episodes were recorded."""
    policies: tuple[int, ...] = ()
    """Environment steps at the saved policies."""
    has_best: bool = False
    """Whether there is a best policy so far."""
    test: dict[str, Any] | None = None
    """The test of the selected policy; None while there is none."""
    config_file: tuple[int, int] = (0, 0)
    """Inode and time of change of its config, which differ if the run was made again."""

    def with_error(self, error: Exception) -> "Facts":
        """The same run with something that cannot be read."""
        return replace(self, error=printable_line(one_line(error)))

    def to_json(self) -> dict[str, Any]:
        """As a JSON object, of what pages need."""
        return {name: value for name, value in asdict(self).items() if name != "config_file"}


def status_of(folder: RunFolder) -> Status:
    """Whether a run is under way, finished, stopped, or was deleted; its files are not read."""
    if not folder.path.is_dir():
        return "gone"
    if folders.is_locked(folder):
        return "training"
    return "finished" if Run(folder).status == "finished" else "stopped"


def read_facts(folder: RunFolder, label: str, group: str, before: Facts | None = None) -> Facts:
    """The facts of a run.

    Args:
        folder: its folder.
        label: what pages call it.
        group: what it belongs to.
        before: the facts when it was last read, whose settings are kept while its config is the
            same file.

    Raises:
        OSError: its files cannot be looked at.
    """
    status = status_of(folder)
    facts = Facts(label=printable_line(label), group=printable_line(group), status=status)
    if status == "gone" and before is None:
        return facts
    try:
        config_file = identity_of(folder.config_file)
        # a folder is deleted a file at a time; what was read before is still shown
        if before is not None and config_file == _MISSING:
            return replace(before, status="gone", error="")
        facts = replace(facts, config_file=config_file)
        if before is None or before.settings is None or before.config_file != config_file:
            facts = _of_config(facts, folder)
        else:
            facts = replace(before, status=status, error="")
        saved = policies_over_training(folder) if facts.can_replay else []
        facts = replace(
            facts,
            policies=tuple(policy.env_steps for policy in saved),
            has_flights=facts.can_replay and folder.training_flights.is_file(),
            has_best=folder.best.is_file(),
        )
        if facts.test is None or status == "training":
            facts = replace(facts, test=_test_of(folder))
    except UserError as error:
        if facts.settings is None:
            facts = replace(facts, status="damaged")
        return facts.with_error(error)
    return facts


def identity_of(path: Path) -> tuple[int, int]:
    """Inode and time of change of a file, which differ if it was replaced; (0, 0) if it is missing.

    Raises:
        UnreadableError: it is a symbolic link.
    """
    try:
        found = path.lstat()
    except FileNotFoundError:
        return _MISSING
    if stat.S_ISLNK(found.st_mode):  # it may lead anywhere
        raise UnreadableError(f"{path}: is a symbolic link, must be a regular file")
    return found.st_ino, found.st_mtime_ns


def _of_config(facts: Facts, folder: RunFolder) -> Facts:
    config = folder.config()
    lander = is_lander(config.env_id)
    return replace(
        facts,
        env_id=printable_line(config.env_id),
        seed=config.seed,
        alike=replace(config, seed=0).digest,
        settings=_settings(config),
        is_lander=lander,
        can_replay=config.env_id == LANDER_ID,
        threshold=SOLVED_RETURN if lander else None,
    )


def _settings(config: Config) -> dict[str, Any]:
    return {
        "gamma": config.learning.gamma,
        "reward_scale": config.learning.reward_scale,
        "activation": config.network.activation,
        "max_env_steps": config.training.max_env_steps,
        "episodes": config.training.episodes,
    }


def _test_of(folder: RunFolder) -> dict[str, Any] | None:
    tested = next(iter(evaluations_of(Run(folder))), None)
    if tested is None:
        return None
    return {"episodes": len(tested.episodes), "mean_return": tested.summary.mean_return}
