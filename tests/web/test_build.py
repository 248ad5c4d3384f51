"""The compiled module is that of the sources."""

import importlib.util
import shutil
from pathlib import Path

import pytest
from javascript import MODULE, encoded, in_node

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def build():
    spec = importlib.util.spec_from_file_location("build", ROOT / "csrc/web/build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_module_was_compiled_from_these_sources_with_these_options(build):
    assert build.DIGESTS.read_text() == build.digests(), "stale: run `make wasm`"


def test_a_change_to_any_header_makes_it_stale(build):
    names = build.with_includes()
    assert {"web/lander.cpp", "engine/math.hpp", "fused/few.hpp", "simd/kernel_target.hpp"} <= names
    assert not any("python" in name for name in names)


def test_the_module_is_small_and_needs_nothing_of_its_page():
    assert MODULE.stat().st_size < 300_000
    assert in_node("modules.js", "imports", {"module": encoded(MODULE)}) == []


@pytest.mark.slow
def test_it_compiles_to_the_same_bytes_in_any_folder(build, tmp_path, monkeypatch):
    for number in range(2):
        folder = tmp_path / f"copy{number}" / ("deeper" * number)
        shutil.copytree(ROOT / "csrc", folder / "csrc")
        # nothing is taken from an earlier compilation
        monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / f"cache{number}"))
        monkeypatch.setenv("ZIG_LOCAL_CACHE_DIR", str(tmp_path / f"cache{number}"))
        assert build.compiled(folder / "csrc") == MODULE.read_bytes()
