"""Three sets of starts, environment seeds each, that never overlap."""

TEST_STARTS = range(1_000_000)
"""Environment seeds that only reporting may fly; the first 100 are the usual test."""
VALIDATION_STARTS = range(1_000_000, 2_000_000)
"""Environment seeds that choose a checkpoint."""
TRAINING_STARTS = range(2_000_000, 2**31)
"""Environment seeds that training draws from."""
