"""The house: what lies where, and how large a file may grow."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST_LINES = 400


def test_no_source_file_is_longer_than_a_reader_can_hold():
    sources = [
        path
        for folder in ("src", "csrc")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".pyi", ".cpp", ".hpp", ".txt", ".css", ".js", ".j2")
    ]
    assert len(sources) > 100
    lengths = {path: len(path.read_text("utf-8").splitlines()) for path in sources}
    assert {path for path, lines in lengths.items() if lines > MOST_LINES} == set()


def test_the_top_level_of_the_package_is_folders_and_the_public_face():
    package = ROOT / "src" / "touchdown"
    loose = {path.name for path in package.iterdir() if path.is_file()}
    assert loose == {"__init__.py", "__main__.py", "py.typed"}


def test_every_folder_of_the_package_says_what_it_is_for():
    package = ROOT / "src" / "touchdown"
    for init in package.rglob("__init__.py"):
        assert init.read_text("utf-8").startswith('"""'), init


def test_tests_mirror_the_package():
    package, tests = ROOT / "src" / "touchdown", ROOT / "tests"
    folders = {path.parent.relative_to(package) for path in package.rglob("__init__.py")}
    tested = {path.parent.relative_to(tests) for path in tests.rglob("test_*.py")}
    # the documentation, random input, and the C++ engine, whose Python side is one compiled module
    extra = {Path("docs"), Path("fuzz"), Path("lander/engine")}
    assert tested - folders - extra == set()
