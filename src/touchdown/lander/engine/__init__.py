"""LunarLander-v3 in C++, bit for bit as stock Gymnasium computes it."""

from touchdown.lander.engine._engine import HELIPAD, Lander, Pcg64

__all__ = ["HELIPAD", "Lander", "Pcg64"]
