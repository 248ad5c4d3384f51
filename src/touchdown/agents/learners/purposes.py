"""What samples of noisy weights are for: a part of their keys, which are in `noise`.

The numbers are large because JAX folds in small ones when it splits a key, and the keys of the
initial weights are split from the same seed.
"""

UPDATES, NEXT_VALUES, ACTING = 1_000_001, 1_000_002, 1_000_003
