"""How pinching forces are shared between pairs, and what small deformations say of it (eqs 3.1 to 3.6).

A pair of collinear forces F across a thin ring, along the angle g from the first pair, flattens it by its second
harmonic: F exp(2 i g) as a complex number.  Forces of several pairs add up like that, as long as deflections are small.
The sum's size says how strongly the ring is flattened, and half its argument along which line.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: ``published``: eqs 3.2 to 3.6.  ``even``: forces that, to first order, turn the axis steadily at constant flattening.
ForceLaw = Literal["published", "even"]


def pair_spacing(pairs: int) -> float:
    """Angle between neighbouring pairs, rad: 360 / (2 n) deg (eq. 3.1)."""
    return np.pi / pairs


def pair_directions(pairs: int) -> Array:
    """Angle of every pair's line from +x, rad (pairs,): the first along y, the others on from there about +z."""
    return np.asarray(np.pi / 2 + pair_spacing(pairs) * np.arange(pairs, dtype=float), dtype=np.float64)


def pair_shares(pinch_angle: float, pairs: int = 3, law: ForceLaw = "published") -> Array:
    """Force of every pair over F_p (pairs,).

    Parameters
    ----------
    pinch_angle
        alpha, rad, 0 to 2 pi: a whole turn goes once through all pairs.
    pairs
        n.  Eqs 3.5 and 3.6 are written for three; with another number the turn is cut into as many equal sectors.
    law
        See ``ForceLaw``.

    Raises
    ------
    ValueError
        For a pinch angle outside its range, or one between two pairs where there is only one.

    Examples
    --------
    >>> pair_shares(np.deg2rad(60.0)).round(3).tolist()
    [0.707, 0.707, 0.0]
    """
    if not 0.0 <= pinch_angle <= 2 * np.pi:
        raise ValueError(f"pinch_angle {np.rad2deg(pinch_angle):g} deg must lie between 0 and 360 deg")
    sector = 2 * np.pi / pairs
    # A sum of steps may end a rounding before the next sector.
    number = int(np.floor(pinch_angle / sector + 1e-9))
    share = min(max(pinch_angle / sector - number, 0.0), 1.0)
    if pairs == 1 and share > 1e-9:
        raise ValueError("with one pair of pads there is nothing to share: pinch_angle must be 0")
    if law == "published":
        one, other = np.cos(share * np.pi / 2), np.sin(share * np.pi / 2)
    else:
        between = 2 * pair_spacing(pairs)
        if np.sin(between) < 1e-9:
            raise ValueError("two pairs at right angles cancel to first order: the law 'even' needs three or more")
        one, other = np.sin((1 - share) * between) / np.sin(between), np.sin(share * between) / np.sin(between)
    result = np.zeros(pairs)
    result[number % pairs] += one
    result[(number + 1) % pairs] += other
    return np.where(np.abs(result) < 1e-12, 0.0, result)


def ideal_axis(pinch_angle: float) -> float:
    """Hinge axis from +x, rad, that turns steadily with the pinch: alpha / 2, within 0 and pi.

    The first pair is along y (alpha = 0, axis along x); three pairs later, at alpha = 360 deg, it is so again.
    """
    return (pinch_angle / 2) % np.pi


@dataclass(frozen=True)
class FirstOrder:
    """What the second harmonic of the forces says.

    Parameters
    ----------
    axis
        Line of largest extent of the section from +x, rad, 0 to pi; NaN where the second harmonics cancel.
    strength
        Second harmonic over that of one pair with F_p alone.
    """

    axis: float
    strength: float

    @property
    def force_factor(self) -> float:
        """By how much F_p must be larger than with one pair alone for the same flattening."""
        return 1.0 / self.strength if self.strength > 1e-9 else np.inf


def first_order(shares: Array) -> FirstOrder:
    """Axis and strength of forces (pairs,), relative to F_p, on a thin ring under small deflections.

    Examples
    --------
    >>> middle = first_order(pair_shares(np.deg2rad(60.0)))
    >>> round(float(np.rad2deg(middle.axis)), 6), round(middle.force_factor, 6)
    (30.0, 1.414214)
    """
    total = complex(np.sum(shares * np.exp(2j * pair_spacing(len(shares)) * np.arange(len(shares)))))
    if abs(total) < 1e-9 * max(float(np.abs(shares).max()), 1e-300):
        return FirstOrder(np.nan, 0.0)
    axis = (np.angle(total) / 2) % np.pi
    return FirstOrder(0.0 if np.pi - axis < 1e-12 else float(axis), abs(total))


@dataclass(frozen=True)
class Equivalent:
    """A pinch angle as an image of one in the first half sector: first mirrored, then turned.

    A tube with 2 n even pads looks the same after a turn by the pairs' spacing, and in a mirror through a pad and the
    axis.  The distinct pinch angles are those from 0 to half a sector.

    Parameters
    ----------
    pinch_angle
        Distinct pinch angle, rad, 0 to pi / n.
    mirrored
        Whether the mirror that exchanges the first two pairs comes in between.
    turn
        Rotation about +z afterwards, rad.
    mirror_axis
        The mirror holds the axis and this line from +x, rad.
    """

    pinch_angle: float
    mirrored: bool
    turn: float
    mirror_axis: float

    def axis(self, angle: float) -> float:
        """Image of a line at ``angle`` from +x, rad, within 0 and pi."""
        image = 2 * self.mirror_axis - angle if self.mirrored else angle
        return (image + self.turn) % np.pi

    def points(self, points: Array) -> Array:
        """Image of places or vectors whose first two columns are x and y, (n, 2 or 3)."""
        result = np.array(points, dtype=float)
        flat = result[:, 0] + 1j * result[:, 1]
        if self.mirrored:
            flat = np.exp(2j * self.mirror_axis) * flat.conj()
        flat = np.exp(1j * self.turn) * flat
        result[:, 0], result[:, 1] = flat.real, flat.imag
        return result


def distinct(pinch_angle: float, pairs: int = 3) -> Equivalent:
    """The distinct pinch angle behind any other, and how to get there.

    Examples
    --------
    >>> found = distinct(np.deg2rad(105.0))
    >>> round(float(np.rad2deg(found.pinch_angle)), 6), found.mirrored
    (15.0, True)
    """
    sector = 2 * np.pi / pairs
    number = int(np.floor(pinch_angle / sector + 1e-9))
    rest = max(pinch_angle - number * sector, 0.0)
    mirrored = rest > sector / 2 * (1 + 1e-9)
    # The mirror that exchanges the first two pairs lies half-way between their lines.
    mirror_axis = np.pi / 2 + pair_spacing(pairs) / 2
    return Equivalent(sector - rest if mirrored else rest, mirrored, number * pair_spacing(pairs), mirror_axis)


def axis_difference(angle: float, reference: float) -> float:
    """Angle between two lines, rad, from -pi/2 to pi/2, positive about +z."""
    return float((angle - reference + np.pi / 2) % np.pi - np.pi / 2)
