"""Policies, which act: baselines, saved weights and files of other libraries, looked up by name."""
