"""Returns to numbers with intervals."""
