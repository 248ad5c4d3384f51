"""The optimiser of a config, with its learning rate schedule and gradient clipping."""

import optax

from touchdown.config.sections import LearningConfig


def make_optimizer(config: LearningConfig) -> optax.GradientTransformation:
    """The configured optimiser, preceded by clipping of the global gradient norm if that is set."""
    if config.learning_rate_duration:
        rate = optax.linear_schedule(
            config.learning_rate, config.learning_rate_end, config.learning_rate_duration
        )
    else:
        rate = config.learning_rate
    optimizer = getattr(optax, config.optimizer)(rate)
    if config.max_grad_norm:
        return optax.chain(optax.clip_by_global_norm(config.max_grad_norm), optimizer)
    return optimizer
