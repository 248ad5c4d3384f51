"""What learns: TD errors, networks, exploration, and the agents made of them."""
