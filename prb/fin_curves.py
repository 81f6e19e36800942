"""What a fit of kind ``paddler`` has learned of a fin: how flattening turns it, and how its hinge gives way."""

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen

Array = NDArray[np.float64]
Four = tuple[float, float, float, float]
#: Coefficients of g(x1): MuJoCo couples joints by polynomials of the fourth degree.
TERMS = 5


class SenseCurves(Frozen):
    """Spring of the fin's hinge in one sense, over the flattening s = x1 / widening, from 0 to 1.

    Stiffness K (N*m/rad) and limit moment L (N*m) are two-term exponentials a exp(b s) + c exp(d s), as in 4.5.3; up
    to L the moment is K |q|, and beyond it goes on with the slope ``beyond`` times K.
    """

    stiffness: Four
    limit: Four
    beyond: float = Field(ge=0, le=1)

    @model_validator(mode="after")
    def _resists(self) -> Self:
        s = np.linspace(0.0, 1.0, 101)
        for name in ("stiffness", "limit"):
            if (least := float(two_term(getattr(self, name), s).min())) <= 0:
                raise ValueError(f"{name} falls to {least:g} between the open and the flat tube; it must stay positive")
        return self


class FinCurves(Frozen):
    """Learned curves of a fin.

    Parameters
    ----------
    widening
        x1 at which the tube counts as flat, m.
    travels
        Approach of the tube's top and bottom and x1 that it comes with, both rising, m.
    turn
        Coefficients of theta_1 = g(x1), rising powers of x1 (m), rad; None: not learned.
    opposite, equal
        Springs; None: not learned.
    errors
        Root mean square misfit of each curve over its largest value, by name.
    specimen
        What the records were of, as plain data.
    """

    widening: float = Field(gt=0)
    travels: tuple[tuple[float, float], ...] = Field(min_length=2)
    turn: tuple[float, float, float, float, float] | None = None
    opposite: SenseCurves | None = None
    equal: SenseCurves | None = None
    errors: dict[str, float] = {}
    specimen: dict[str, Any] = {}

    @model_validator(mode="after")
    def _closes(self) -> Self:
        if self.turn is not None:
            angles = np.polynomial.polynomial.polyval(np.linspace(0.0, self.widening, 51), self.turn)
            if angles.max() > 3.0 or angles.min() < -1.0:
                raise ValueError(
                    "the learned fin angle leaves the range from -1 to 3 rad; the records do not belong here"
                )
        return self

    def flattening(self, travel: float) -> float:
        """s at an approach of top and bottom, m; from 0 to 1."""
        travels, widths = np.transpose(self.travels)
        return float(np.clip(np.interp(travel, travels, widths) / self.widening, 0.0, 1.0))

    def doubts(self, specimen: Any) -> tuple[str, ...]:
        """Why not to trust the curves for ``specimen``: its numbers differ from those that were learned from."""
        if not self.specimen:
            return ()
        here = specimen.model_dump(mode="json")
        # The load fin is a rigid extension, which the records of the fin alone say nothing against.
        names = [k for k, v in self.specimen.items() if k in here and here[k] != v and k != "load_fin"]
        return (f"the fin's curves were learned with another {', '.join(names)}",) if names else ()


def two_term(coefficients: Four, s: Array) -> Array:
    """a exp(b s) + c exp(d s)."""
    a, b, c, d = coefficients
    return np.asarray(a * np.exp(b * s) + c * np.exp(d * s))
