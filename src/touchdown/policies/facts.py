"""What is known about a policy's weights: when they were taken, and how well they have done."""

import msgspec

from touchdown.core.records import Count, Seconds


class WeightsFacts(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    omit_defaults=True,
    rename={"env_steps": "observations"},
):
    """What is kept with a policy's weights, as far as it is known."""

    env_steps: Count | None = None
    """Of training, when the weights were taken."""
    validation_return: float | None = None
    """Mean return on the validation starts of the training."""
    final_validation_return: float | None = None
    """Mean return on the fresh validation starts of the choice; None before it."""
    solved_seconds: Seconds | None = None
    """Of training, until the policy was shown to solve its environment; None where it was not."""
