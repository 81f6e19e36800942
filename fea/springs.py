"""Linear springs between nodes and the ground."""

import numpy as np
from numpy.typing import NDArray

from fea.terms import Steady

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Springs(Steady):
    """A ``Term``: every node pulled back along x, y, z.

    Parameters
    ----------
    nodes
        (n,).
    stiffness
        (n, 3), N/m.
    """

    def __init__(self, nodes: Ints, stiffness: Array) -> None:
        if not (np.isfinite(stiffness).all() and (stiffness >= 0).all()):
            raise ValueError("stiffness of springs must be finite and not negative, N/m")
        self._nodes, self._stiffness = nodes, stiffness
        self.cells = nodes[:, None]

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        result = np.zeros_like(x)
        result[self._nodes] = self._stiffness * x[self._nodes]
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        return self._stiffness[:, :, None] * np.eye(3)

    def energy(self, x: Array, t: float) -> float:
        """See ``Term``."""
        return float(0.5 * np.sum(self._stiffness * x[self._nodes] ** 2))

    def report(self, x: Array) -> dict[str, float]:
        """See ``Term``."""
        return {"stretch [m]": float(np.abs(x[self._nodes]).max(initial=0.0))}
