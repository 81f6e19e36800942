"""Parameters as smooth functions of the design, learned from fits at several designs.

Each parameter is a polyharmonic spline of second order with a linear part: the function of least bending energy
through the fitted values, which is the natural cubic spline in one design variable and the thin plate spline in
two, and goes on as a straight line outside.  Nothing has to be tuned for a handful of designs, whatever their
places, and designs may lie anywhere.  Positive parameters are learned as logarithms, so that they stay positive and
relative errors count.  How far values may be missed (they have errors) is chosen by leave-one-out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.result import plain
from lab.fields import number_at, quantity_of
from lab.materials import Frozen
from lab.specimens import Specimen

Array = NDArray[np.float64]
Symmetry = Literal["even", "odd"]
#: Splines of second order by the number of design variables; beyond three the last one.
_KERNELS = {1: "cubic", 2: "thin_plate_spline", 3: "linear"}
#: Smoothing that leave-one-out chooses among, and the number of designs below which there is none.
_SMOOTHING, _ENOUGH = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1), 5
#: Distance to the next design, over the usual one between designs, from which on a design is far from them.
_FAR = 1.0


@dataclass(frozen=True)
class Curve:
    """One parameter over the designs.

    Parameters
    ----------
    name, unit
        Of the parameter, SI.
    values, standard_errors
        Fitted at each design, (n,), SI.
    known
        Designs whose records pin the parameter down, (n,); the others do not count.
    lower, upper
        Bounds of the fits, which predictions respect.
    symmetry
        Of the parameter as a function of the single design variable.
    smoothing
        How far the spline may miss the values; 0: it goes through them.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    known: tuple[bool, ...]
    lower: float
    upper: float
    symmetry: Symmetry | None = None
    smoothing: float = 0.0

    @property
    def logarithmic(self) -> bool:
        """Whether logarithms are learned: of positive parameters that do not change their sign with the design."""
        return self.lower > 0.0 and min(self.values) > 0.0 and self.symmetry != "odd"

    def at(self, points: Array, place: Array) -> float:
        """Value at a scaled design (d,), from scaled designs (n, d)."""
        mine = np.array(self.known)
        if mine.sum() < points.shape[1] + 1:
            mine[:] = True
        values = np.array(self.values)[mine]
        learned = np.log(values) if self.logarithmic else values
        found = _spline(points[mine], learned, place, self.smoothing, self.symmetry)
        return float(np.clip(np.exp(found) if self.logarithmic else found, self.lower, self.upper))


