from touchdown.evaluation.rows import points, summary_rows
from touchdown.stats.summary import summarise


def test_rows_name_what_the_environment_has():
    lander = [name for name, _ in summary_rows("LunarLander-v3", 200)]
    other = [name for name, _ in summary_rows("CartPole-v1", None)]
    assert set(lander) - set(other) == {
        "share ≥ 200",
        "landed",
        "crashed",
        "out of bounds",
        "timed out",
        "fuel",
    }


def test_cells_are_short_and_have_their_units():
    summary = summarise([300, 100], [10, 20], ["landed", "crashed"], [3.0, 4.0], 200)
    cells = {name: cell(summary) for name, cell in summary_rows("LunarLander-v3", 200)}
    assert cells["return, mean ± sd"] == "200.0 ± 141"
    assert cells["share ≥ 200"] == cells["landed"] == cells["crashed"] == "50%"
    assert (cells["timed out"], cells["steps"], cells["fuel"]) == ("0%", "15", "3.5")


def test_small_returns_keep_two_decimals():
    assert (points(0.738, 0), points(-1.5, 1), points(245.77, 1)) == ("0.74", "-1.50", "245.8")
