"""Statistics of `VecNormalize`, pickled here by stand-ins for the classes that they name."""

import os
import pickle
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from single_changes import is_refused_in_a_line
from touchdown.core.errors import UserError
from touchdown.policies.foreign.normalisation import Normalisation, read_normalisation

REAL = Path(__file__).parent / "sb3" / "ppo_normalised" / "statistics.pkl"


@pytest.fixture
def stand_ins(monkeypatch):
    """Classes with the names of Stable-Baselines3's."""

    def made(name: str, module: str) -> type:
        home = types.ModuleType(module)
        kind = type(name, (), {"__module__": module})
        setattr(home, name, kind)
        monkeypatch.setitem(sys.modules, module, home)
        return kind

    for module in ("stable_baselines3", "stable_baselines3.common"):
        monkeypatch.setitem(sys.modules, module, types.ModuleType(module))
    folder = "stable_baselines3.common.vec_env"
    monkeypatch.setitem(sys.modules, folder, types.ModuleType(folder))
    moments = made("RunningMeanStd", "stable_baselines3.common.running_mean_std")
    return made("VecNormalize", f"{folder}.vec_normalize"), moments


@pytest.fixture
def saved(stand_ins, tmp_path):
    """Writes statistics of two numbers; arguments are other values of their fields."""
    wrapper, moments = stand_ins

    def save(protocol: int = 4, **fields) -> Path:
        obs_rms = moments()
        obs_rms.mean = fields.pop("mean", np.array([1.0, -2.0]))
        obs_rms.var = fields.pop("var", np.array([4.0, 0.25]))
        facts = {"obs_rms": obs_rms, "norm_obs": True, "clip_obs": 10.0, "epsilon": 1e-8}
        saved = wrapper()
        saved.__dict__.update(facts | fields)
        path = tmp_path / "statistics.pkl"
        path.write_bytes(pickle.dumps(saved, protocol))
        return path

    return save


@pytest.mark.parametrize("protocol", range(3, pickle.HIGHEST_PROTOCOL + 1))
def test_observations_are_shifted_scaled_and_clipped(saved, protocol):
    scaled = {"clip_obs": 2.0, "epsilon": np.float64(1e-8)}
    found = read_normalisation(saved(protocol, **scaled), 2)
    assert found is not None
    scaled = found(np.array([[3.0, -2.0], [1.0, 0.0], [-99.0, -2.5]]))
    assert_allclose(scaled, [[1, 0], [0, 2], [-2, -1]])  # (0 + 2) / ½ = 4, clipped to 2
    assert scaled.dtype == np.float32


def test_statistics_that_stable_baselines_saved_are_read():
    found = read_normalisation(REAL, 8)
    assert isinstance(found, Normalisation)
    assert (found.clip, found.epsilon) == (2.0, 1e-8)
    assert found.mean.shape == found.variance.shape == (8,)
    assert (found.variance > 0).all()


def test_without_statistics_of_observations_nothing_is_normalised(saved):
    assert read_normalisation(saved(norm_obs=False), 2) is None


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"mean": np.zeros(3)}, r"for observations of shape \[3\], but the environment has \[2\]"),
        ({"var": np.zeros(3)}, r"it is for observations of shape"),
        ({"mean": np.array([0, np.nan])}, "its mean or variance is not finite"),
        ({"var": np.array([-1.0, 1])}, "a variance is below 0"),
        ({"mean": np.array([1, 2])}, "not little-endian floats"),
        ({"mean": np.array([1.0, 2], ">f8")}, "not little-endian floats"),
        ({"mean": np.zeros((1, 2))}, "is not one number for each dimension"),
        ({"mean": [0.0, 0.0]}, "its mean or variance is not an array"),
        ({"obs_rms": None}, "it has no RunningMeanStd of Stable-Baselines3"),
        ({"epsilon": -1.0}, "epsilon = -1.0 and clip_obs = 10.0: must be above 0"),
        ({"clip_obs": float("nan")}, "must be above 0"),
        ({"clip_obs": "10"}, "its clip_obs is missing"),
    ],
)
def test_wrong_statistics_are_refused(saved, fields, said):
    with pytest.raises(
        UserError, match=rf"statistics\.pkl: not statistics of VecNormalize: .*{said}"
    ):
        read_normalisation(saved(**fields), 2)


class Evil:
    """Unpickled, it runs a command."""

    def __reduce__(self):
        return os.system, ("touch evil",)


def test_a_pickle_runs_nothing(saved, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = saved(other=Evil())  # beside the statistics, which are good
    assert read_normalisation(path, 2) is not None
    path.write_bytes(pickle.dumps(Evil()))
    with pytest.raises(UserError, match="it has no VecNormalize of Stable-Baselines3"):
        read_normalisation(path, 2)
    assert not (tmp_path / "evil").exists()


def test_statistics_with_an_altered_byte_are_read_or_refused(tmp_path):
    data = REAL.read_bytes()
    chance = np.random.default_rng(0)
    path = tmp_path / "altered.pkl"
    refused = 0
    for _ in range(500):
        altered = bytearray(data)
        altered[chance.integers(len(data))] = chance.integers(256)
        path.write_bytes(altered)
        refused += is_refused_in_a_line(lambda: read_normalisation(path, 8), str(path))
    assert 50 < refused < 500
