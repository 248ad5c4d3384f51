"""Equations become MathML where the documentation is built, and nothing else does."""

import re

import equations
import pytest
import site_of_pages
from markdown import Markdown
from mkdocs.config import load_config
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File
from mkdocs.structure.pages import Page

THE_SITE = load_config(str(site_of_pages.ROOT / "mkdocs.yml"))


def html_of(markdown):
    """A page's HTML, with the project's Markdown extensions."""
    extensions, settings = THE_SITE["markdown_extensions"], THE_SITE["mdx_configs"]
    text = Markdown(extensions=extensions, extension_configs=settings).convert(markdown)
    page = Page(None, File("ladder/some.md", "docs", "site", use_directory_urls=False), THE_SITE)
    return equations.on_page_content(text, page=page)


def test_a_block_of_math_is_a_display_in_a_box_of_its_own():
    html = html_of("Before.\n\n```math\nx_1 < \\tfrac12 &= 3\n```\n".replace("&= ", ""))
    assert html.count('<div class="equation"><math display="block">') == 1
    assert "<msub><mi>x</mi><mn>1</mn></msub>" in html
    assert "<mo>&lt;</mo>" in html
    assert "```" not in html


def test_dollars_are_an_inline_equation():
    html = html_of(r"The value is $Q(s',a) > 2$ here.")
    assert html.startswith("<p>The value is <math>")
    assert "<msup><mi>s</mi><mo>′</mo></msup>" in html
    assert "<mo>&gt;</mo>" in html
    assert html.endswith("</math> here.</p>")


def test_punctuation_stays_on_the_line_of_its_equation():
    html = html_of("If $a$, then $b$.")
    assert html.count('<span class="together"><math>') == 2
    assert "</math>,</span> then" in html
    assert "</math>.</span>" in html


@pytest.mark.parametrize(
    "code",
    [
        "```bash\nfor seed in 0 1; do\n  touchdown train --seed $seed --name run-$seed\ndone\n```",
        "`echo $HOME and $PATH`",
        "    export A=$B C=$D",
        "It costs $5, or $ 6, and \\$7 is \\$7.",
    ],
)
def test_dollars_that_are_no_equation_stay_as_they_are(code):
    html = html_of(code)
    assert "<math" not in html
    assert re.sub(r"<[^>]*>", "", html).count("$") == code.count("$")


@pytest.mark.parametrize(
    ("latex", "reason"),
    [
        (r"\gama x", r"`\\gama x`: Unknown command"),
        (r"\frac{1", "reached end of input"),
        ("x_1_2", "Duplicate subscript"),
    ],
)
def test_a_wrong_equation_is_refused_in_one_line_that_names_the_page(latex, reason):
    for text in (f"So ${latex}$ is.", f"```math\n{latex}\n```"):
        with pytest.raises(PluginError, match=reason) as caught:
            html_of(text)
        assert str(caught.value).startswith("ladder/some.md: equation ")
        assert "\n" not in str(caught.value)


def test_a_wrong_equation_fails_the_build(tmp_path):
    built = site_of_pages.build(tmp_path, {"index.md": "# Good\n\n$x$", "bad.md": r"# Bad $\no$"})
    assert built.returncode == 1
    assert (
        built.stderr.strip()
        .splitlines()[-1]
        .endswith(r'bad.md: equation `\no`: Unknown command "\no".')
    )
    assert "Traceback" not in built.stderr
