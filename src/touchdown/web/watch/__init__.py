"""A local page on which people watch runs, those under way and finished ones."""
