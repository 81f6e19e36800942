"""Figures of cross-sections that models and theory share."""

import math
from functools import cache


@cache
def torsion_constant(width: float, thickness: float) -> float:
    """Saint-Venant torsion constant of a rectangle, m^4 (Timoshenko & Goodier, art. 109)."""
    series = sum(math.tanh(odd * math.pi * width / (2.0 * thickness)) / odd**5 for odd in range(1, 40, 2))
    return width * thickness**3 / 3.0 * (1.0 - 192.0 / math.pi**5 * thickness / width * series)
