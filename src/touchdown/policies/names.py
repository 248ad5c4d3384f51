"""Names and file suffixes of policies, which cannot be names of runs."""

BASELINES = ("pid", "heuristic", "random")
"""Policies that need no training."""
TORCH_FILES = (".pth", ".pt", ".cleanrl_model")
"""Suffixes of files that PyTorch writes."""
POLICY_FILES = (".toml", ".safetensors", ".onnx", ".zip", *TORCH_FILES)
"""Suffixes of policy files."""
OTHER_FILES = {
    ".pkl": "a pickle, which is never opened, as that would run what is in it",
    ".pickle": "a pickle, which is never opened, as that would run what is in it",
    ".joblib": "a pickle, which is never opened, as that would run what is in it",
    ".ckpt": "a checkpoint of another library",
    ".h5": "a network of Keras",
    ".hdf5": "a network of Keras",
    ".keras": "a network of Keras",
    ".pb": "a network of TensorFlow",
    ".tflite": "a network of TensorFlow Lite",
    ".npz": "arrays of NumPy, which do not say what is computed with them",
    ".msgpack": "weights of JAX, which do not say what is computed with them",
    ".bin": "weights that do not say what is computed with them",
}
"""Files of other libraries that cannot be flown, and what they are."""
