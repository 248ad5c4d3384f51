"""A wheel of this project, and an environment that it is installed in."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def wheel_without_compiler(folder: Path) -> Path:
    """Build the wheel as on a machine without a C++ compiler, which takes seconds.

    Args:
        folder: where to build it.
    """
    tools = folder / "tools"  # all that is on PATH: neither c++ nor another compiler
    tools.mkdir()
    for name in ("cmake", "ninja", "git", "uname"):
        found = shutil.which(name, path=f"{Path(sys.executable).parent}{os.pathsep}{os.defpath}")
        if found:
            (tools / name).symlink_to(found)
    source = folder / "source"  # not here, where a build folder knows of a compiler
    for name in ("src", "csrc", "CMakeLists.txt", "pyproject.toml", "README.md", "LICENSE"):
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        source.mkdir(exist_ok=True)
        copy(ROOT / name, source / name)
    env = {name: of for name, of in os.environ.items() if name not in ("CC", "CXX", "PYTHONPATH")}
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
         "--disable-pip-version-check", "--wheel-dir", str(folder), str(source)],
        check=True,
        capture_output=True,
        env=env | {"PATH": str(tools)},
    )  # fmt: skip
    (wheel,) = folder.glob("*.whl")
    return wheel
