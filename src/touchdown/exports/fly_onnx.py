"""Fly the ONNX model in this folder on stock Gymnasium; touchdown is not needed.

First: pip install onnxruntime "gymnasium[box2d]"
"""

import argparse
import json
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
facts = session.get_modelmeta().custom_metadata_map
env_id, settings = args.env_id, {}
if env_id is None:  # a variant of the lander is stock's with other settings
    env_id = facts.get("gymnasium_id", facts["env_id"])
    settings = json.loads(facts.get("gymnasium_settings", "{}"))
if ":" in env_id and args.env_id is None:
    parser.error(f"the model names the environment {env_id}, whose module would be imported: if "
                 "you trust it, give its id after the model")  # fmt: skip
env = gymnasium.make(env_id, **settings)

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
