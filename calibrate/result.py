"""What every fit hands back."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from calibrate.bootstrap import Bootstrap
from calibrate.profile import Profile

#: Relative standard error above which a parameter is called not identified.
IDENTIFIED = 0.20
Use = Literal["in sample", "held out"]


@dataclass(frozen=True)
class FittedParameter:
    """A number after a fit, SI units.

    Parameters
    ----------
    lower, upper
        Bounds of the search.
    standard_error
        From the residual at the optimum; NaN or infinite where the records do not give one.
    interval
        95 %, symmetric on the scale of the search (logarithmic over wide ranges), cut at its bounds.
    """

    name: str
    unit: str
    lower: float
    upper: float
    value: float
    standard_error: float
    interval: tuple[float, float] = (math.nan, math.nan)

    @property
    def identified(self) -> bool:
        """Whether the records pin the value down."""
        return self.standard_error <= IDENTIFIED * abs(self.value)


@dataclass(frozen=True)
class TargetResult:
    """How the fitted model follows one record.

    Parameters
    ----------
    use
        ``in sample``: the fit has seen the record; ``held out``: not.
    error
        Markers: tracking error, a fraction, see ``lab.measures.TRACKING_ERROR_DEFINITION``, against the record
        with the nuisances taken out.  Reduced numbers: root mean square of their misfits, each over the
        largest number of the same unit.
    rms
        Eq. 5.13 in m; NaN where there are no markers.
    entries
        Relative misfit of each reduced number.
    nuisances
        Sensor numbers of this record, SI, offsets per marker and axis; of a held-out record they are its own refit.
    """

    name: str
    use: Use
    error: float
    rms: float
    entries: Mapping[str, float] = field(default_factory=dict)
    nuisances: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Advice:
    """An experiment that would tell more.

    Parameters
    ----------
    experiment
        In words.
    change
        What it changes in the experiment and the specimen, SI.
    worst
        The parameter with the largest relative standard error now.
    before, after
        The relative standard errors of all parameters, now and with this record added to those there are.
    """

    experiment: str
    change: Mapping[str, Any]
    worst: str
    before: Mapping[str, float]
    after: Mapping[str, float]
    sentence: str


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
        Relative, over the markers of all used records, see ``lab.measures.TRACKING_ERROR_DEFINITION``; NaN
        without markers.
    condition
        Condition number of the residual's derivative by the logarithms of the parameters.
    history
        Best objective after each generation, or after the starts and each polish, with the search's longer time
        steps.
    notes
        Plain sentences: bounds reached, parameters not identified, how the search ended.
    targets
        Every record, used or held out.
    nuisances
        Searched sensor numbers of the used records.
    advice
        Experiments that would tell more, the best one first.
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
    targets: tuple[TargetResult, ...] = ()
    nuisances: tuple[FittedParameter, ...] = ()
    profiles: tuple[Profile, ...] = ()
    bootstrap: Bootstrap | None = None
    advice: tuple[Advice, ...] = ()

    def values(self) -> dict[str, float]:
        """Fitted values by name, SI."""
        return {p.name: p.value for p in self.parameters}

    def to_json(self) -> dict[str, Any]:
        """Plain JSON data; null stands for NaN and infinity."""
        return plain(asdict(self))


def plain(value: Any) -> Any:
    """Data without tuples, NaN and infinity, as JSON has none."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
