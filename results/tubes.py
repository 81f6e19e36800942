"""What tables and ledger share about tubes: which of the text it is, which way it goes, when it is round again."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from lab.specimens.pinched_tube import SIZES, PinchedTube

#: What the text says of its tubes; pads, transitions and imperfections it does not.
_PUBLISHED = ("radius", "length", "wall", "pairs")
#: Flattening left, over what the pinch made of the loaded tube, below which it counts as round again: ASSUMED.
RECOVERED = 0.1


def published_size(specimen: Mapping[str, Any]) -> str:
    """Name of the size whose published figures and modulus a specimen (plain data, SI) has; empty for any other."""
    if specimen.get("kind") != "PinchedTube":
        return ""
    return next((size for size in SIZES if _same(specimen, sized(size))), "")


def sized(size: str) -> PinchedTube:
    """The tube of a size."""
    return PinchedTube.model_validate({"size": size})


def _same(specimen: Mapping[str, Any], of: PinchedTube) -> bool:
    modulus = specimen["material"]["youngs_modulus"]
    return math.isclose(modulus, of.material.youngs_modulus) and all(
        math.isclose(specimen[name], getattr(of, name)) for name in _PUBLISHED
    )


def way(x: float, y: float, direction: float) -> float:
    """Angle of a motion across the tube from the load's direction about +z, rad, -pi to pi."""
    return float(np.angle(complex(x, y) * np.exp(-1j * direction)))


def free_way(axis: float, direction: float) -> float:
    """The same for a hinge that turns about ``axis`` (rad from +x) alone: across the axis, with the load.

    NaN for a load along the axis, which moves nothing.

    Examples
    --------
    >>> round(float(np.rad2deg(free_way(np.deg2rad(60.0), -np.pi / 2))), 6)
    60.0
    """
    across = np.exp(1j * (axis + np.pi / 2))
    share = (across * np.exp(-1j * direction)).real
    if abs(share) < 1e-9:
        return float("nan")
    towards = across * np.sign(share)
    return way(towards.real, towards.imag, direction)
