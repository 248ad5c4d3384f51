"""Numbers to Axes: each figure draws the numbers it is given, and computes no statistics."""
