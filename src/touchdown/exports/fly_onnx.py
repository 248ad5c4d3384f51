"""Fly the ONNX model in this folder on Gymnasium; only a variant of the lander needs touchdown.

First: pip install onnxruntime "gymnasium[box2d]"
"""

import argparse
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime

parser = argparse.ArgumentParser(description=__doc__)
beside = next(Path(__file__).parent.glob("*.onnx"), None)
parser.add_argument(
    "model", nargs="?", default=beside, help="an .onnx file; by default %(default)s"
)
parser.add_argument("env_id", nargs="?", help="environment; by default the one that it names")
parser.add_argument("--episodes", type=int, default=5, help="number of starts; by default 5")
args = parser.parse_args()
if args.model is None or not Path(args.model).is_file():
    parser.error(f"model {args.model}: no such file")
session = onnxruntime.InferenceSession(args.model)
env_id = args.env_id or session.get_modelmeta().custom_metadata_map["env_id"]
if ":" in env_id and args.env_id is None:
    parser.error(f"the model names the environment {env_id}, whose module would be imported: if "
                 "you trust it, give its id after the model")  # fmt: skip
if env_id.startswith("touchdown/"):  # a variant of the lander, which touchdown registers
    try:
        import touchdown  # noqa: F401
    except ImportError:
        parser.error(
            f"environment {env_id}: needs touchdown; install it, or give the id of another"
        )
env = gymnasium.make(env_id)

for seed in range(args.episodes):
    observation, _ = env.reset(seed=seed)
    episode_return, ended = 0.0, False
    while not ended:
        flat = gymnasium.spaces.flatten(env.observation_space, observation)
        (actions,) = session.run(["action"], {"observations": np.float32([flat])})
        observation, reward, terminated, truncated, _ = env.step(int(actions[0]))
        episode_return += float(reward)
        ended = terminated or truncated
    print(f"start {seed}: return {episode_return:.1f}")
