"""Parameters of a PRB model from marker tracks (5.4.2, eq. 5.13)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, OptimizeResult, differential_evolution, least_squares

from calibrate.result import FitResult, FittedParameter
from calibrate.spec import TrackingFit
from calibrate.uncertainty import Uncertainty, relative_uncertainty
from lab.experiments import RingDown
from lab.records import Record
from lab.specimens import Specimen
from lab.units import to_si
from prb.model import PrbModel
from prb.topologies import TOPOLOGIES, Parameter

Array = NDArray[np.float64]
#: Bounds further apart than this ratio are searched on a logarithmic scale.
_DECADE = 10.0
#: Step of central differences, and closeness to a bound that counts as reached, as shares of the range.
_DIFFERENCE, _AT_BOUND = 1e-4, 1e-3


@dataclass(frozen=True)
class Range:
    """Search range of the free parameters, mapped to the unit cube.

    Parameters
    ----------
    parameters
        Declared for the specimen; ``lower`` and ``upper``, (p,), are the bounds of this search, SI.
    """

    parameters: tuple[Parameter[float], ...]
    lower: Array
    upper: Array

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """Which parameters are searched on a logarithmic scale, (p,)."""
        return (self.lower > 0.0) & (self.upper >= _DECADE * self.lower)

    def values(self, unit: Array) -> Array:
        """Parameter values at points of the unit cube, both (..., p)."""
        ratio = np.where(self.logarithmic, self.upper / np.where(self.logarithmic, self.lower, 1.0), 1.0)
        linear = self.lower + unit * (self.upper - self.lower)
        # Clipped, since a bound must not be missed by rounding: models refuse values beyond it.
        return np.clip(np.where(self.logarithmic, self.lower * ratio**unit, linear), self.lower, self.upper)

    def slope(self, unit: Array) -> Array:
        """Derivative of the logarithm of the values by the coordinates of the unit cube, (p,)."""
        logarithmic = self.logarithmic
        span = np.log(np.where(logarithmic, self.upper / np.where(logarithmic, self.lower, 1.0), 1.0))
        return np.where(logarithmic, span, (self.upper - self.lower) / self.values(unit))


def search_range(specimen: Specimen, model: PrbModel, spec: TrackingFit) -> Range:
    """Bounds of the free parameters for ``specimen``.

    Raises
    ------
    ValueError
        In one line, for an unknown parameter, or bounds that cannot be read, are not in order, or
        leave the topology's.
    """
    topology = TOPOLOGIES[model.topology]
    parameters = tuple(topology.parameter(name).of(specimen) for name in spec.free)
    pairs = [_bounds(parameter, spec.free[parameter.name]) for parameter in parameters]
    lower, upper = np.array(pairs).T
    return Range(parameters, lower, upper)


def _bounds(parameter: Parameter[float], written: tuple[float | str, float | str] | None) -> tuple[float, float]:
    if written is None:
        return float(parameter.lower), float(parameter.upper)
    low, high = (to_si(b, parameter.unit) if isinstance(b, str) else float(b) for b in written)
    if not low < high:
        raise ValueError(f"bounds of {parameter.name}: {parameter.show(low)} is not below {parameter.show(high)}")
    parameter.check(low)
    parameter.check(high)
    return low, high


@dataclass
class Tracking:
    """Residuals of candidates against reference records, which must be completed ring-downs."""

    specimen: Specimen
    model: PrbModel
    references: Sequence[Record]
    threads: int = 1
    evaluations: int = 0
    #: Places of references that share their sampling, and what simulates those.
    _groups: list[tuple[list[int], Callable[[Array], Array]]] = field(default_factory=list, repr=False)

    def __post_init__(self) -> None:
        from prb.batch import RingDownBatch  # loads MuJoCo

        groups: dict[tuple, list[int]] = {}
        experiments = [_ring_down(record) for record in self.references]
        for i, e in enumerate(experiments):
            groups.setdefault((e.rate, e.samples, e.markers), []).append(i)
        for members in groups.values():
            batch = RingDownBatch(
                self.specimen, [experiments[i] for i in members], self.model.topology,
                time_step=self.model.time_step, threads=self.threads,
            )  # fmt: skip
            self._groups.append((members, batch))

    def residuals(self, values: Array) -> Array:
        """Scaled differences; the root of their sum of squares is the joint objective in m.

        Parameters
        ----------
        values
            All parameters of the topology, (candidates, parameters), SI.

        Returns
        -------
        residuals
            (candidates, N), NaN for candidates that fail: marker differences over the root of
            samples x markers x records, so that every record weighs the same.
        """
        self.evaluations += len(values)
        blocks: list[Array] = [np.empty(0)] * len(self.references)
        for members, batch in self._groups:
            markers = batch(values)
            for position, i in enumerate(members):
                reference = self.references[i]["markers"]
                weight = 1.0 / np.sqrt(reference.shape[0] * reference.shape[1] * len(self.references))
                blocks[i] = weight * (markers[:, position] - reference).reshape(len(values), -1)
        return np.concatenate(blocks, axis=1)

    def relative_error(self, values: Array) -> float:
        """Relative tracking error over all records of one candidate, (parameters,)."""
        residual = self.residuals(values[None])[0]
        start, total, differences = 0, 0.0, 0.0
        for record in self.references:
            reference = record["markers"]
            weight = reference.shape[0] * reference.shape[1] * len(self.references)
            differences += weight * float(np.sum(residual[start : start + reference.size] ** 2))
            total += float(np.sum(reference**2))
            start += reference.size
        return float(np.sqrt(differences / total))


def _ring_down(record: Record) -> RingDown:
    if record.experiment.get("kind") != "RingDown":
        raise ValueError(f"a tracking fit needs ring-downs, not {record.experiment.get('kind')}")
    if not record.completed:
        raise ValueError(f"the reference {record.model} is {record.status}: {record.reason}")
    experiment = RingDown.model_validate(dict(record.experiment))
    expected = (experiment.samples, len(experiment.markers), 3)
    if record["markers"].shape != expected:
        raise ValueError(f"the reference {record.model} has markers of shape {record['markers'].shape}, not {expected}")
    return experiment


@dataclass
class _Search:
    """The objective on the unit cube of the free parameters.

    Parameters
    ----------
    template, free
        Values of all parameters of the topology (parameters,), SI, and the places of the free ones.
    penalty
        Objective of candidates that cannot be simulated, m.
    history
        Best objective after each generation, m.
    """

    tracking: Tracking
    range: Range
    template: Array
    free: list[int]
    penalty: float
    history: list[float] = field(default_factory=list)

    def all_values(self, unit: Array) -> Array:
        """Points of the unit cube (n, p) as values of all parameters (n, parameters)."""
        values = np.tile(self.template, (len(unit), 1))
        values[:, self.free] = self.range.values(unit)
        return values

    def residual(self, unit: Array) -> Array:
        return self.tracking.residuals(self.all_values(unit[None]))[0]

    def objectives(self, columns: Array) -> Array:
        """Objective (m) of each column of (p, n); failed candidates get a finite penalty."""
        residuals = self.tracking.residuals(self.all_values(columns.T))
        return np.nan_to_num(np.sqrt(np.sum(residuals**2, axis=1)), nan=self.penalty)

    def derivative(self, unit: Array) -> Array:
        """Central differences of the residual inside the cube, (N, p), in one batch."""
        up, down = (np.clip(unit + sign * _DIFFERENCE * np.eye(len(unit)), 0.0, 1.0) for sign in (1.0, -1.0))
        residuals = self.tracking.residuals(self.all_values(np.vstack([up, down])))
        high, low = np.split(residuals, 2)
        return ((high - low) / np.diag(up - down)[:, None]).T

    def remember(self, intermediate_result: OptimizeResult) -> None:
        self.history.append(float(intermediate_result.fun))


def fit_tracking(
    specimen: Specimen, model: PrbModel, references: Sequence[Record], spec: TrackingFit, threads: int = 1
) -> FitResult:
    """Fit free parameters of ``model`` to the marker tracks of all ``references`` jointly.

    Differential evolution, as in the dissertation, then least squares from its best candidate.
    Parameters that are not free keep the model's values.  The same seed gives the same result.

    Parameters
    ----------
    references
        Completed ring-downs of ``specimen``, one per name in ``spec.used``.
    threads
        Threads of the simulator; they do not change the result.

    Raises
    ------
    ValueError
        In one line, for records or bounds that do not fit the model.
    """
    begin = perf_counter()
    search = _search(specimen, model, references, spec, threads)
    # The stubs of SciPy do not know vectorized objectives, which return an array.
    objectives: Any = search.objectives
    found = differential_evolution(
        objectives, Bounds(np.zeros(len(search.free)), np.ones(len(search.free))), popsize=spec.population,
        maxiter=spec.generations, tol=spec.tolerance, rng=np.random.default_rng(spec.seed), polish=False,
        vectorized=True, updating="deferred", callback=search.remember,
    )  # fmt: skip
    best, residual = _polish(search, found.x)
    unknown = relative_uncertainty(search.derivative(best) / search.range.slope(best), residual)
    values = search.range.values(best)
    columns = np.column_stack(
        [search.range.lower, search.range.upper, values, np.abs(values) * unknown.standard_errors]
    )
    parameters = tuple(
        FittedParameter(p.name, p.unit, *row) for p, row in zip(search.range.parameters, columns.tolist(), strict=True)
    )
    return FitResult(
        kind=spec.kind,
        parameters=parameters,
        correlation=tuple(map(tuple, unknown.correlation.tolist())),
        objective=float(np.sqrt(residual @ residual)),
        objective_unit="m",
        tracking_error=search.tracking.relative_error(search.all_values(best[None])[0]),
        condition=unknown.condition,
        history=tuple(search.history),
        evaluations=search.tracking.evaluations,
        seed=spec.seed,
        wall_time_s=perf_counter() - begin,
        used=tuple(spec.used),
        notes=tuple(_notes(best, parameters, unknown, bool(found.success), spec)),
    )


def _search(
    specimen: Specimen, model: PrbModel, references: Sequence[Record], spec: TrackingFit, threads: int
) -> _Search:
    if not references:
        raise ValueError("a tracking fit needs at least one reference")
    names = TOPOLOGIES[model.topology].names
    given = model.values(specimen)
    largest = max(float(np.sqrt(np.mean(np.sum(record["markers"] ** 2, axis=-1)))) for record in references)
    return _Search(
        Tracking(specimen, model, references, threads),
        search_range(specimen, model, spec),
        np.array([given[name] for name in names]),
        [names.index(name) for name in spec.free],
        # Ten times what a beam that never moves would score.
        penalty=10.0 * largest,
    )


def _polish(search: _Search, start: Array) -> tuple[Array, Array]:
    """Best point of the unit cube and its residual, from least squares begun at ``start``."""
    first = search.residual(start)
    if not np.isfinite(first).all():
        raise ValueError("no candidate of the search could be simulated; narrow the bounds or shorten the time step")
    # In micrometres: least_squares' tolerances are absolute for small residuals.
    scale = 1e6

    def residual(unit: Array) -> Array:
        return scale * search.residual(unit)

    def derivative(unit: Array) -> Array:
        return scale * search.derivative(unit)

    result = least_squares(
        residual, start, jac=derivative, bounds=(0.0, 1.0), xtol=1e-8, ftol=1e-10, gtol=1e-12, max_nfev=40
    )
    polished = result.fun / scale
    return (result.x, polished) if polished @ polished < first @ first else (start, first)


def _notes(
    best: Array, parameters: tuple[FittedParameter, ...], unknown: Uncertainty, converged: bool, spec: TrackingFit
) -> list[str]:
    notes = []
    for position, parameter in zip(best, parameters, strict=True):
        if not _AT_BOUND < position < 1.0 - _AT_BOUND:
            side = "lower" if position <= _AT_BOUND else "upper"
            notes.append(f"{parameter.name} ended at its {side} bound: the true optimum may lie beyond it.")
        if not parameter.identified:
            share = 100.0 * parameter.standard_error / abs(parameter.value)
            why = f"its standard error is {share:.0f} %" if np.isfinite(share) else "it does not show in them"
            notes.append(f"{parameter.name} is not identified by these records: {why}.")
    if not np.isfinite(unknown.condition):
        notes.append("Some combination of the parameters does not show in these records at all.")
    if not converged:
        notes.append(f"The global search used all its {spec.generations} generations before its candidates agreed.")
    notes.append("Standard errors take the residual for independent noise; errors of the model itself are not in them.")
    return notes
