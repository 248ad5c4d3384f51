"""Compile the engine to WebAssembly: `make wasm` writes lander.wasm and its digests.

Digests tell whether it is stale. The module has no imports, and the same sources give the same
bytes in any folder.
"""

import hashlib
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[2]
TARGET = ROOT / "src/touchdown/web/static/lander.wasm"
DIGESTS = ROOT / "csrc/web/lander.sha256"

_CSRC = ROOT / "csrc"
_SOURCES = (
    "engine/kernel.cpp",
    "engine/lander.cpp",
    "engine/lane_kernel.cpp",
    "fused/network.cpp",
    "web/lander.cpp",
    "web/libm/replaced.cpp",
    "web/network.cpp",
    "web/support.cpp",
)
_OPTIONS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-msimd128"),
    # the engine's own options, see csrc/CMakeLists.txt
    *("-std=c++20", "-O2", "-ffp-contract=off", "-fno-fast-math"),
    *("-fno-rtti", "-fno-threadsafe-statics", "-Wl,--gc-sections", "-s"),
    *("-Wall", "-Wextra", "-Wno-psabi", "-Wno-missing-field-initializers", "-Werror"),
)
_INCLUDE = re.compile(r'^#include "(.+)"$', re.MULTILINE)


def main() -> None:
    """Write the module and the digests."""
    TARGET.write_bytes(compiled(_CSRC))
    DIGESTS.write_text(digests())
    print(f"{TARGET.relative_to(ROOT)}: {TARGET.stat().st_size / 1024:.0f} KiB")  # noqa: T201


def compiled(csrc: Path) -> bytes:
    """The module, compiled from a copy of `csrc`.

    Raises:
        CalledProcessError: the compiler failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "lander.wasm"
        command = [sys.executable, "-m", "ziglang", "c++", *_OPTIONS, "-I.", *_SOURCES]
        subprocess.run([*command, "-o", str(module)], cwd=csrc, check=True)  # noqa: S603
        return module.read_bytes()


def digests() -> str:
    """SHA-256 of the module, and of what it is made of: sources, options, compiler version."""
    parts = [version("ziglang"), *_OPTIONS]
    for name in sorted(with_includes()):
        parts += [name, (_CSRC / name).read_text()]
    made_of = hashlib.sha256("\0".join(parts).encode())
    module = hashlib.sha256(TARGET.read_bytes())
    return f"{module.hexdigest()}  lander.wasm\n{made_of.hexdigest()}  its sources\n"


def with_includes() -> set[str]:
    """The sources and our headers that they include, directly or through others."""
    found: set[str] = set()
    waiting = list(_SOURCES)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _INCLUDE.findall((_CSRC / name).read_text())
    return found


if __name__ == "__main__":
    main()
