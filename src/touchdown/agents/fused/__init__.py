"""Updates of small Q-networks in C++: forward, backward, clip and Adam in one call."""
