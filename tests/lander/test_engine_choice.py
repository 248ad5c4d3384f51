"""Which engine simulates the lander."""

import numpy as np
import pytest

from touchdown.cli import app
from touchdown.core.errors import UserError
from touchdown.envs import environment
from touchdown.lander import engine as engines
from touchdown.lander.single import LanderEnv


@pytest.fixture
def nothing_chosen(monkeypatch) -> None:
    monkeypatch.setattr(engines, "_chosen", [])


@pytest.mark.usefixtures("nothing_chosen")
def test_the_exact_engine_is_the_default_where_it_was_built():
    assert engines.engine_in_use() == "exact"
    assert isinstance(environment.make_env(engine=engines.engine_in_use()).env.unwrapped, LanderEnv)


@pytest.mark.usefixtures("nothing_chosen")
def test_stock_is_used_when_it_is_chosen():
    engines.use_engine("gymnasium")
    assert engines.engine_in_use() == "gymnasium"
    assert not isinstance(
        environment.make_env(engine=engines.engine_in_use()).env.unwrapped, LanderEnv
    )


@pytest.mark.usefixtures("nothing_chosen")
def test_without_the_exact_engine_stock_is_used_with_one_warning(monkeypatch):
    monkeypatch.setattr(engines, "_built", False)
    with pytest.warns(UserWarning, match="no C.. compiler when touchdown was installed"):
        assert engines.engine_in_use() == "gymnasium"
    assert engines.engine_in_use() == "gymnasium"  # a second warning would be an error
    with pytest.raises(UserError, match="engine 'exact': was not built"):
        engines.use_engine("exact")


@pytest.mark.usefixtures("nothing_chosen")
def test_other_environments_are_always_gymnasiums_own():
    made = environment.make_env("CartPole-v1", engine="exact")
    assert made.spaces[:2] == (4, 2)


@pytest.mark.usefixtures("nothing_chosen")
def test_an_unknown_engine_is_refused(capsys):
    with pytest.raises(UserError, match="engine 'box2d': must be exact or gymnasium"):
        engines.use_engine("box2d")  # pyright: ignore[reportArgumentType]
    with pytest.raises(SystemExit) as ended:
        app.main(["train", "--engine", "box2d"])
    assert ended.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_one_start_gives_the_same_flight_on_both_engines():
    flown = []
    for engine in ("exact", "gymnasium"):
        env = environment.make_env(engine=engine).env
        rows = [env.reset(seed=11)[0]]
        rng = np.random.default_rng(0)
        ended = False
        while not ended:
            row, reward, terminated, truncated, _ = env.step(int(rng.integers(4)))
            rows.append(np.append(row.astype(float), reward))
            ended = terminated or truncated
        flown.append(np.concatenate(rows).tobytes())
    assert flown[0] == flown[1]
