"""Learners: a network with its optimizer's state, and how it is updated.

`learner` is the contract, `jax` and `fused` fulfil it, `factory` picks one by the config.
"""
