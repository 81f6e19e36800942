"""Acceleration of Newton's method with an old tangent by what its last steps taught."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Secant:
    """Multisecant (Anderson) correction of steps with a fixed tangent (Walker & Ni 2011).

    The residual's last changes are combined to come closest to the present residual; that part of
    the step is taken from what really happened, the rest from the tangent.
    """

    depth = 6

    def __init__(self) -> None:
        self._solved: list[Array] = []
        self._steps: list[Array] = []

    def improve(self, step: Array) -> Array:
        """Better step than ``step`` (n,), the tangent's answer to the present residual."""
        result = step
        self._solved.append(step)
        if len(self._solved) > 1:
            # Differences of the tangent's answers stand for differences of residuals, in metres.
            changes = np.diff(np.array(self._solved), axis=0).T
            mix = np.linalg.lstsq(changes, step, rcond=1e-10)[0]
            result = step - (np.array(self._steps).T + changes) @ mix
        self._steps.append(result)
        self._solved, self._steps = self._solved[-self.depth :], self._steps[-self.depth :]
        if len(self._steps) == self.depth:
            self._steps, self._solved = self._steps[1:], self._solved[1:]
        return result
