"""A trained policy in a format that others read, with a card that says what it is."""
