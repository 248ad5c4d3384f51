from pathlib import Path
from xml.etree import ElementTree

import pytest
import sample_page

from touchdown.figures import style
from touchdown.report.svg import themed_svg

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'


def themed(inside: str) -> str:
    """What is in the root afterwards."""
    text = themed_svg(f"{HEAD}{inside}</svg>", "p:")
    return text[text.index(">") + 1 : -len("</svg>")]


def elements(text: str) -> list[ElementTree.Element]:
    return list(ElementTree.fromstring(text).iter())  # noqa: S314 - drawn here


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> str:
    picture = sample_page.rows_picture(tmp_path_factory.mktemp("pictures") / "rows")
    assert picture.svg is not None
    return picture.svg.read_text("utf-8")


def test_the_houses_colours_become_the_pages_variables():
    assert themed(f'<path style="fill: {style.INK}; stroke: {style.BLUE.upper()}"/>') == (
        '<path style="fill: var(--ink); stroke: var(--blue)" />'
    )
    assert themed('<path fill="#0072b3"/>') == '<path fill="#0072b3" />'  # none of the house's


def test_white_shapes_become_the_card_and_white_letters_stay():
    assert themed('<path style="fill: #ffffff"/>') == '<path style="fill: var(--card)" />'
    assert themed('<g style="fill: #ffffff"><use/></g>') == '<g style="fill: #ffffff"><use /></g>'


def test_ids_and_what_refers_to_them_have_the_prefix():
    assert themed('<clipPath id="a"/><g clip-path="url(#a)"><use xlink:href="#a"/></g>') == (
        '<clipPath id="p:a" /><g clip-path="url(#p:a)"><use href="#p:a" /></g>'
    )


@pytest.mark.parametrize(
    "harm",
    [
        "<script>alert(1)</script>",
        "<foreignObject><b>x</b></foreignObject>",
        "<style>* { color: red }</style>",
        "<metadata>who and when</metadata>",
        '<a xlink:href="javascript:alert(1)"><path/></a>',
        "<!-- onload=alert(1) -->",
    ],
)
def test_what_is_no_shape_is_left_out(harm: str):
    assert themed(f"<g>{harm}</g>") == "<g />"


@pytest.mark.parametrize(
    "harm",
    [
        'onclick="alert(1)"',
        'xlink:href="https://example.org/x.png"',
        'xlink:href="javascript:alert(1)"',
        'style="fill: url(https://example.org/x)"',
    ],
)
def test_what_acts_or_fetches_is_left_out(harm: str):
    assert themed(f"<image {harm}/>") == "<image />"


def test_pixels_in_the_file_stay():
    image = '<image href="data:image/png;base64,AAAA" />'
    assert themed(image) == image


def test_a_picture_takes_the_width_of_the_page_in_its_own_shape(drawn: str):
    before, after = elements(drawn)[0], elements(themed_svg(drawn, "p:"))[0]
    assert not {"width", "height"} & set(after.attrib)
    assert after.attrib["viewBox"] == before.attrib["viewBox"]


def test_all_that_matplotlib_drew_is_there(drawn: str):
    before = [each.tag.rpartition("}")[2] for each in elements(drawn)]
    after = [each.tag for each in elements(themed_svg(drawn, "p:"))]
    for shape in ("path", "use", "clipPath", "g"):
        assert before.count(shape) == after.count(shape) > 0


def test_no_colour_of_the_house_is_left_as_it_was(drawn: str):
    found = themed_svg(drawn, "p:").lower()
    for colour in (style.INK, style.MUTED, style.FAINT, style.BLUE, style.ORANGE, "#ffffff"):
        assert colour in drawn
        assert colour not in found


def test_words_keep_their_blanks():
    words = "<text>a <tspan>b</tspan> c</text>"
    assert themed(words) == words


@pytest.mark.parametrize("text", ["", "<svg>", "<html/>", "no picture"])
def test_what_is_no_svg_is_refused(text: str):
    with pytest.raises(ValueError, match=r"."):
        themed_svg(text, "p:")


def test_a_variable_of_a_picture_is_one_that_the_page_has(drawn: str):
    css = Path(style.__file__).with_name("palette.css").read_text("utf-8")
    used = {part.partition(")")[0] for part in themed_svg(drawn, "p:").split("var(")[1:]}
    assert used
    assert all(f"{name}: light-dark(" in css for name in used)
