"""LunarLander-v3 in C++, bit for bit as stock Gymnasium computes it."""

from typing import Final

from touchdown.lander.engine._engine import (  # pyright: ignore[reportMissingModuleSource] - C++
    HELIPAD,
    Batch,
    Pcg64,
    simd,
)

# what a lander may be told to do in a step of its batch
NOTHING: Final = 0
STEP: Final = 1
BEGIN: Final = 2

__all__ = ["BEGIN", "HELIPAD", "NOTHING", "STEP", "Batch", "Pcg64", "simd"]
