"""Names and labels that were chosen to do harm, through each page, picture and table."""

import csv

import pytest
from markdown import markdown
from PIL import Image

from finished_runs import write_run
from shown import Shown
from touchdown.config import presets, toml
from touchdown.core.terminal import printable
from touchdown.figures import style
from touchdown.report.comparison import write_comparison
from touchdown.report.study_page import write_study_report
from touchdown.runs.folder import RunFolder
from touchdown.runs.run import Run
from touchdown.studies.claim_tests import Near
from touchdown.studies.claims import Claim
from touchdown.studies.plan import Factor, Level, Study
from touchdown.studies.store import open_store

HOSTILE = (
    "<script>alert(1)</script> [x](javascript:alert(2)) | `a` $x_{$ \"'&lt; # **b** {{ 7 * 7 }} "
    "\x1b[31m\x07 "
)


def seen(name):
    """A name as a reader sees it, with each run of blanks as one."""
    return " ".join(printable(name).split())


def check_page(page, names):
    """Each name is text on the page, nothing else, and the page runs only its own script."""
    read = Shown(page.read_text("utf-8"))
    for name in names:
        assert seen(name) in read.line
    assert read.tags.count("script") == 1
    assert not [href for href in read.values("href") if href.startswith("javascript:")]
    return read


def test_a_studys_names_are_text_in_its_report(tmp_path):
    title, question, factor, one, two, sentence = (
        f"{part} {HOSTILE}{part}" for part in ("t", "q", "f", "one", "two", "s")
    )
    study = Study(
        name="hostile",
        title=title,
        question=question,
        factors=(Factor(factor, (Level(one), Level(two, {"learning.gamma": 0.9}))),),
        seeds=2,
        claims=[Claim(sentence, Near(two, 200, 20))],
    )
    store = open_store(tmp_path / "results", make=True)
    for planned in study.runs():
        path = store.runs / planned.digest
        write_run(path)
        (path / "config.toml").write_text(toml.to_toml(planned.config))
    command = f"touchdown {HOSTILE}x"
    report = write_study_report(study, 2, store, tmp_path / "out", command=command, linked=True)
    names = (title, question, one, two, sentence, command)
    read = check_page(report.page, names)
    assert any(seen(title) in " ".join(alt.split()) for alt in read.values("aria-label"))
    folder = report.page.parent

    summary = (folder / "summary.md").read_text("utf-8")
    read = Shown(markdown(summary, extensions=["tables", "attr_list", "toc"]))
    for name in (title, question, sentence, command):
        assert seen(name) in read.line
    tags = read.tags
    assert [tags.count(tag) for tag in ("h1", "h2", "table", "tbody", "script")] == [1, 1, 1, 1, 0]
    assert tags.count("td") == 3
    assert read.values("href") == ["index.html"]
    assert all((folder / source).is_file() for source in read.values("src"))

    with (folder / "tables" / "claims.csv").open(encoding="utf-8", newline="") as file:
        assert [row["claim"] for row in csv.DictReader(file)] == [sentence]
    with (folder / "tables" / "hostile.csv").open(encoding="utf-8", newline="") as file:
        assert [row[factor] for row in csv.DictReader(file)] == [one, two, one, two]


def test_the_names_of_runs_are_text_in_a_comparison(tmp_path):
    name = "a$x_{$ <b>'\" `|` \x07 \udcff"  # undecodable bytes too
    config = presets.preset("pilot")
    for each in ("plain", name):
        write_run(tmp_path / each)
        (tmp_path / each / "config.toml").write_text(toml.to_toml(config))
    runs = [Run(RunFolder(tmp_path / each)) for each in ("plain", name)]
    page = write_comparison(runs, tmp_path / "out")
    check_page(page, (name,))


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_a_figure_draws_a_name_as_it_is(tmp_path, suffix):
    def drawn(text):
        figure = style.new_figure(4, 3)
        ax = figure.subplots()
        ax.plot([0, 1], label=text)
        ax.set_xticks([0, 1], [text, text])
        ax.set_xlabel(text)
        style.legend_above(ax)
        style.title(figure, text)
        path = tmp_path / f"figure{suffix}"
        style.save(figure, path)
        return Image.open(path).convert("L").tobytes() if suffix == ".png" else path.read_bytes()

    for hostile in ("$x_{$", "$x$", "\x07\x1b\udcff\ufffe"):
        assert drawn(hostile) == drawn(printable(hostile))
    assert drawn("$x$") != drawn("x")
