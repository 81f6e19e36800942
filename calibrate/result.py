"""What every fit hands back."""

import math
from dataclasses import asdict, dataclass
from typing import Any

#: Relative standard error above which a parameter is called not identified.
IDENTIFIED = 0.20


@dataclass(frozen=True)
class FittedParameter:
    """A parameter after a fit, SI units.

    Parameters
    ----------
    lower, upper
        Bounds of the search.
    standard_error
        From the residual at the optimum; NaN or infinite where the records do not give one.
    """

    name: str
    unit: str
    lower: float
    upper: float
    value: float
    standard_error: float

    @property
    def identified(self) -> bool:
        """Whether the records pin the value down."""
        return self.standard_error <= IDENTIFIED * abs(self.value)


@dataclass(frozen=True)
class FitResult:
    """A fit, as plain data.

    Parameters
    ----------
    kind
        Kind of the fit's specification.
    parameters
        The free ones, in the order of ``correlation`` (parameters, parameters).
    objective, objective_unit
        Of the optimum: eq. 5.13 in m (root mean square over records), or the root mean square of
        relative misfits.
    tracking_error
        Relative, over all used records, see ``lab.measures.TRACKING_ERROR_DEFINITION``; NaN elsewhere.
    condition
        Condition number of the residual's derivative by the logarithms of the parameters.
    history
        Best objective after each generation.
    notes
        Plain sentences: bounds reached, parameters not identified, how the search ended.
    """

    kind: str
    parameters: tuple[FittedParameter, ...]
    correlation: tuple[tuple[float, ...], ...]
    objective: float
    objective_unit: str
    tracking_error: float
    condition: float
    history: tuple[float, ...]
    evaluations: int
    seed: int | None
    wall_time_s: float
    used: tuple[str, ...]
    notes: tuple[str, ...]

    def values(self) -> dict[str, float]:
        """Fitted values by name, SI."""
        return {p.name: p.value for p in self.parameters}

    def to_json(self) -> dict[str, Any]:
        """Plain JSON data; null stands for NaN and infinity."""
        return _plain(asdict(self))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
