import pytest

from touchdown.config.presets import preset
from touchdown.core.errors import UserError
from touchdown.studies.space import Choice, Range, digest_of, read_space

GOOD = """
[learning]
learning_rate = { low = 1e-4, high = 2e-3, log = true }
gamma = { low = 0.001, high = 0.1, log = true, from_one = true }
batch_size = [32, 64]
backend = "fused"
target_period = { low = 50, high = 5_000, log = true }
[network]
hidden_sizes = [[64, 64], [128]]
"""


class Trial:
    """Takes the first of everything."""

    def suggest_float(self, _name, low, _high, log):
        assert log
        return low

    def suggest_int(self, _name, low, _high, log):
        assert log
        return low

    def suggest_categorical(self, _name, values):
        assert all(isinstance(value, str | int | float) for value in values)
        return values[0]


def read(text, tmp_path, name="vector-dqn"):
    path = tmp_path / "space.toml"
    path.write_text(text)
    return read_space(path, preset(name))


def test_a_file_has_ranges_and_choices(tmp_path):
    base, space = read(GOOD, tmp_path)
    assert base.learning.backend == "fused"
    assert space == {
        "learning.learning_rate": Range(1e-4, 2e-3, log=True),
        "learning.gamma": Range(0.001, 0.1, log=True, from_one=True),
        "learning.batch_size": Choice((32, 64)),
        "learning.target_period": Range(50, 5_000, log=True, whole=True),
        "network.hidden_sizes": Choice(((64, 64), (128,))),
    }
    drawn = {name: of.suggest(Trial(), name) for name, of in space.items()}
    assert drawn["network.hidden_sizes"] == (64, 64)
    assert drawn["learning.gamma"] == 0.999
    assert drawn["learning.target_period"] == 50


def test_values_that_fit_only_together_may_be_in_any_order(tmp_path):
    text = (
        "[exploration]\nepsilon_start = 0.01\nepsilon_end = 0.001\n[learning]\ngamma = [0.9, 0.99]"
    )
    base, _ = read(text, tmp_path)
    assert (base.exploration.epsilon_start, base.exploration.epsilon_end) == (0.01, 0.001)


def test_another_space_is_another_search(tmp_path):
    one, other = (read(GOOD.replace("32", number), tmp_path)[1] for number in ("32", "16"))
    assert digest_of(one) != digest_of(other)
    assert digest_of(one) == digest_of(read(GOOD, tmp_path)[1])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no settings to search"),
        ("[lerning]\ngamma = [0.9, 0.99]", "unknown field 'lerning'; did you mean learning?"),
        ("gamma = [0.9, 0.99]", "unknown field 'gamma'; it belongs in the table [learning]"),
        ("[learning]\ngama = [0.9, 0.99]", "unknown field 'gama'; did you mean gamma?"),
        ("[learning]\ngamma = 1.5", "gamma = 1.5: must be"),
        ("[learning]\ngamma = 0.9", "has no settings to search"),
        ("[learning]\ngamma = [0.9]", "gamma = [0.9]: must have at least 2 different values"),
        ("[learning]\ngamma = [0.9, 1.5]", "gamma = 1.5: must be"),
        ("[learning]\ngamma = {low = 0.9}", "high"),
        ("[learning]\ngamma = {low = 0.9, high = 0.5}", "high = 0.5: must be above low = 0.9"),
        ("[learning]\ngamma = {low = 0, high = 0.5, log = true}", "low = 0: must be above 0"),
        ("[learning]\ngamma = {low = 0.1, high = 0.5, step = 1}", "step"),
        ("[learning]\nbatch_size = {low = 1.5, high = 9}", "low and high must be whole numbers"),
        ("[learning]\nbatch_size = [32, 32]", "must have at least 2 different values"),
        ("[learning]\nbatch_size = {low = 2, high = 9, from_one = true}", "from_one = true"),
        ("format_version = 2", "format_version = 2: must be 1"),
    ],
)
def test_a_broken_file_names_what_is_wrong(text, said, tmp_path):
    with pytest.raises(UserError) as refused:
        read(text, tmp_path)
    assert said in str(refused.value)
    assert "space.toml" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1
