"""Figures: each draws given numbers on matplotlib Axes and computes no statistics."""
