"""Facts about a policy's weights: their checkpoint and their returns."""

import msgspec

from touchdown.core.records import Count, Seconds


class WeightsFacts(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    omit_defaults=True,
    rename={"env_steps": "observations"},
):
    """Facts stored with a policy's weights, as far as known."""

    env_steps: Count | None = None
    """Environment steps of training at this checkpoint."""
    validation_return: float | None = None
    """Mean return on the validation starts during training."""
    final_validation_return: float | None = None
    """Mean return on the fresh validation starts of the final selection; None before it."""
    solved_seconds: Seconds | None = None
    """Seconds of training until the policy was shown to solve its environment; else None."""
