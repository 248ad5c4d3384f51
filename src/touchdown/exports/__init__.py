"""A trained policy in a format that other programs read, with a model card."""
