"""Make the archives in `sb3/` with Stable-Baselines3, and record the actions of its policies.

Run by hand, in an environment that has stable_baselines3 and sb3_contrib: python make_sb3.py
"""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import torch
from sb3_contrib import QRDQN
from stable_baselines3 import A2C, DQN, PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

ENV_ID = "LunarLander-v3"
HERE = Path(__file__).parent / "sb3"
KEPT = ("data", "policy.pth", "_stable_baselines3_version")  # the rest is of the optimiser

OFF_POLICY = {"buffer_size": 10, "device": "cpu"}
MODELS = {
    "dqn": (DQN, {"net_arch": [8, 8]}, OFF_POLICY),
    "qrdqn": (QRDQN, {"net_arch": [8], "n_quantiles": 3}, OFF_POLICY),
    "ppo": (PPO, {"net_arch": [8]}, {"n_steps": 8, "batch_size": 8, "device": "cpu"}),
    "a2c": (A2C, {"net_arch": [8], "activation_fn": torch.nn.ReLU}, {"device": "cpu"}),
}


def vary(model) -> None:
    """Give a model weights as varied as trained ones, so that its actions vary."""
    with torch.no_grad():
        for weights in model.policy.parameters():
            weights.copy_(torch.randn(weights.shape))


def keep(model, name: str) -> None:
    """Write the archive of a model without its optimiser."""
    file = io.BytesIO()
    model.save(file)
    with (
        zipfile.ZipFile(file) as saved,
        zipfile.ZipFile(HERE / f"{name}.zip", "w", zipfile.ZIP_DEFLATED) as kept,
    ):
        for member in KEPT:
            kept.writestr(member, saved.read(member))


def normalised(observations: np.ndarray) -> list[int]:
    """The actions of a PPO that was trained with `VecNormalize`; its statistics are kept too."""
    env = VecNormalize(make_vec_env(ENV_ID, 2, seed=0), clip_obs=2.0)
    settings = {"n_steps": 8, "batch_size": 8, "device": "cpu"}
    model = PPO("MlpPolicy", env, seed=0, policy_kwargs={"net_arch": [8]}, **settings)
    model.learn(64)
    vary(model)
    (HERE / "ppo_normalised").mkdir(exist_ok=True)
    keep(model, "ppo_normalised/ppo")
    env.save(HERE / "ppo_normalised" / "statistics.pkl")
    return model.predict(env.normalize_obs(observations), deterministic=True)[0].tolist()


def main() -> None:
    torch.set_num_threads(1)
    observations = np.random.default_rng(0).normal(size=(200, 8)).astype(np.float32)
    actions = {}
    for name, (algorithm, policy, settings) in MODELS.items():
        model = algorithm("MlpPolicy", ENV_ID, seed=0, policy_kwargs=policy, **settings)
        vary(model)
        keep(model, name)
        actions[name] = model.predict(observations, deterministic=True)[0].tolist()
    actions["ppo_normalised"] = normalised(observations)
    (HERE / "actions.json").write_text(json.dumps(actions) + "\n", "utf-8")


if __name__ == "__main__":
    main()
