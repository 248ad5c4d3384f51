"""The worked number of each equation: its arithmetic holds, and the project's code gives it."""

import doctest
import math
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
OTHERS = {"index.md", "results.md", "adding.md"}  # pages without equations of their own
PAGES = [
    DOCS / "algorithms.md",
    *sorted(page for page in (DOCS / "ladder").glob("*.md") if page.name not in OTHERS),
]
NO_EQUATION = {"paper-best"}  # it changes a value, not an equation

EXAMPLE = re.compile(r"^\*\*Example\.\*\* (.*?)^```pycon\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LATEX = (
    (r"\\tfrac(\d)(\d)", r"(\1/\2)"),
    (r"\\cdot", "*"),
    (r"\\lfloor(.*?)\\rfloor", r"floor(\1)"),
    (r"\\lvert(.*?)\\rvert", r"abs(\1)"),
    (r"\\log (\d+)", r"log(\1)"),
)
"""All that arithmetic in an example may have besides digits, signs and parentheses."""


def value_of(latex):
    """The number that a part of an equation is, None if it is not arithmetic."""
    for pattern, python in LATEX:
        latex = re.sub(pattern, python, latex)
    if not re.fullmatch(r"(?:[-+*/().\d\s]|floor|abs|log)+", latex):
        return None
    return float(eval(latex, {"floor": math.floor, "log": math.log}))  # noqa: S307 - arithmetic only


def results(prose):
    """The result of each `$... = arithmetic = number$`, after checking it."""
    found = []
    for span in re.findall(r"\$([^$]+)\$", prose):
        values = [value for part in span.split("=") if (value := value_of(part)) is not None]
        if len(values) > 1:
            assert all(abs(value - values[-1]) < 5e-4 for value in values), span
            found.append(values[-1])
    return found


def printed(code):
    """The numbers in what an example's code prints."""
    outputs = [example.want for example in doctest.DocTestParser().get_examples(code)]
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", " ".join(outputs))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_equation_is_followed_by_an_example(page):
    before, *parts = page.read_text("utf-8").split("```math\n")
    assert parts or page.stem in NO_EQUATION
    assert "**Example.**" not in before
    for part in parts:
        assert EXAMPLE.search(part), part


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_arithmetic_of_an_example_holds_and_its_code_prints_the_result(page):
    for prose, code in EXAMPLE.findall(page.read_text("utf-8")):
        found = results(prose)
        assert found, prose
        assert any(abs(found[-1] - number) < 5e-4 for number in printed(code)), prose


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_of_an_example_prints_what_the_page_says(page):
    said = []
    for _, code in EXAMPLE.findall(page.read_text("utf-8")):
        test = doctest.DocTestParser().get_doctest(code, {}, page.stem, str(page), 0)
        doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert "".join(said) == ""


@pytest.mark.parametrize(
    ("prose", "found"),
    [
        (r"$Y = 1 + \tfrac12 \cdot 4 = 3$ and $\gamma = 2$", [3.0]),
        (r"$\lfloor 0.7 \cdot 2 \rfloor = 1$, $\lvert \tfrac14 - 1 \rvert = 0.75$", [1.0, 0.75]),
        (r"$\tfrac12 \cdot \log 4 = 0.693$", [0.693]),
    ],
)
def test_arithmetic_is_read_from_latex(prose, found):
    assert results(prose) == found


def test_wrong_arithmetic_is_noticed():
    with pytest.raises(AssertionError, match="4 = 4"):
        results(r"$1 + \tfrac12 \cdot 4 = 4$")
