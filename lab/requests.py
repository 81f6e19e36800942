"""How a fit asks a performer for many runs at once."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lab.experiments import Experiment
from lab.specimens import Specimen


@dataclass(frozen=True)
class Request:
    """One run that a fit asks a performer for.

    Parameters
    ----------
    specimen, experiment
        What is done.
    values
        Numbers of the performer in SI units: every parameter of a PRB topology; empty for FEA, where the
        specimen carries all.
    """

    specimen: Specimen
    experiment: Experiment
    values: Mapping[str, float] = field(default_factory=dict)


#: Values of the record's channels by name, as ``markers`` (samples, markers, 3) in m; None: the run failed.
Response = Mapping[str, NDArray[np.float64]] | None
