"""Files of weights that nobody trained."""

import numpy as np

from touchdown.policies.weights import save_weights


def save_model(path, model, params, facts, config) -> None:
    """Write the greedy policy of a network or a table with these flat parameters, [P]."""
    weights = {name: np.array(value) for name, value in model.layers(params).items()}
    save_weights(path, weights, model.policy(params), facts, config)
