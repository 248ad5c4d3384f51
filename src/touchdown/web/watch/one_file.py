"""Writes the page of runs as one file that opens from disk."""
