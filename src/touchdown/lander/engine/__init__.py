"""LunarLander-v3 in C++, bit for bit as stock Gymnasium computes it."""

from touchdown.lander.engine._engine import (  # pyright: ignore[reportMissingModuleSource] - C++
    HELIPAD,
    Batch,
    Pcg64,
    simd,
)

__all__ = ["HELIPAD", "Batch", "Pcg64", "simd"]
