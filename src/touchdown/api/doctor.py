"""Checks this installation: what works, what is missing, and how to fix it."""

import os
import platform
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, cast

import gymnasium
import numpy as np
from gymnasium.error import Error as GymnasiumError

from touchdown.core import device, installation, threads
from touchdown.core.errors import UserError, one_line
from touchdown.core.version import __version__
from touchdown.envs import environment
from touchdown.lander import engine as engines
from touchdown.lander import rules
from touchdown.runs.provenance import cpu_name

State = Literal["good", "note", "bad"]

_SEED = 0
_STEPS = 600  # enough for touchdowns and several resets


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check."""

    name: str
    state: State
    """`bad`: something does not work. `note`: it works, but could be better."""
    text: str

    def to_dict(self) -> dict[str, Any]:
        """For `--json`."""
        return asdict(self)


def check_up(runs_dir: Path) -> list[Finding]:
    """Run all checks, which takes a second or two.

    Args:
        runs_dir: folder of the runs.
    """
    checks: dict[str, Callable[[], tuple[State, str]]] = {
        "touchdown": _touchdown,
        "machine": _machine,
        "libraries": _libraries,
        "JAX": _jax,
        "stock lander": _stock,
        "exact engine": _engine,
        "exactness": _exactness,
        "films": _films,
        "window": _window,
        "extras": _extras,
        "runs": lambda: _runs(runs_dir),
    }
    findings: list[Finding] = []
    for name, check in checks.items():
        try:
            state, text = check()
        except (ImportError, OSError, RuntimeError, UserError, ValueError, GymnasiumError) as error:
            state, text = "bad", one_line(error)
        findings.append(Finding(name, state, text))
    return findings


def _touchdown() -> tuple[State, str]:
    return "good", f"{__version__}, Python {platform.python_version()}"


def _machine() -> tuple[State, str]:
    system = f"{platform.system()} {platform.machine()}"
    return "good", f"{cpu_name()}, {threads.available()} cores, {system}"


def _libraries() -> tuple[State, str]:
    names = ("jax", "equinox", "optax", "numpy", "gymnasium", "box2d")
    found = installation.versions(names)
    missing = [name for name in names if name not in found]
    if missing:
        repair = installation.command_to_repair()
        return "bad", f"not installed: {', '.join(missing)}; install them: {repair}"
    return "good", ", ".join(f"{name} {found[name]}" for name in names)


def _jax() -> tuple[State, str]:
    device.start()
    import jax  # noqa: PLC0415 - it reads its flags when it starts

    devices = cast(list[object], jax.devices())
    return "good", f"computes on {', '.join(map(str, devices))}"


def _stock() -> tuple[State, str]:
    environment.make_env().env.close()
    return "good", "Gymnasium creates LunarLander-v3"


def _engine() -> tuple[State, str]:
    if not engines.engine_built():
        return "note", (
            f"was not built, so the slower stock Gymnasium is used; {installation.how_to_compile()}"
        )
    from touchdown.lander._engine import simd  # noqa: PLC0415 - it may not have been built

    wanted = os.environ.get("TOUCHDOWN_SIMD")
    why = f"TOUCHDOWN_SIMD={wanted}" if wanted else "the widest here; TOUCHDOWN_SIMD overrides it"
    return "good", f"computes with {simd()} ({why})"


def _exactness() -> tuple[State, str]:
    if not engines.engine_built():
        return "note", "not checked, because the exact engine was not built"
    stock = gymnasium.make("LunarLander-v3", disable_env_checker=True)
    ours = gymnasium.make(rules.EXACT_ID, disable_env_checker=True)
    rng = np.random.default_rng(_SEED)
    seed: int | None = _SEED
    ended = True
    for step in range(_STEPS):
        if ended:
            pair = [env.reset(seed=seed)[0].tobytes() for env in (stock, ours)]
            seed, ended = None, False
        else:
            # fall, with the main engine on at times: both legs and the hull touch the ground
            action = int(rng.choice([0, 0, 2]))
            theirs, mine = stock.step(action), ours.step(action)
            pair = [(o.tobytes(), float(r), end) for o, r, end, _, _ in (theirs, mine)]
            ended = mine[2] or mine[3]
        if pair[0] != pair[1]:
            return "bad", (
                f"step {step} differs from stock: the exact engine does not reproduce its results "
                "on this machine; use --engine gymnasium, and please report it"
            )
    stock.close()
    ours.close()
    return "good", f"{_STEPS} steps equal to stock's to the last bit"


def _films() -> tuple[State, str]:
    import imageio_ffmpeg  # noqa: PLC0415 - a missing ffmpeg fails this check alone

    return (
        "good",
        f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()} for MP4; GIFs do not need it",
    )


def _window() -> tuple[State, str]:
    if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))):
        return "note", "no display: `fly` writes films, but `fly --out window` needs one"
    return "good", "a display is available for `fly --out window`"


def _extras() -> tuple[State, str]:
    there = list(filter(installation.is_installed, installation.EXTRAS))
    ways = "; ".join(
        f"{extra}: {installation.command_for(extra)}"
        for extra in installation.EXTRAS
        if extra not in there
    )
    installed = f"installed: {', '.join(there) or 'none'}"
    return "good", f"{installed}; to add others: {ways}" if ways else installed


def _runs(runs_dir: Path) -> tuple[State, str]:
    folder = runs_dir.absolute()
    place = next(path for path in (folder, *folder.parents) if path.exists())
    if not place.is_dir() or not os.access(place, os.W_OK):
        return "bad", f"{place}: is not writable; choose another folder with --runs-dir"
    free = shutil.disk_usage(place).free
    text = f"{folder}, {free / 1e9:,.1f} GB free"
    return ("note", f"{text}, which is low") if free < 1e9 else ("good", text)
