"""Names and places of a part that a reader may point at."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def is_shell(part: Any) -> bool:
    """Whether a part has a lower and an upper node at every place."""
    return hasattr(part, "top")


def boundary_names(part: Any) -> list[str]:
    """Names that ``part.boundary`` knows."""
    return list(part.mesh.boundaries or {}) + (["bottom", "top"] if is_shell(part) else [])


def surface_names(part: Any) -> list[str]:
    """Names that ``part.surface`` knows."""
    return ["bottom", "top"] if is_shell(part) else [*(part.mesh.boundaries or {}), "all"]


def stations(part: Any) -> Ints:
    """Nodes that share one place (places, 1), or both nodes through a shell's thickness (places, 2)."""
    if is_shell(part):
        return np.stack([part.bottom, part.top], axis=1).astype(np.int64)
    return np.arange(part.nodes, dtype=np.int64)[:, None]
