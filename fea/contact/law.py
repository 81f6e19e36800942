"""What a contact point answers to its gap and its slip: a smoothed penalty with multipliers, and Coulomb friction.

With the gap g (m), the penalty e (Pa/m) and a shift s (m), the pressure is p = e f(s - g), where

    f(d) = 0 for d <= 0,   d^2 / (2 w) between,   d - w/2 for d >= w

has a continuous slope.  It derives from the energy e F(s - g) - e F(s) per area, F' = f.  The update
s <- max(s - g, 0) is that of augmented Lagrangians for the multiplier e f(s): it ends where g = 0 under
pressure, whatever the penalty and the blend.

Friction pulls back the slip s (m) from an anchor on the other surface by

    q = k s (1 - r/4) for r = k |s| / l < 2,   q = l s / |s| beyond,   l = mu p

again with a continuous slope.  The pressure in the limit l is that of the last update of the multipliers,
so the tangent is symmetric; ``augment`` repeats until both agree.  An accepted increment drags the anchor
along where the slip has passed 2 l / k.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactLaw:
    """Stiffness, friction and tolerance of contact.

    The penalty between walls is E/h, at which a layer of the thickness h answers a pressure with
    p = (E/h) g: walls sink in by p/E of h, and as they are as stiff themselves, the equations become no
    worse conditioned.  Between solids it is 10 E/h with the size h of their facets: ten times as stiff as
    the elements at the surface, so that they take the deformation.

    Thin walls on coarse facets need less.  A wall of the bending stiffness E h^3/12 that is pressed on a
    foundation e touches over its decay length (E h^3 / (3 e))^(1/4).  Where that is shorter than the
    distance between contact points, these catch the load one by one as the wall rolls on, and Newton's
    method loses its way.  The penalty is therefore at most the one with a decay length of half a facet,
    16/3 (h/size)^4 E/h.  Multipliers make up for the penetration, to the given tolerance, in either case.

    Parameters
    ----------
    modulus
        Young's modulus E of the softer body, Pa.
    thickness
        Thickness h of the wall, m; None for a solid: h is the size of its facets.
    friction
        Coefficient mu of Coulomb friction.
    factor
        Penalty as a multiple of E/h; None: 1 for walls, 10 for solids.
    blend
        Width w of the blend as a fraction of h; None: twice the tolerance.
    tolerance
        Largest penetration, as a fraction of h, at which multipliers stay as they are; None: 0.01 for walls,
        0.001 for solids, whose deformation at the surface is a small part of h.
    """

    modulus: float
    thickness: float | None = None
    friction: float = 0.0
    factor: float | None = None
    blend: float | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        for name in ("modulus", "thickness", "factor", "blend", "tolerance"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < float("inf"):
                raise ValueError(f"the contact law needs a positive {name}, not {value}")
        if not 0.0 <= self.friction < float("inf"):
            raise ValueError(f"the coefficient of friction cannot be {self.friction}")

    def on(self, size: Array) -> "Scales":
        """Figures for facets of the ``size`` (facets,), m."""
        solid = self.thickness is None
        h = size if self.thickness is None else np.full_like(size, self.thickness)
        factor = self.factor or (10.0 if solid else 1.0)
        tolerance = self.tolerance or (0.001 if solid else 0.01)
        softer = np.minimum(1.0, 16 / 3 * (h / size) ** 4)
        return Scales(h, factor * softer * self.modulus / h, (self.blend or 2 * tolerance) * h, tolerance * h)


@dataclass(frozen=True)
class Scales:
    """A contact law in figures, (facets,) each.

    Parameters
    ----------
    length
        Thickness of the wall, or size of the facets, m.
    penalty
        Pressure per penetration, Pa/m.
    width
        Of the blend, m.
    allowed
        Penetration, m.
    """

    length: Array
    penalty: Array
    width: Array
    allowed: Array

    def each(self, points: int) -> "Scales":
        """The same for every one of so many points of each facet."""
        return Scales(*(np.repeat(figures, points) for figures in vars(self).values()))


@njit(cache=True)
def pressure(penalty: float, width: float, shift: float, gap: float) -> tuple[float, float, float]:
    """Pressure, Pa, its fall with the gap, Pa/m, and the energy per area, J/m^2."""
    value, slope, stored = _blend(width, shift - gap)
    return penalty * value, penalty * slope, penalty * (stored - _blend(width, shift)[2])


@njit(cache=True)
def _blend(width: float, depth: float) -> tuple[float, float, float]:
    """f, its slope and its integral F."""
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    if depth < width:
        return depth * depth / (2.0 * width), depth / width, depth * depth * depth / (6.0 * width)
    return depth - 0.5 * width, 1.0, 0.5 * depth * (depth - width) + width * width / 6.0


@njit(cache=True)
def traction(stiffness: float, limit: float, slip: float) -> tuple[float, float, float]:
    """Secant (traction / slip) and slope, Pa/m, and the energy per area, J/m^2, at the length ``slip``, m."""
    if limit <= 0.0:
        return 0.0, 0.0, 0.0
    ratio = stiffness * slip / limit
    scale = limit * limit / stiffness
    if ratio < 2.0:
        energy = scale * ratio * ratio * (0.5 - ratio / 12.0)
        return stiffness * (1.0 - 0.25 * ratio), stiffness * (1.0 - 0.5 * ratio), energy
    return limit / slip, 0.0, scale * (ratio - 2.0 / 3.0)
