"""Names and file suffixes of policies, which cannot be names of runs."""

BASELINES = ("pid", "heuristic", "random")
"""Policies that need no training."""
POLICY_FILES = (".toml", ".safetensors", ".onnx", ".zip")
"""Suffixes of policy files."""
