"""Builds all C++ with sanitizers, then tests it.

The C++ tests run first, among them a fuzzer: with the thread sanitizer, then with those for
addresses and undefined behaviour. With the latter, the engine is then compared with stock and used
at random from Python, and the fused updates and the training loop are compared with their slow
twins by their own tests. `make sanitize` runs it. A finding ends the process at once and is
printed.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUILD = ROOT / "build" / "sanitized"
THREADS = ROOT / "build" / "thread-sanitized"
TOOLS = Path(sys.executable).parent
ORACLES = ROOT / "tests" / "lander" / "engine"
FUSED_TESTS = ROOT / "tests" / "agents" / "learners" / "test_fused.py"
LOOP_TESTS = [ROOT / "tests" / "training" / f"test_compiled{name}.py" for name in ("", "_pqn")]
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
FUZZ = f"""{BUILT_FIRST}
import fuzzer
from touchdown.lander import _engine
assert "sanitized" in _engine.__file__, _engine.__file__
fuzzer.main(40)
"""
LEARN = f"""{BUILT_FIRST}
from touchdown.agents.learners import _fused
from touchdown.training import _train
for module in (_fused, _train):
    assert "sanitized" in module.__file__, module.__file__
import pytest
tests = {[str(path) for path in (FUSED_TESTS, *LOOP_TESTS)]!r}
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", "-n", "0", *tests]))
"""


def library(name: str) -> str:
    """Where the compiler keeps a sanitizer's library."""
    compiler = os.environ.get("CXX", "c++")
    found = subprocess.run(
        [compiler, f"-print-file-name={name}"], capture_output=True, text=True, check=True
    )
    return found.stdout.strip()


def build(folder: Path, sanitizers: str, *modules: str) -> None:
    """Build the C++ code and its tests into a folder.

    Args:
        folder: where to build.
        sanitizers: the compiler's names of them.
        modules: what CMake needs for the Python modules; they are left out without it.
    """
    configure = [
        *(str(TOOLS / "cmake"), "-S", str(ROOT), "-B", str(folder), "-G", "Ninja"),
        *("-DCMAKE_BUILD_TYPE=Debug", f"-DTOUCHDOWN_SANITIZE={sanitizers}"),
        *("-DTOUCHDOWN_TESTS=ON", f"-DCMAKE_MAKE_PROGRAM={TOOLS / 'ninja'}"),
        *(modules or ("-DTOUCHDOWN_MODULES=OFF",)),
    ]
    for command in (configure, [str(TOOLS / "cmake"), "--build", str(folder)]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def run_cpp_tests(folder: Path, only: str = ".", rounds: int = 5) -> int:
    """Run the C++ tests of a build, and return their exit code.

    Args:
        folder: the build.
        only: a regular expression for their names.
        rounds: of the fuzzer.
    """
    ctest = [str(TOOLS / "ctest"), "--test-dir", str(folder), "--output-on-failure", "-R", only]
    fuzzing = {**os.environ, "TOUCHDOWN_FUZZ_ROUNDS": str(rounds)}
    return subprocess.run(ctest, env=fuzzing, check=False).returncode


def main() -> int:
    build(THREADS, "thread")
    build(BUILD, "address,undefined", f"-DPython_EXECUTABLE={sys.executable}")
    # nothing else has threads, and this sanitizer is slow
    failed = run_cpp_tests(THREADS, "engine/(batch|fuzz|workers)", rounds=2) or run_cpp_tests(BUILD)
    if failed:
        return failed
    package = BUILD / "package"
    shutil.rmtree(package, ignore_errors=True)
    shutil.copytree(
        ROOT / "src" / "touchdown", package / "touchdown", ignore=shutil.ignore_patterns("*.so")
    )
    install = [str(TOOLS / "cmake"), "--install", str(BUILD), "--prefix", str(package)]
    subprocess.run(install, check=True, stdout=subprocess.DEVNULL)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join((str(package), str(ORACLES))),
        "LD_PRELOAD": f"{library('libasan.so')} {library('libubsan.so')}",
        # Python keeps what it has until it ends
        "ASAN_OPTIONS": "detect_leaks=0:detect_stack_use_after_return=1",
        "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1",
    }
    for script in (FLY, FUZZ, LEARN):
        ended = subprocess.run([sys.executable, "-c", script], env=environment, check=False)
        if ended.returncode:
            return ended.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
