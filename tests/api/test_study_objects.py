"""A study that is made in Python is run, followed and reported like one in a file."""

from dataclasses import replace
from html import unescape

import pytest

import touchdown
from finished_runs import write_run
from touchdown.api.studies import estimate_study
from touchdown.cli import app
from touchdown.config import toml
from touchdown.core.errors import UserError
from touchdown.studies import Claim, Factor, Greater, Near, Study
from touchdown.studies.executors import Event, LocalExecutor
from touchdown.studies.store import open_store
from touchdown.studies.study_file import from_toml, to_toml

STUDY = Study(
    name="mine",
    question="Is it better?",
    base=touchdown.preset("pilot"),
    factors=[Factor.of("learning.gamma", [0.9, 0.99])],
    seeds=2,
    claims=[
        Claim("A longer horizon is better.", Greater("0.99", "0.9", margin=20)),
        Claim("It is about 200.", Near("0.9", 200, 20)),
    ],
)
RETURNS = {"0.9": (195.0, 205.0), "0.99": (105.0, 95.0)}


def store_of(folder, seeds=2):
    """A folder of results that holds these seeds of the study's runs."""
    store = open_store(folder, make=True)
    for run in STUDY.runs(seeds):
        path = store.runs / run.digest
        write_run(path, (RETURNS[run.cell.name][run.seed],))
        (path / "config.toml").write_text(toml.to_toml(run.config))
    return store


def test_its_pieces_are_public_and_found_at_two_places():
    assert touchdown.Study is Study
    assert (touchdown.Factor, touchdown.Claim) == (Factor, Claim)
    assert touchdown.Level.__name__ == "Level"
    with pytest.raises(AttributeError, match="no attribute 'Luck'"):
        touchdown.studies.Luck  # noqa: B018 - the look-up is the test


def test_runs_that_are_there_are_done_and_only_further_seeds_are_missing(tmp_path):
    store_of(tmp_path)
    (before,) = touchdown.study_status(STUDY, results_dir=tmp_path)
    assert (before.name, before.runs, before.done) == ("mine", 4, 4)
    state = touchdown.run_study(STUDY, results_dir=tmp_path, executor=LocalExecutor(1))
    assert (state.total, state.done, state.failed) == (4, 4, {})
    (more,) = touchdown.study_status(STUDY, seeds=5, results_dir=tmp_path)
    assert (more.runs, more.done, more.unfinished) == (10, 4, 0)
    added = next(run for run in STUDY.runs(5) if run.seed == 4)
    (tmp_path / "runs" / added.digest).mkdir()
    (more,) = touchdown.study_status(STUDY, seeds=5, results_dir=tmp_path)
    assert (more.runs, more.done, more.unfinished) == (10, 4, 1)
    assert "study run" in more.command
    assert estimate_study(STUDY, results_dir=tmp_path, workers=1).missing == 0


def test_once_run_the_command_line_knows_it_by_its_name(tmp_path, capsys):
    store_of(tmp_path)
    touchdown.run_study(STUDY, results_dir=tmp_path, executor=LocalExecutor(1))
    kept = tmp_path / "begun" / "mine.toml"
    assert from_toml(kept) == STUDY
    (status,) = touchdown.study_status(results_dir=tmp_path)
    assert (status.name, status.done) == ("mine", 4)
    app.main(["study", "report", "mine", "--results-dir", str(tmp_path)])
    printed = capsys.readouterr().out
    assert "undecided" in printed
    assert "A longer horizon is better." in printed
    text = unescape((tmp_path / "reports/mine/index.html").read_text())
    assert f"touchdown study run {kept} --results-dir {tmp_path} && touchdown study report" in text
    app.main(["study", "run", str(kept), "--results-dir", str(tmp_path)])
    assert "4 of 4 runs are done" in capsys.readouterr().out
    assert from_toml(kept) == STUDY


