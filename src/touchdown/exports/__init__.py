"""A trained pilot for elsewhere: in a format that others read, with a card that says what it is."""
