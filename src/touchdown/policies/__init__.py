"""Policies: baselines, saved weights and files of other libraries, found by name."""