def test_its_report_has_its_verdicts(tmp_path):
    store_of(tmp_path)
    report = touchdown.study_report(STUDY, results_dir=tmp_path, out=tmp_path / "page")
    assert [d.claim for d in report.decisions["mine"]] == list(STUDY.claims)
    assert [d.verdict for d in report.decisions["mine"]] == ["undecided", "undecided"]
    text = report.page.read_text()
    assert text.count('class="evidence"') == 2
    # it was never started here: there is no file to name
    assert f"touchdown.run_study(study, results_dir='{tmp_path}')" in unescape(text)
    assert (
        "| A longer horizon is better. | **undecided** | 2 finished seeds of each level"
        in (tmp_path / "page" / "summary.md").read_text()
    )


def test_a_changed_study_of_the_same_name_takes_its_place(tmp_path):
    store_of(tmp_path)
    touchdown.run_study(STUDY, results_dir=tmp_path, executor=LocalExecutor(1))
    changed = replace(STUDY, claims=(), seeds=1)
    state = touchdown.run_study(changed, results_dir=tmp_path, executor=LocalExecutor(1))
    assert (state.total, state.done) == (2, 2)
    assert from_toml(tmp_path / "begun" / "mine.toml") == changed
    # what is asked about is what is given, not what is kept
    (status,) = touchdown.study_status(STUDY, results_dir=tmp_path)
    assert status.runs == 4


def test_the_number_of_seeds_that_was_asked_for_last_is_remembered(tmp_path):
    store_of(tmp_path)
    touchdown.run_study(STUDY, seeds=1, results_dir=tmp_path, executor=LocalExecutor(1))
    for which in (STUDY, "mine", None):
        (status,) = touchdown.study_status(which, results_dir=tmp_path)
        assert status.runs == 2


