"""Learners: a network with its optimiser state, and its updates.

`learner` defines the protocol, `jax` and `fused` implement it, `factory` selects one by the config.
"""
