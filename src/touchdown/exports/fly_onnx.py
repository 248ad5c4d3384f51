"""Fly the ONNX model in this folder on stock Gymnasium; touchdown is not needed.

pip install onnxruntime "gymnasium[box2d]", then: python fly_onnx.py [MODEL.onnx]
"""

import sys
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime

beside = Path(__file__).parent.glob("*.onnx")
session = onnxruntime.InferenceSession(sys.argv[1] if sys.argv[1:] else next(beside))
env = gymnasium.make(session.get_modelmeta().custom_metadata_map["env_id"])

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
