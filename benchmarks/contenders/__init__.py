"""Who takes part in `benchmarks/peers.py`, one a module, and how each is watched."""
