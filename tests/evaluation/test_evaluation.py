from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.evaluator import EpisodeResult
from touchdown.stats.summary import summarise


def evaluation(name: str = "ace", threshold: float | None = 200) -> Evaluation:
    episodes = [
        EpisodeResult(seed=0, episode_return=300.0, steps=10, outcome="landed", fuel=3.0),
        EpisodeResult(seed=1, episode_return=100.0, steps=20, outcome="crashed", fuel=4.0),
    ]
    summary = summarise([300, 100], [10, 20], ["landed", "crashed"], [3.0, 4.0], threshold)
    return Evaluation(name, "LunarLander-v3", episodes, summary)


def test_an_evaluation_is_told_in_a_line():
    assert repr(evaluation()) == (
        "<Evaluation ace: LunarLander-v3, return 200.0 ± 141 (n=2), 50% ≥ 200>"
    )
    assert repr(evaluation("a\nb", threshold=None)) == (
        "<Evaluation a\\nb: LunarLander-v3, return 200.0 ± 141 (n=2)>"
    )


def test_an_evaluation_shows_itself_as_a_table():
    shown = evaluation()._repr_html_()
    assert "<strong>ace</strong>: LunarLander-v3, 2 greedy episodes from starts 0-1" in shown
    assert shown.count("<tr>") == 11
    assert ">landed</td>" in shown


def test_a_name_from_a_file_cannot_add_markup():
    shown = evaluation("<img src=x onerror=alert(1)>")._repr_html_()
    assert "<img" not in shown
    assert "&lt;img src=x onerror=alert(1)&gt;" in shown
