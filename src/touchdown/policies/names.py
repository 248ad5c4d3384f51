"""Names and file suffixes that mean a policy, and so cannot name a run."""

BASELINES = ("pid", "heuristic", "random")
"""Policies that need no training."""
POLICY_FILES = (".toml", ".safetensors", ".onnx", ".zip")
"""Suffixes of files that hold a policy."""
