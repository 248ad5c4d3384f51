import numpy as np
import pytest
from numpy.testing import assert_array_equal

from touchdown.agents.qtable import QTable
from touchdown.agents.states import OneHot, states_of
from touchdown.config.sections import TableConfig
from touchdown.core.types import Spaces

BOX = Spaces(2, 3, low=(-1.0, 0.0), high=(1.0, 4.0))


def test_a_table_comes_back_from_its_layers_and_another_is_refused():
    table = QTable(OneHot(2), 3, TableConfig())
    params = np.arange(6.0)
    assert_array_equal(table.params_of(table.layers(params)), params)
    for layers, said in [
        ({}, r"it has \[\], must be q, the table"),
        ({"q": np.zeros((3, 2))}, r"q is float64\(3, 2\), must be float64\(2, 3\)"),
        ({"q": np.zeros((2, 3), np.float32)}, r"q is float32\(2, 3\), must be float64\(2, 3\)"),
    ]:
        with pytest.raises(ValueError, match=said):
            table.params_of(layers)


def test_a_policy_of_a_binned_box_takes_the_best_action_of_each_bin():
    bins = TableConfig(bins=(2, 1), bins_low=(-1, 0), bins_high=(1, 1))
    table = QTable(states_of(bins, BOX), 3, bins)
    policy = table.policy(np.array([0.0, 2, 1, 0, 0, 5]))
    assert policy.act(np.array([[-9.0, 0], [-0.1, 9], [0.1, 0]])).tolist() == [1, 1, 2]
    assert table.describe() == {
        "table": {"bins": (2, 1), "bins_low": (-1.0, 0.0), "bins_high": (1.0, 1.0)}
    }
