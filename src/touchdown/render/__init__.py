"""Flights to films, posters and a live window."""
