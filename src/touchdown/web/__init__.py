"""Pages with a lander in them: the playground, and training as it happens."""
