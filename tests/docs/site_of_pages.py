"""Builds the documentation, or some pages of it, without the reference to the code."""

import shutil
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]


def build(folder: Path, pages: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Build a site of these pages in `folder / "site"`, with the project's own settings and hooks.

    Args:
        folder: an empty one.
        pages: the text of each page by its path; pictures and styles come from `docs`.
    """
    docs = folder / "docs"
    for each in ("assets", "pictures", "site.css"):
        source = ROOT / "docs" / each
        (shutil.copytree if source.is_dir() else _copy)(source, docs / each)
    for name, text in pages.items():
        (docs / name).parent.mkdir(parents=True, exist_ok=True)
        (docs / name).write_text(text, "utf-8")
    settings = {
        "INHERIT": str(ROOT / "mkdocs.yml"),
        "docs_dir": str(docs),
        "site_dir": str(folder / "site"),
        "strict": False,  # links to pages that are left out
        "plugins": [],
        "nav": list(pages),
        "hooks": [str(path) for path in sorted((ROOT / "docs" / "hooks").glob("*.py"))],
    }
    (folder / "mkdocs.yml").write_text(yaml.safe_dump(settings), "utf-8")
    command = [sys.executable, "-m", "mkdocs", "build", "-q", "-f", str(folder / "mkdocs.yml")]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, target)
