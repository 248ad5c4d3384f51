"""Types of a config's numbers: their bounds, and how an error message describes them."""

from typing import Annotated

from msgspec import Meta

MOST_STEPS = 2**31 - 1
"""Most updates that optax can count, in 32 bits."""
# A setting above these is a typing error, and would exhaust the memory.
MOST_NODES = 100_000
MOST_TRANSITIONS = 1_000_000_000
MOST_RESAVES = 1_000_000
MOST_N_STEP = 1_000
MOST_ENVS = 10_000

Share = Annotated[float, Meta(ge=0, le=1)]
Positive = Annotated[float, Meta(gt=0)]
NonNegative = Annotated[float, Meta(ge=0)]
AtLeastOne = Annotated[int, Meta(ge=1)]
Steps = Annotated[int, Meta(ge=0, le=MOST_STEPS)]
NumEnvs = Annotated[int, Meta(ge=1, le=MOST_ENVS)]
Transitions = Annotated[
    int, Meta(ge=1, le=MOST_TRANSITIONS, description=f"from 1 to {MOST_TRANSITIONS} transitions")
]
