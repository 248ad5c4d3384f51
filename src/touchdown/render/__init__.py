"""Films, posters and a live window of flights."""
