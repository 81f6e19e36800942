"""Numbers that are the same in all elements or not."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def per_element(value: float | Array, elements: int) -> Array:
    """One number, or one per element, as a column (elements, 1)."""
    return np.broadcast_to(np.asarray(value, dtype=float), elements)[:, None]
