"""Statistics of returns: estimates with intervals, comparisons and tests."""
