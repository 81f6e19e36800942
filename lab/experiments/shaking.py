"""How a clamp is shaken without a jerk at the start."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SmoothShake:
    """Clamp moved as amplitude * r(t) sin(2 pi f t); r rises from 0 to 1 within ``rise`` with a smooth acceleration.

    Parameters
    ----------
    amplitude
        Along x, y, z; m.
    frequency
        Hz.
    rise
        s; 0 starts at full speed.
    """

    amplitude: tuple[float, float, float]
    frequency: float
    rise: float = 0.1

    def _share(self, times: Array) -> tuple[Array, Array, Array]:
        """r and its first two derivatives (m,): the quintic between two rests."""
        if self.rise <= 0.0:
            return np.ones_like(times), np.zeros_like(times), np.zeros_like(times)
        x = np.clip(times / self.rise, 0.0, 1.0)
        share = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        return share, 30.0 * (x * (1 - x)) ** 2 / self.rise, 60.0 * x * (1 - x) * (1 - 2 * x) / self.rise**2

    def displacement(self, times: Array) -> Array:
        """Of the clamp (m, 3), m."""
        share, _, _ = self._share(times)
        return np.outer(share * np.sin(2 * np.pi * self.frequency * times), self.amplitude)

    def acceleration(self, times: Array) -> Array:
        """Of the clamp (m, 3), m/s^2."""
        w = 2 * np.pi * self.frequency
        r0, r1, r2 = self._share(times)
        sine, cosine = np.sin(w * times), np.cos(w * times)
        return np.outer((r2 - w**2 * r0) * sine + 2 * w * r1 * cosine, self.amplitude)
