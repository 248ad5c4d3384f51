"""Policies that others trained: their files, read without running anything that is in them."""
