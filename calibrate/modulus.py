"""Young's modulus of the FEA from measured static stiffness (table 5.1).

With the motions prescribed and Poisson's ratio fixed, every force and moment of a hyperelastic body is
proportional to Young's modulus.  One run at E0 therefore predicts K' at every E exactly.
"""

from collections.abc import Mapping, Sequence
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from calibrate.result import FitResult, FittedParameter
from calibrate.spec import FORCE_ENTRIES
from lab.experiments import KPRIME_ENTRIES
from lab.records import Record, Scalar

Array = NDArray[np.float64]
Row = Mapping[str, float]
_UNITS = dict(KPRIME_ENTRIES)


def row_scales(row: Row, entries: Sequence[str]) -> Array:
    """What misfits of each entry are divided by: the row's largest chosen entry of the same unit, (entries,).

    An entry's own value would let couplings that should vanish, like k_yz at phi = 0, decide the fit.
    """
    return np.array([max(abs(row[other]) for other in entries if _UNITS[other] == _UNITS[entry]) for entry in entries])


def best_factor(model: Array, measured: Array, scales: Array) -> float:
    """Factor f that minimises |(f model - measured) / scales|, all (n,)."""
    weights = scales**-2.0
    return float(np.sum(weights * model * measured) / np.sum(weights * model * model))


def fit_modulus(
    records: Sequence[Record],
    lab: Sequence[Mapping[str, Scalar | float]],
    entries: Sequence[str] = FORCE_ENTRIES,
    used: Sequence[str] = (),
) -> FitResult:
    """Young's modulus that brings computed K' closest to measured ones.

    E* = sum(w k1 k_lab) / sum(w k1^2) with k1 = k_fea / E0 and relative weights w = 1 / scale^2, see
    ``row_scales``.

    Parameters
    ----------
    records
        Completed static tests with a rigid rig and the entries of K' as scalars.
    lab
        The measured row for each of them.
    entries
        Entries of K' that count.
    used
        Names of the rows, for the result.
    """
    begin = perf_counter()
    unit_model, measured, scales = [], [], []
    for record, row in zip(records, lab, strict=True):
        modulus = _modulus_of(record)
        values = {entry: _value(row[entry]) for entry in entries}
        unit_model += [record.scalars[entry].value / modulus for entry in entries]
        measured += list(values.values())
        scales += row_scales(values, entries).tolist()
    model, target, scale = np.array(unit_model), np.array(measured), np.array(scales)
    modulus = best_factor(model, target, scale)
    misfit = (modulus * model - target) / scale
    error = float("nan")
    if len(misfit) > 1:
        error = float(np.sqrt(misfit @ misfit / (len(misfit) - 1) / np.sum((model / scale) ** 2)))
    return FitResult(
        kind="modulus",
        parameters=(FittedParameter("youngs_modulus", "Pa", 0.0, float("inf"), modulus, error),),
        correlation=((1.0,),),
        objective=float(np.sqrt(np.mean(misfit**2))),
        objective_unit="1",
        tracking_error=float("nan"),
        condition=1.0,
        history=(),
        evaluations=1,
        seed=None,
        wall_time_s=perf_counter() - begin,
        used=tuple(used),
        notes=("Linear least squares: stiffness is proportional to the modulus.",),
    )


def _value(number: Scalar | float) -> float:
    return number.value if isinstance(number, Scalar) else float(number)


def _modulus_of(record: Record) -> float:
    """E0 (Pa) of a record that scales with it.

    Records of calibrated performers carry their material in ``how``; the specimen's stands in otherwise.
    """
    if not record.completed:
        raise ValueError(f"{record.model} is {record.status}: {record.reason}")
    if record.experiment.get("rig_stiffness") is not None:
        raise ValueError("stiffness is proportional to Young's modulus on a rigid rig only; rank_readings fits both")
    material = record.how.get("material") or record.specimen["material"]
    return float(material["youngs_modulus"])
