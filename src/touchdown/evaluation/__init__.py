"""Greedy rollouts from given starts, and their summary."""