@dataclass(frozen=True)
class Prediction:
    """Parameters of a new design, SI, and why to doubt them; no warning where there is no reason."""

    values: Mapping[str, float]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class ParametricModel:
    """Curves of all parameters over the designs.

    Parameters
    ----------
    topology
        Name of the PRB topology whose parameters they are.
    design
        Numeric fields of the specimen.
    points
        Designs (n, d), SI.
    specimen
        Plain data of one of the specimens: what else a design must share with them.
    """

    topology: str
    design: tuple[str, ...]
    points: tuple[tuple[float, ...], ...]
    curves: tuple[Curve, ...]
    specimen: Mapping[str, Any]

    def predict(self, specimen: Specimen) -> Prediction:
        """Parameters for a specimen, with a warning where it is outside of the designs or far from them."""
        place = self.scaled(np.array([design_of(specimen, self.design)]))[0]
        points = self.scaled(np.array(self.points))
        values = {curve.name: curve.at(points, place) for curve in self.curves}
        return Prediction(values, tuple(self._doubts(specimen, points, place)))

    def without(self, number: int) -> "ParametricModel":
        """The model learned from all designs but one."""
        points = _without(self.points, number)
        fewer = ParametricModel(self.topology, self.design, points, (), self.specimen)
        curves = []
        for curve in self.curves:
            lists = {name: _without(getattr(curve, name), number) for name in ("values", "standard_errors", "known")}
            left = Curve(**{**vars(curve), **lists, "smoothing": 0.0})
            curves.append(_smoothed(left, fewer.scaled(np.array(points))))
        return replace(fewer, curves=tuple(curves))

    def is_inside(self, specimen: Specimen) -> bool:
        """Whether a design lies among the others, so that predicting it is interpolation."""
        place = self.scaled(np.array([design_of(specimen, self.design)]))[0]
        return _inside(self._mirrored(self.scaled(np.array(self.points))), place)

    @cached_property
    def _span(self) -> Array:
        span = np.ptp(np.array(self.points), axis=0)
        return np.where(span > 0.0, span, 1.0)

    def scaled(self, points: Array) -> Array:
        """Designs over the range of the fitted ones, (n, d); zero stays zero, for what is symmetric about it."""
        return np.asarray(points / self._span)

    def _mirrored(self, points: Array) -> Array:
        """Designs with their images, where every curve has a symmetry."""
        return np.vstack([points, -points]) if all(curve.symmetry for curve in self.curves) else points

    def _doubts(self, specimen: Specimen, points: Array, place: Array) -> list[str]:
        known = self._mirrored(points)
        doubts = [
            f"{name} {_shown(specimen, name)} is outside of the designs, "
            f"{_shown(specimen, name, low)} to {_shown(specimen, name, high)}"
            for name, low, high, inside in self._ranges(specimen)
            if not inside
        ]
        if not doubts and not _inside(known, place):
            doubts.append("the design lies between the ranges of the fitted ones, but not among them")
        apart = float(np.min(np.linalg.norm(known - place, axis=1))) / _spacing(points)
        if apart > _FAR:
            doubts.append(f"the next fitted design is {apart:.1f} times the usual spacing away")
        own = specimen.model_dump(mode="json")
        for path, value in _numbers(self.specimen):
            if path not in self.design and _at(own, path) != value:
                doubts.append(f"{path} is {_at(own, path)}, but was {value} in the fits")
        return doubts

    def _ranges(self, specimen: Specimen) -> list[tuple[str, float, float, bool]]:
        found = []
        points, places = self._mirrored(np.array(self.points)), design_of(specimen, self.design)
        for name, column, value in zip(self.design, points.T, places, strict=True):
            low, high = float(column.min()), float(column.max())
            slack = 1e-9 * (high - low)
            found.append((name, low, high, low - slack <= value <= high + slack))
        return found

    def to_json(self) -> dict[str, Any]:
        """Plain JSON data."""
        curves = [plain({**vars(curve)}) for curve in self.curves]
        return {
            "topology": self.topology,
            "design": list(self.design),
            "points": [list(point) for point in self.points],
            "curves": curves,
            "specimen": dict(self.specimen),
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """The model that ``to_json`` wrote."""
        curves = []
        for written in data["curves"]:
            errors = [np.inf if error is None else error for error in written["standard_errors"]]
            lists = {
                "values": tuple(written["values"]),
                "standard_errors": tuple(errors),
                "known": tuple(written["known"]),
            }
            curves.append(Curve(**{**written, **lists}))
        points = tuple(map(tuple, data["points"]))
        return cls(data["topology"], tuple(data["design"]), points, tuple(curves), data["specimen"])


def learn(
    topology: str, design: Sequence[str], specimens: Sequence[Specimen], curves: Sequence[Curve]
) -> ParametricModel:
    """Parametric model from curves over the designs of ``specimens``, whose smoothing is chosen here.

    Raises
    ------
    ValueError
        In one line: too few designs, one that is given twice, a variable that does not vary, or
        specimens that differ elsewhere.
    """
    points = np.array([design_of(specimen, design) for specimen in specimens])
    _check(design, points, specimens)
    base = specimens[0].model_dump(mode="json")
    model = ParametricModel(topology, tuple(design), tuple(map(tuple, points.tolist())), tuple(curves), base)
    return replace(model, curves=tuple(_smoothed(curve, model.scaled(points)) for curve in curves))


def _check(design: Sequence[str], points: Array, specimens: Sequence[Specimen]) -> None:
    needed = len(design) + 2
    if len(points) < needed:
        raise ValueError(f"{len(points)} designs are too few over {', '.join(design)}: at least {needed} are needed")
    for name, column in zip(design, points.T, strict=True):
        if np.ptp(column) == 0.0:
            raise ValueError(f"{name} is {_shown(specimens[0], name)} in all designs: it must vary")
    if len(np.unique(points, axis=0)) < len(points):
        raise ValueError("two designs are the same; give the records of one design to one fit")
    first = _numbers(specimens[0].model_dump(mode="json"))
    for other in specimens[1:]:
        data = other.model_dump(mode="json")
        for path, value in first:
            if path not in design and _at(data, path) != value:
                raise ValueError(f"specimens differ in {path} ({value} and {_at(data, path)}), which is not in design")


def design_of(specimen: Specimen, design: Sequence[str]) -> tuple[float, ...]:
    """The design variables of a specimen, SI."""
    return tuple(number_at(specimen, name)[0] for name in design)


def _smoothed(curve: Curve, points: Array) -> Curve:
    """With the smoothing that predicts left-out values best; none for few designs."""
    mine = np.flatnonzero(curve.known)
    if len(mine) < max(_ENOUGH, points.shape[1] + 3):
        return curve
    values = np.array(curve.values)[mine]
    learned, places = np.log(values) if curve.logarithmic else values, points[mine]
    misses = []
    for smoothing in _SMOOTHING:
        found = [
            _spline(np.delete(places, i, 0), np.delete(learned, i), places[i], smoothing, curve.symmetry) - learned[i]
            for i in range(len(mine))
        ]
        misses.append(float(np.sum(np.square(found))))
    # No smoothing unless it pays: leave-one-out of a few values is a noisy judge.
    best = int(np.argmin(misses))
    chosen = _SMOOTHING[best] if misses[best] < 0.8 * misses[0] else 0.0
    return Curve(**{**vars(curve), "smoothing": chosen})


def _spline(points: Array, values: Array, place: Array, smoothing: float, symmetry: Symmetry | None) -> float:
    from scipy.interpolate import RBFInterpolator

    if symmetry:
        sign = 1.0 if symmetry == "even" else -1.0
        # An image that falls on a design would be there twice.
        images = [i for i, p in enumerate(points) if not np.any(np.all(np.isclose(points, -p), axis=1))]
        points, values = np.vstack([points, -points[images]]), np.concatenate([values, sign * values[images]])
    kernel: Any = _KERNELS.get(points.shape[1], "linear")
    return float(RBFInterpolator(points, values, smoothing=smoothing, kernel=kernel, degree=1)(place[None])[0])


def _inside(points: Array, place: Array) -> bool:
    """Whether a place (d,) lies in the convex hull of the points (n, d)."""
    slack = 1e-9
    if points.shape[1] == 1:
        return bool(points.min() - slack <= place[0] <= points.max() + slack)
    from scipy.optimize import linprog

    equal = np.vstack([points.T, np.ones(len(points))])
    return bool(linprog(np.zeros(len(points)), A_eq=equal, b_eq=np.append(place, 1.0), bounds=(0, None)).success)


def _spacing(points: Array) -> float:
    """Usual distance from a design to the next one."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    return float(np.median(distance.min(axis=1)))


def _shown(specimen: Frozen, name: str, value: float | None = None) -> str:
    number, unit = number_at(specimen, name)
    owner: Any = specimen
    for part in name.split(".")[:-1]:
        owner = getattr(owner, part)
    quantity = quantity_of(type(owner), name.split(".")[-1])
    number = number if value is None else value
    return quantity.show(number) if quantity else f"{number:.6g} {unit}"


def _numbers(data: Any, path: str = "") -> list[tuple[str, Any]]:
    """Every entry of plain data that is no container, with its dotted path."""
    if isinstance(data, Mapping):
        return [item for key, value in data.items() for item in _numbers(value, f"{path}.{key}" if path else key)]
    return [(path, data)]


def _at(data: Any, path: str) -> Any:
    for part in path.split("."):
        data = data.get(part) if isinstance(data, Mapping) else None
    return data


def _without(items: Sequence[Any], number: int) -> tuple[Any, ...]:
    return tuple(item for i, item in enumerate(items) if i != number)
