"""Measures of a closed path in a plane: ellipse, sense of travel, harmonics; and of such paths over a swept number."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Orbits with a smaller ratio of their axes are lines within what steady motion is known to: no sense of travel.
LINE = 1e-3


@dataclass(frozen=True)
class Ellipse:
    """Ellipse that is travelled once a period.

    Parameters
    ----------
    major, minor
        Lengths of the axes, m; the minor one is positive where the travel is right-handed about the normal of the
        plane (from the first axis to the second), negative for the other sense.
    tilt
        Angle of the major axis from the first axis, rad, in [-pi/2, pi/2).
    residual
        Root of the mean squared distance of the path from the ellipse at equal phases, m.
    """

    major: float
    minor: float
    tilt: float
    residual: float

    @property
    def ratio(self) -> float:
        """Minor over major axis with the sign of the travel, -1 to 1."""
        return self.minor / self.major if self.major else 0.0

    def points(self, count: int = 100) -> Array:
        """The ellipse about its centre (count, 2), m, in the sense of travel."""
        turn = np.linspace(0.0, 2.0 * np.pi, count)
        along, across = self.major / 2.0 * np.cos(turn), self.minor / 2.0 * np.sin(turn)
        cosine, sine = np.cos(self.tilt), np.sin(self.tilt)
        return np.stack([cosine * along - sine * across, sine * along + cosine * across], axis=1)


def ellipse(path: Array) -> Ellipse:
    """Least-squares ellipse of a path over one period: that of its first harmonic, beside a mean.

    Unlike the fit of a conic it is defined for lines and for figures of eight as well.

    Parameters
    ----------
    path
        Places at even times over a whole period, the last phase equal to the first, (samples, 2), m.
    """
    first = harmonics(path, 1)[0]
    # y + i z is the sum of two vectors that turn with and against the right hand.
    along, against = (first[0] + 1j * first[1]) / 2, (first[0].conjugate() + 1j * first[1].conjugate()) / 2
    tilt = float(np.angle(along) + np.angle(against)) / 2
    turn = 2j * np.pi * np.arange(len(path) - 1) / (len(path) - 1)
    smooth = (first * np.exp(turn)[:, None]).real
    rest = path[:-1] - path[:-1].mean(axis=0) - smooth
    return Ellipse(
        2.0 * float(abs(along) + abs(against)), 2.0 * float(abs(along) - abs(against)),
        (tilt + np.pi / 2) % np.pi - np.pi / 2, float(np.sqrt(np.mean(np.sum(rest**2, axis=1)))),
    )  # fmt: skip


def harmonics(path: Array, count: int) -> NDArray[np.complex128]:
    """Amplitudes C (count, 2), m, of Re(C_n exp(2 pi i n f t)), n = 1, 2, ..., of a path as in ``ellipse``."""
    # The last sample repeats the first phase, which must not count twice.
    found = np.fft.rfft(path[:-1], axis=0)[1 : count + 1] * (2.0 / (len(path) - 1))
    return np.asarray(found)


def signed_area(path: Array) -> float:
    """Area that a closed path encloses, m^2: positive where it is travelled right-handed (first axis to second)."""
    here, there = path[:-1], path[1:]
    return 0.5 * float(np.sum(here[:, 0] * there[:, 1] - there[:, 0] * here[:, 1]))


def sense(ratio: float) -> int:
    """Sense of travel of an orbit with the signed ratio of its axes: 1 right-handed, -1 left-handed, 0 a line."""
    return 0 if abs(ratio) < LINE else int(np.sign(ratio))


@dataclass(frozen=True)
class Reversal:
    """Where the sense of travel changes.

    Parameters
    ----------
    at
        Swept value where the signed ratio of the axes passes zero, by linear interpolation.
    after
        Sense from there on, 1 or -1.
    """

    at: float
    after: int


def reversals(values: Array, ratios: Array) -> list[Reversal]:
    """Changes of the sense of travel along a sweep; lines (see ``LINE``) between two senses do not count by themselves.

    Parameters
    ----------
    values
        Swept numbers in ascending order, (n,).
    ratios
        Signed ratios of the axes there, (n,); NaN where there is no orbit, which is passed over.
    """
    values, ratios = values[np.isfinite(ratios)], ratios[np.isfinite(ratios)]
    sure = np.flatnonzero(np.abs(ratios) >= LINE)
    found = []
    for first, last in zip(sure, sure[1:], strict=False):
        if ratios[first] * ratios[last] < 0.0:
            between = slice(first, last + 1)
            # Lines in between: the first pair that encloses zero.
            steps = np.flatnonzero(np.diff(np.sign(ratios[between])))
            start = first + int(steps[0])
            part = ratios[start] / (ratios[start] - ratios[start + 1])
            at = values[start] + part * (values[start + 1] - values[start])
            found.append(Reversal(float(at), int(np.sign(ratios[last]))))
    return found


def ranges(values: Array, holds: Sequence[bool] | NDArray[np.bool_]) -> list[tuple[float, float]]:
    """First and last value of every run of neighbours for which something holds."""
    flags = np.concatenate([[False], np.asarray(holds, dtype=bool), [False]]).astype(int)
    begins, ends = np.flatnonzero(np.diff(flags) == 1), np.flatnonzero(np.diff(flags) == -1)
    return [(float(values[begin]), float(values[end - 1])) for begin, end in zip(begins, ends, strict=True)]
