"""Names and file endings that mean a policy, and so cannot be a run's name."""

BASELINES = ("pid", "heuristic", "random")
"""Baselines: policies that need no run."""
POLICY_FILES = (".toml", ".safetensors", ".onnx", ".zip")
"""Endings of files that hold a policy."""
