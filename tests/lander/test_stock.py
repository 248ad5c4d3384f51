from gymnasium.envs.box2d import lunar_lander

from touchdown.lander import stock


def test_the_constants_equal_those_of_stock():
    names = [name for name in vars(stock) if name.isupper()]
    assert len(names) == 7
    for name in names:
        assert getattr(stock, name) == getattr(lunar_lander, name)
