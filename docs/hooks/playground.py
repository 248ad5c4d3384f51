"""Writes the playground beside the pages when the site is built: `play.html`, a file of its own."""

from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig

from touchdown.api import playing


def on_post_build(config: MkDocsConfig) -> None:
    """MkDocs calls this once all pages are written."""
    playing.play(out=Path(config.site_dir) / "play.html", force=True, browser=False)
