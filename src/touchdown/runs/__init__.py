"""One agent, one seed: flying, training, and the record of it on disk."""
