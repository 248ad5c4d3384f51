"""Fly the ONNX model in this folder on stock Gymnasium; touchdown is not needed.

pip install onnxruntime "gymnasium[box2d]", then: python fly_onnx.py [MODEL.onnx [ENV_ID]]
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime

beside = Path(__file__).parent.glob("*.onnx")
session = onnxruntime.InferenceSession(sys.argv[1] if sys.argv[1:] else next(beside))
env_id = session.get_modelmeta().custom_metadata_map["env_id"]
if ":" in env_id and not sys.argv[2:]:
    sys.exit(f"the model names the environment {env_id}, whose module would be imported: if you "
             "trust it, give its id after the model")  # fmt: skip
env = gymnasium.make(sys.argv[2] if sys.argv[2:] else env_id)

for seed in range(5):
    observation, _ = env.reset(seed=seed)
    episode_return, ended = 0.0, False
    while not ended:
        flat = gymnasium.spaces.flatten(env.observation_space, observation)
        (actions,) = session.run(["action"], {"observations": np.float32([flat])})
        observation, reward, terminated, truncated, _ = env.step(int(actions[0]))
        episode_return += float(reward)
        ended = terminated or truncated
    print(f"start {seed}: return {episode_return:.1f}")
