"""Training one agent with one seed: loop, checkpoints, selection, records."""
