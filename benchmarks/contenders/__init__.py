"""The systems in `benchmarks/peers.py`, one per module, and their evaluation during training."""
