"""How the level of a test is spent over several looks at growing data."""

from collections.abc import Sequence

import numpy as np

from touchdown.core.types import FloatArray
from touchdown.stats.compare import ALPHA

OBRIEN_FLEMING = "obrien-fleming"
POCOCK = "pocock"
SHAPES = (OBRIEN_FLEMING, POCOCK)


def levels(looks: Sequence[int], shape: str = OBRIEN_FLEMING, alpha: float = ALPHA) -> list[float]:
    """The level that each look may use.

    The levels add up to `alpha`; with each test at its own level, the probability of any false
    decision over all looks is at most `alpha`, for any test and any dependence between the looks.

    Args:
        looks: numbers of seeds at the looks, increasing.
        shape: one of `SHAPES`. With O'Brien and Fleming's, early looks get little, so that the
            last one keeps most of the level; with Pocock's, all get nearly the same for the
            same number of seeds, so that fewer seeds decide, if seeds are expensive.
        alpha: the level over all looks, two-sided.

    Raises:
        ValueError: the shape is unknown.

    Source:
        Lan & DeMets (1983), α₁*(t) = 2 − 2Φ(z / √t), with z = Φ⁻¹(1 − α/2), and
        α₂*(t) = α ln(1 + (e − 1) t).
    """
    share = np.asarray(looks, float) / looks[-1]
    if shape == OBRIEN_FLEMING:
        spent = _obrien_fleming(share, alpha)
    elif shape == POCOCK:
        spent = alpha * np.log1p((np.e - 1) * share)
    else:
        raise ValueError(f"shape = {shape!r}: must be one of {', '.join(SHAPES)}")
    return np.diff(spent, prepend=0.0).tolist()


def _obrien_fleming(share: FloatArray, alpha: float) -> FloatArray:
    from scipy.stats import norm  # noqa: PLC0415 - takes half a second

    return 2 * norm.sf(norm.isf(alpha / 2) / np.sqrt(share))
