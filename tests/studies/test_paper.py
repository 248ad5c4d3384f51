import hashlib
from dataclasses import replace

import pytest

from touchdown.studies import paper
from touchdown.studies.paper.levels import SPENDING


@pytest.mark.parametrize("scale", paper.SCALES)
def test_every_claim_is_about_levels_that_are_run(scale):
    for topic in paper.topics(scale).values():
        if topic.name in ("alike", "pid"):
            continue
        # a study's own claims are checked where it is made
        assert replace(topic.study, claims=topic.claims).claims == topic.claims


def test_the_studies_are_those_of_the_paper():
    assert list(paper.topics("quick")) == [
        "ladder", "hover", "size", "depth", "target-period", "resaves", "discount",
        "epsilon-decay", "discount-epsilon-decay", "combination", "alike", "pid",
    ]  # fmt: skip
    full = paper.studies("full")
    assert all(study.seeds == 10 for study in full.values())
    quick = paper.studies("quick")
    assert quick["ladder"].seeds == 5
    assert all(study.seeds >= 3 for study in quick.values())


def test_the_combination_has_the_levels_of_all_studies_of_one_setting_and_no_run_of_its_own():
    studies = paper.studies("full")
    cells = studies["combination"].cells()
    assert cells[0].name == paper.BEST
    others = ("size", "depth", "target-period", "resaves", "discount", "epsilon-decay")
    known = {cell.config.digest for name in others for cell in studies[name].cells()}
    assert {cell.config.digest for cell in cells} == known
    assert len(cells) == len(known)


def test_the_full_scale_decides_in_looks_on_seeds_that_nobody_has_seen():
    full = paper.studies("full")
    assert {tuple(study.looks) for study in full.values()} == {(30, 60, 120)}
    assert {study.first_seed for study in full.values()} == {10}
    assert min(job.tuning.seed for job in paper.pid_jobs("full")) == 10
    assert not any(study.looks for study in paper.studies("quick").values())


def test_the_plan_is_the_one_of_its_commit():
    planned = [
        (topic.name, claim.sentence, repr(claim.test), claim.metric or topic.metric)
        for topic in paper.topics("full").values()
        for claim in topic.claims
    ]
    planned += [
        (study.name, cell.name, cell.config.digest, study.first_seed, tuple(study.looks))
        for study in paper.studies("full").values()
        for cell in study.cells()
    ]
    planned.append((SPENDING, paper.PLAN_COMMIT))
    # a change of the plan needs fresh seeds and another commit, whose name is hashed, too
    assert hashlib.sha256(repr(planned).encode()).hexdigest()[:12] == "c539dc9ad004"


@pytest.mark.parametrize("scale", paper.SCALES)
def test_the_studies_of_one_setting_have_the_papers_best_for_their_base(scale):
    studies = paper.studies(scale)
    best = next(cell for cell in studies["ladder"].cells() if cell.labels == (paper.BEST,))
    for name, study in studies.items():
        if name in ("ladder", "discount-epsilon-decay"):
            continue
        assert study.base_cell().config.digest == best.config.digest, name
    map_cells = [cell.config.digest for cell in studies["discount-epsilon-decay"].cells()]
    assert best.config.digest in map_cells


def test_nodes_in_all_add_up_to_100():
    cells = paper.studies("quick")["depth"].cells()
    in_all = [c for c in cells if sum(c.config.network.hidden_sizes) == 100]
    assert [len(c.config.network.hidden_sizes) for c in in_all] == [1, 2, 3, 4, 5]
