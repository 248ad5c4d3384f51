"""Policies of other libraries: their files, read without running anything in them."""
