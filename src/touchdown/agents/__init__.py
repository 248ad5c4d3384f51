"""Learning: TD errors, networks, exploration, learners, and the agents composed of them."""
