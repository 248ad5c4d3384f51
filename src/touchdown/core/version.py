"""The version of touchdown."""

__version__ = "0.1.0"
