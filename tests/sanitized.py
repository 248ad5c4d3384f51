"""Builds all C++ with address and undefined-behaviour sanitizers, then tests it.

The C++ tests run first. Then the engine is compared with stock, and the fused updates with JAX by
their own tests. `make sanitize` runs it. A finding ends the process at once and is printed.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "sanitized"
ORACLES = ROOT / "tests" / "lander" / "engine"
FUSED_TESTS = ROOT / "tests" / "agents" / "learners" / "test_fused.py"
# otherwise the editable install would come before the build in PYTHONPATH
BUILT_FIRST = """
import sys
sys.meta_path = [f for f in sys.meta_path if "Redirecting" not in type(f).__name__]
"""
FLY = f"""{BUILT_FIRST}
import oracle
from touchdown.lander import _engine
assert "sanitized" in _engine.__file__, _engine.__file__
reports = {{name: oracle.compare(settings, range(5, 12), num_threads=2, where=f"{{name}}, ")
           for name, settings in oracle.CONFIGURATIONS.items()}}
sys.stdout.write(oracle.summary(reports))
sys.exit(any(report.difference for report in reports.values()))
"""
LEARN = f"""{BUILT_FIRST}
from touchdown.agents.learners import _fused
assert "sanitized" in _fused.__file__, _fused.__file__
import pytest
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", "-n", "0", {str(FUSED_TESTS)!r}]))
"""


def library(name: str) -> str:
    """Where the compiler keeps a sanitizer's library."""
    compiler = os.environ.get("CXX", "c++")
    found = subprocess.run(
        [compiler, f"-print-file-name={name}"], capture_output=True, text=True, check=True
    )
    return found.stdout.strip()


def main() -> int:
    tools = Path(sys.executable).parent
    package = BUILD / "package" / "touchdown"
    shutil.rmtree(BUILD / "package", ignore_errors=True)
    shutil.copytree(ROOT / "src" / "touchdown", package, ignore=shutil.ignore_patterns("*.so"))
    configure = [
        *(str(tools / "cmake"), "-S", str(ROOT), "-B", str(BUILD), "-G", "Ninja"),
        *("-DCMAKE_BUILD_TYPE=Debug", "-DTOUCHDOWN_SANITIZE=ON", "-DTOUCHDOWN_TESTS=ON"),
        *(f"-DCMAKE_MAKE_PROGRAM={tools / 'ninja'}", f"-DPython_EXECUTABLE={sys.executable}"),
    ]
    build = [str(tools / "cmake"), "--build", str(BUILD)]
    install = [str(tools / "cmake"), "--install", str(BUILD), "--prefix", str(BUILD / "package")]
    for command in (configure, build, install):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    ctest = [str(tools / "ctest"), "--test-dir", str(BUILD), "--output-on-failure"]
    tested = subprocess.run(ctest, check=False)
    if tested.returncode:
        return tested.returncode
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join((str(BUILD / "package"), str(ORACLES))),
        "LD_PRELOAD": f"{library('libasan.so')} {library('libubsan.so')}",
        # Python keeps what it has until it ends
        "ASAN_OPTIONS": "detect_leaks=0:detect_stack_use_after_return=1",
        "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1",
    }
    for script in (FLY, LEARN):
        ended = subprocess.run([sys.executable, "-c", script], env=environment, check=False)
        if ended.returncode:
            return ended.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
