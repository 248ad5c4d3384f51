"""Replay memories: a ring of transitions, how some are drawn, and transitions of n steps."""
