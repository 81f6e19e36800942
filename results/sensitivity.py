"""Sensitivities, one at a time: what follows from a field of specimen or experiment, and what would explain the lab."""

import math
from collections import Counter
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lab.experiments import Pinch
from lab.formulas import hinge_stiffness_ratio
from lab.published import figures
from lab.units import Quantity
from results.accuracy import Entry
from results.benches import Bench, is_number
from results.push_tests import pairs, push_tests
from results.slugs import words
from results.tubes import published_size

#: Results.
OPEN, CLOSED, RATIO = "stiffness open [N/m]", "stiffness pinched [N/m]", "open over pinched"
CLOSING, ANISOTROPY = "closing force [N]", "anisotropy"
#: Fields whose series have tables of their own, or that only say how often is recorded.
_LEFT_OUT = (
    "experiment.pinch_angle", "experiment.increments", "experiment.bend_increments", "experiment.rig_stiffness",
)  # fmt: skip
#: Beyond this factor of the nominal value, or of the swept range, an extrapolation says nothing.
FAR = 3.0


@dataclass(frozen=True)
class Sensitivity:
    """One result over one field.

    Parameters
    ----------
    entry
        The nominal case.
    result, path
        Name of the result with its unit, dotted path of the field.
    quantity
        Units of the field; None where it has none.
    values, results
        Of the field, SI, ascending, and what followed (n,).
    nominal
        Place of the nominal case in them.
    target
        What the lab has, NaN where it has nothing.
    """

    entry: Entry
    result: str
    path: str
    quantity: Quantity | None
    values: np.ndarray
    results: np.ndarray
    nominal: int
    target: float = math.nan

    @property
    def by_power(self) -> bool:
        """Whether the field is positive throughout, so that a power of it makes sense."""
        return bool((self.values > 0).all())

    @property
    def _places(self) -> np.ndarray:
        return np.log(self.values) if self.by_power else self.values

    @property
    def slope(self) -> float:
        """Change of the result's logarithm with the field's, or with the field in SI where that may be zero."""
        return float(np.polyfit(self._places, np.log(self.results), 1)[0])

    def matching(self) -> tuple[float, bool]:
        """The field's value that would bring the target, SI, and whether samples enclose it; NaN where nothing does."""
        if math.isnan(self.target):
            return math.nan, False
        places, off = self._places, np.log(self.results / self.target)
        enclosed = [
            places[i] - off[i] * (places[i + 1] - places[i]) / (off[i + 1] - off[i])
            for i in range(len(off) - 1) if off[i] * off[i + 1] <= 0 and off[i] != off[i + 1]
        ]  # fmt: skip
        here = places[self.nominal]
        if enclosed:
            place, between = min(enclosed, key=lambda p: abs(p - here)), True
        else:
            if not self.slope:
                return math.nan, False
            place, between = here - off[self.nominal] / self.slope, False
            limit = math.log(FAR) if self.by_power else FAR * np.ptp(self.values)
            if abs(place - here) > limit:
                return math.nan, False
        return (math.exp(place) if self.by_power else float(place)), between


def sensitivities(entries: Sequence[Entry]) -> list[Sensitivity]:
    """All results of push tests and pinches over every number in which nothing else differs."""
    samples = list(_samples(entries))
    groups: dict[tuple[str, Hashable], list[_Sample]] = {}
    for sample in samples:
        for path, value in sample.bench.fields.items():
            if is_number(value) and path not in _LEFT_OUT:
                groups.setdefault((path, sample.others(path)), []).append(sample)
    several = {key: found for key, members in groups.items() if len(found := _distinct(members, key[0])) > 1}
    count = Counter(id(sample) for members in several.values() for sample in members)
    return [one for (path, _), members in several.items() for one in _of_group(members, path, count)]


@dataclass(frozen=True, eq=False)
class _Sample:
    entry: Entry
    bench: Bench
    results: Mapping[str, float]

    def result(self, name: str) -> float:
        """A result; NaN where there is none, which a logarithm takes as well as one that is not positive."""
        value = self.results.get(name, math.nan)
        return value if value > 0 and math.isfinite(value) else math.nan

    def others(self, path: str) -> Hashable:
        """Equal for samples that differ at most in the field ``path``."""
        fields = tuple((name, value) for name, value in self.bench.fields.items() if name != path)
        return self.entry.performer, self.entry.specimen, fields


def _samples(entries: Sequence[Entry]) -> Iterator[_Sample]:
    for opened, closed in pairs(push_tests(entries)):
        if closed is not None:
            ratio = {RATIO: opened.k / closed.k} if opened is not None else {}
            yield _Sample(closed.entry, closed.bench, {CLOSED: closed.k, **ratio})
    for test in push_tests(entries):
        if not test.experiment.pinched:
            yield _Sample(test.entry, test.bench, {OPEN: test.k})
    for entry in entries:
        if isinstance(entry.experiment, Pinch):
            numbers = entry.scalars()
            results = {CLOSING: "closing_force", ANISOTROPY: "anisotropy"}
            values = {name: numbers[key].value if key in numbers else math.nan for name, key in results.items()}
            yield _Sample(entry, Bench.whole(entry), values)


def _distinct(members: Sequence[_Sample], path: str) -> list[_Sample]:
    """The first sample of every value, by ascending values."""
    found: dict[float, _Sample] = {}
    for sample in members:
        found.setdefault(float(sample.bench.fields[path]), sample)
    return [found[value] for value in sorted(found)]


def _of_group(members: Sequence[_Sample], path: str, count: Counter[int]) -> Iterator[Sensitivity]:
    """One per result.  Nominal is the sample that stands in most sweeps, of several the one with the shortest name."""
    nominal = max(members, key=lambda s: (count[id(s)], -len(words(s.entry.slug))))
    for name in nominal.results:
        known = [s for s in members if not math.isnan(s.result(name))]
        if len(known) > 1 and nominal in known:
            values = np.array([float(s.bench.fields[path]) for s in known])
            results = np.array([s.result(name) for s in known])
            yield Sensitivity(
                nominal.entry, name, path, nominal.bench.quantity(path), values, results, known.index(nominal),
                math.nan if path.startswith("performer.") else _target(nominal, name),
            )  # fmt: skip


def _target(nominal: _Sample, name: str) -> float:
    """The lab's figure for a tube of its size, NaN for results that it has not."""
    if published_size(nominal.entry.record.specimen) != "printed-tpu":
        return math.nan
    if name == OPEN:
        return float(figures()["c3-k-unpinched"]["value"])
    if nominal.bench.fields.get("experiment.pinch_angle"):
        return math.nan
    ratio = hinge_stiffness_ratio()
    assert isinstance(ratio, float)
    return {CLOSED: float(figures()["c3-k-pinched"]["value"]), RATIO: ratio}.get(name, math.nan)
