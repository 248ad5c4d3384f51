from dataclasses import replace

import pytest

from touchdown.studies import paper


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
        "epsilon-decay", "discount-epsilon-decay", "alike", "pid",
    ]  # fmt: skip
    full = paper.studies("full")
    assert all(study.seeds == 10 for study in full.values())
    quick = paper.studies("quick")
    assert quick["ladder"].seeds == 5
    assert all(study.seeds >= 3 for study in quick.values())


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
