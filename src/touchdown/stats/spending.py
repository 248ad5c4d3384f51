"""How the level of a test is spent over several looks at growing data."""

from collections.abc import Sequence

import numpy as np

from touchdown.stats.compare import ALPHA


def obrien_fleming(looks: Sequence[int], alpha: float = ALPHA) -> list[float]:
    """The level that each look may use, by the spending function of O'Brien and Fleming's kind.

    Early looks get little, so that the last one keeps most of the level. The levels add up to
    `alpha`; with each test at its own level, the probability of any false decision over all looks
    is at most `alpha`, for any test and any dependence between the looks.

    Args:
        looks: numbers of seeds at the looks, increasing.
        alpha: the level over all looks, two-sided.

    Source:
        Lan & DeMets (1983), Eq. for α₁*(t) = 2 − 2Φ(z / √t), with z = Φ⁻¹(1 − α/2).
    """
    from scipy.stats import norm  # noqa: PLC0415 - takes half a second

    share = np.asarray(looks, float) / looks[-1]
    spent = 2 * norm.sf(norm.isf(alpha / 2) / np.sqrt(share))
    return np.diff(spent, prepend=0.0).tolist()
