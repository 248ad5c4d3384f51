"""Turns records into a page that any browser can open."""
