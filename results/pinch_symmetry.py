"""Pinch angles that the symmetry of a tube with even pads makes one, and what becomes of a hinge axis."""

import numpy as np
from numpy.typing import NDArray

from lab.pinching import Equivalent, axis_difference, distinct

Array = NDArray[np.float64]

#: Decimals of an angle (rad) by which pinches are told apart.
DIGITS = 9


def imaged(axis: float, of: Equivalent, to: Equivalent) -> float:
    """A line (rad) of a tube pinched at one angle, in that pinched at another with the same distinct angle."""
    back = axis - of.turn
    return to.axis(2 * of.mirror_axis - back if of.mirrored else back)


def images(pinch_angle: float, pairs: int) -> list[float]:
    """All pinch angles (rad, 0 to below 2 pi) that symmetry makes one with an angle, itself among them; ascending."""
    sector, base = 2 * np.pi / pairs, distinct(pinch_angle, pairs).pinch_angle
    starts = sector * np.arange(pairs)
    return sorted({turned(start + part) for start in starts for part in (base, sector - base)})


def turned(angle: float) -> float:
    """An angle within 0 and a turn, rounded so that equal ones are equal."""
    return round(round(angle, DIGITS) % round(2 * np.pi, DIGITS), DIGITS)


def axis_steps(axes: Array) -> Array:
    """Turn of an axis (rad, -pi/2 to pi/2) from each pinch angle to the next, round the circle (n,).

    Parameters
    ----------
    axes
        Lines (n,) at ascending pinch angles, rad; NaN where one is not defined.
    """
    return np.array([axis_difference(after, here) for here, after in zip(axes, np.roll(axes, -1), strict=True)])