def test_a_study_in_a_file_is_started_from_a_path_too_and_then_its_own_file_counts(tmp_path):
    results = store_of(tmp_path / "results").path
    touchdown.run_study(STUDY, results_dir=results, executor=LocalExecutor(1))
    file = tmp_path / "mine.toml"
    file.write_text(to_toml(replace(STUDY, seeds=1)))
    state = touchdown.run_study(file, results_dir=results, executor=LocalExecutor(1))
    assert state.total == 2
    (status,) = touchdown.study_status("mine", results_dir=results)
    assert status.runs == 2
    (status,) = touchdown.study_status(file, results_dir=results)
    assert status.runs == 2


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ladder", "name = 'ladder': is one of the paper's; choose another"),
        ("paper", "name = 'paper': is one of the paper's; choose another"),
        ("claims", "name = 'claims': is reserved for the table of claims; choose another"),
    ],
)
def test_a_name_that_is_taken_is_refused_before_anything_is_written(name, said, tmp_path):
    with pytest.raises(UserError, match=said):
        touchdown.run_study(replace(STUDY, name=name), results_dir=tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_a_report_of_a_study_that_was_not_run_says_how_to_run_it(tmp_path):
    open_store(tmp_path, make=True)
    with pytest.raises(
        UserError, match=r"start it with: touchdown\.run_study\(study, results_dir="
    ):
        touchdown.study_report(STUDY, results_dir=tmp_path)


class Planted:
    """An executor whose runs have returns by their discount and their seed."""

    workers = 1

    def __init__(self, return_of):
        self.return_of = return_of
        self.stages = []

    def run(self, jobs, store, on_event, should_stop):
        del should_stop
        self.stages.append([(job.config.learning.gamma, job.config.seed) for job in jobs])
        for job in jobs:
            on_event(Event(job.digest, "started"))
            found = self.return_of(job.config.learning.gamma, job.config.seed)
            write_run(store / job.digest, (found,))
            (store / job.digest / "config.toml").write_text(toml.to_toml(job.config))
            on_event(Event(job.digest, "done"))


def looking(**changes):
    """The study with looks, and a third level about which nothing is claimed."""
    factor = Factor.of("learning.gamma", [0.9, 0.99, 0.5])
    return replace(STUDY, factors=[factor], looks=[10, 20, 40], claims=STUDY.claims[:1], **changes)


def test_it_runs_from_look_to_look_with_more_seeds_where_a_claim_is_open(tmp_path):
    planted = Planted(lambda gamma, seed: 100.0 * gamma * 10 + 7 * ((seed * 7) % 5))
    state = touchdown.run_study(
        looking(), until_decided=True, results_dir=tmp_path, executor=planted
    )
    assert (state.total, state.done) == (42, 42)
    first, second = planted.stages
    assert len(first) == 22  # two seeds of the level that no claim names
    assert {gamma for gamma, _ in second} == {0.9, 0.99}
    assert {seed for _, seed in second} == set(range(10, 20))
    report = touchdown.study_report("mine", results_dir=tmp_path, progress=False)
    (status,) = touchdown.study_status("mine", results_dir=tmp_path)
    assert status.runs == status.done
    (decision,) = report.decisions["mine"]
    assert decision.verdict == "holds"
    assert "decided at look 2 of 3, 20 seeds" in decision.evidence
    assert report.results["mine"].missing == 0
    again = Planted(lambda *_: pytest.fail("nothing is missing"))
    touchdown.run_study(looking(), until_decided=True, results_dir=tmp_path, executor=again)


def test_a_page_between_two_looks_says_how_many_runs_open_claims_need(tmp_path):
    planted = Planted(lambda gamma, seed: 100.0 * gamma * 10 + 7 * ((seed * 7) % 5))
    touchdown.run_study(looking(), seeds=10, results_dir=tmp_path, executor=planted)
    report = touchdown.study_report("mine", results_dir=tmp_path, progress=False)
    assert report.results["mine"].missing == 20
    text = report.page.read_text()
    assert "20 of 50 runs are not done yet" in text


def test_a_run_that_fails_holds_up_its_own_claim_alone(tmp_path):
    class Failing(Planted):
        def run(self, jobs, store, on_event, should_stop):
            bad = [j for j in jobs if (j.config.learning.gamma, j.config.seed) == (0.5, 3)]
            for job in bad:
                on_event(Event(job.digest, "failed", text="it diverged"))
            super().run([job for job in jobs if job not in bad], store, on_event, should_stop)

    about = Claim("It is about 500.", Near("0.5", 500, 20))
    study = looking()
    study = replace(study, claims=[*study.claims, about])
    failing = Failing(lambda gamma, seed: 100.0 * gamma * 10 + 7 * ((seed * 7) % 5))
    state = touchdown.run_study(study, until_decided=True, results_dir=tmp_path, executor=failing)
    assert list(state.failed.values()) == ["it diverged"]
    report = touchdown.study_report("mine", results_dir=tmp_path, progress=False)
    decided, waiting = report.decisions["mine"]
    assert decided.verdict == "holds"
    assert waiting.evidence.startswith(
        "9 of 10 seeds of each level have this number; the first look is at 10"
    )
    assert "--until-decided" in report.page.read_text()


@pytest.mark.parametrize(
    ("study", "settings", "said"),
    [
        (STUDY, {}, "study 'mine': has no looks for --until-decided; plan them, such as looks"),
        ("paper", {}, "study 'paper': has no looks for --until-decided; choose --scale full"),
        ("pid", {}, "study 'pid': has no looks"),
        (looking(), {"seeds": 3}, "seeds = 3: must be left out; the looks say how many"),
    ],
)
def test_looks_that_were_not_planned_are_refused(tmp_path, study, settings, said):
    with pytest.raises(UserError, match=said):
        touchdown.run_study(study, until_decided=True, results_dir=tmp_path / "new", **settings)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("looks", "said"),
    [
        ([10, 10], r"looks = \[10, 10\]: must increase"),
        ([5, 10], r"looks = \[5, 10\]: must begin with at least 10, for its claims"),
        ([10, 20_000], "seeds = 20000: must be from 1"),
        ([10, "20"], "looks = .*: must be a list of int"),
    ],
)
def test_looks_that_cannot_be_kept_are_refused(looks, said):
    with pytest.raises(UserError, match=said):
        replace(STUDY, looks=looks)
