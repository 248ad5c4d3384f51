"""Three disjoint sets of starts, given by environment seeds."""

TEST_STARTS = range(1_000_000)
"""Environment seeds for reporting only; the first 100 are the usual test."""
VALIDATION_STARTS = range(1_000_000, 2_000_000)
"""Environment seeds for checkpoint selection."""
TRAINING_STARTS = range(2_000_000, 2**31)
"""Environment seeds for training."""
