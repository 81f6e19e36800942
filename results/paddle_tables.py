"""Paddling as tables: runs, sweeps, where the mean thrust changes sign, and tip speeds beside the plate law."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from lab.experiments import PaddleThrust
from lab.specimens import FinnedTube
from results.accuracy import Entry
from results.effects import sign_changes
from results.paddling import CASES, DISSERTATION, LAB, PLATE, PlateLaw, as_published, carries, law_of_water, published
from results.swept_series import SweptSeries, named, swept_series
from results.tables import Table, shown

#: Fields over which the mean thrust is asked for.
FREQUENCY, LENGTH, WIDTH = "experiment.frequency", "specimen.load_fin.length", "specimen.load_fin.width"
SWEPT = (FREQUENCY, LENGTH, WIDTH, "specimen.load_fin.mass", "experiment.pressure", "experiment.duty")
#: More series than this over one field are lines of a map.
_LONG = 4
#: Fewer lengths of the load fin than this are no map.
_COLUMNS = 3
_RUN = {
    "thrust_max": 1.0, "thrust_min": 1.0, "thrust_mean": 1.0, "buckling_max": 180 / math.pi,
    "buckling_min": 180 / math.pi, "tip_speed_max": 1e3, "swim_speed": 1e3,
}  # fmt: skip
_RUN_HEADER = (
    "thrust: max [N]", "min [N]", "mean [N]", "buckling: power [deg]", "recovery [deg]", "tip speed, max [mm/s]",
    "swims [mm/s]", "because",
)  # fmt: skip
_RUNS = (
    "thrust of the whole device over whole cycles after the warm-up; buckling: largest angle of the fin's distal part "
    "against its proximal one under the load of the power stroke, and of the recovery stroke; the dissertation's "
    "model: 4.5.3, whose masses, lengths and springs are not published; water: plate is the law of 4.5.3, others are "
    "MuJoCo's own or none, with numbers that a fit, if any, has searched under its own model's law"
)
_SIGNS = (
    "mean thrust of whole cycles; changes sign: on a straight line between neighbours; a dash: nowhere in this range; "
    "best: the largest mean, at its place"
)
_PLATE = (
    "eq. 4.3 at most, rho u^2 A of both fins, each as a plate that moves across itself with one speed: the chord of "
    "the fin's arc by its length, and the load fin's assumed size; needed: the speed at which that is the peak thrust; "
    "mean and largest speed of ours are of the tip over each stroke, the text's are means from a video"
)


def paddle_tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """All tables about paddling; some may be without a line."""
    mine = [entry for entry in entries if isinstance(entry.experiment, PaddleThrust)]
    if not mine:
        return
    series = {path: swept_series(mine, path) for path in SWEPT}
    inside = {id(p.entry) for found in series.values() for one in found for p in one.points}
    plain = [e for e in mine if id(e) not in inside or as_published(e)]
    yield _runs(plain)
    plain_ones = [one for found in series.values() for one in singled_out(found)]
    yield sign_table(plain_ones)
    for one in plain_ones:
        yield _series(one)
    crossed = [one for found in series.values() for one in found if one not in plain_ones]
    yield replace(sign_table(crossed), title="where the mean thrust changes sign, crossed sweeps", detail=True)
    yield from _maps([one for one in series[FREQUENCY] if len(series[FREQUENCY]) > _LONG])
    yield plate_table([entry for entry in plain if law_of_water(entry) == PLATE])


def singled_out(found: Sequence[SweptSeries]) -> list[SweptSeries]:
    """Series over one field that are lines of their own: all where they are few, else those through the published case.

    The others are lines of a map.
    """
    if len(found) <= _LONG:
        return list(found)
    return [one for one in found if any(as_published(point.entry) for point in one.points)]


def _runs(entries: Sequence[Entry]) -> Table:
    lines: list[tuple[str, ...]] = []
    for load_fin, case in CASES.items():
        told = [("lab", "lab", "-", LAB), ("dissertation's model", "prb", PLATE, DISSERTATION)]
        for who, origin, water, of in told:
            cells = (shown(published(of, load_fin, name) * factor, "") for name, factor in _RUN.items())
            lines.append((case, who, origin, water, "fixed", "1 Hz", *cells, ""))
        for entry in entries:
            if carries(entry) is load_fin:
                experiment = entry.experiment
                assert isinstance(experiment, PaddleThrust)
                about = (
                    entry.performer,
                    _origin(entry),
                    law_of_water(entry),
                    experiment.body,
                    f"{experiment.frequency:g} Hz",
                )
                lines.append((case, *about, *_cells(entry)))
    header = ("device", "by", "origin", "water", "body", "frequency", *_RUN_HEADER)
    return Table("thrust and swimming", header, tuple(lines), (_RUNS,))


def _origin(entry: Entry) -> str:
    return f"{entry.record.origin}, fitted" if entry.seen is not None else entry.record.origin


def _cells(entry: Entry) -> tuple[str, ...]:
    numbers, record = entry.scalars(), entry.record
    values = (numbers[name].value * factor if name in numbers else math.nan for name, factor in _RUN.items())
    return (*(shown(value, "") for value in values), "" if record.completed else f"{record.status}: {record.reason}")


def _series(series: SweptSeries) -> Table:
    lines = tuple((series.told(point.value), *_cells(point.entry)) for point in series.points)
    return Table(f"thrust {series.title}", (series.name, *_RUN_HEADER), lines, detail=True)


def sign_table(series: Sequence[SweptSeries]) -> Table:
    """Where the mean thrust changes sign over whatever is swept."""
    lines = []
    for one in series:
        means = one.results("thrust_mean")
        known = np.isfinite(means)
        if known.sum() < 2:
            continue
        # Between points a few digits are all that is known.
        places = [one.told(float(f"{value:.3g}")) for value in sign_changes(one.values, means)]
        values, found = one.values[known], means[known]
        best = int(np.argmax(found))
        lines.append(
            (
                one.name, one.label or "-", one.performer, f"{one.told(values[0])} to {one.told(values[-1])}",
                shown(found[0], ""), shown(found[-1], ""), ", ".join(places) or "-",
                f"{shown(found[best], '')} at {one.told(values[best])}",
            )
        )  # fmt: skip
    header = ("over", "held", "by", "range", "first [N]", "last [N]", "changes sign at", "best [N]")
    return Table("where the mean thrust changes sign", header, tuple(lines), (_SIGNS,))


def _maps(found: Sequence[SweptSeries]) -> Iterator[Table]:
    """Mean thrust over the frequency, a column for every size of the load fin; by performer and other fields alike."""
    groups: dict[str, list[SweptSeries]] = {}
    for one in found:
        if one.bench.fields.get(LENGTH) is not None:
            rest = ", ".join(part for part in one.label.split(", ") if not part.startswith(f"{named(LENGTH)} "))
            groups.setdefault(f"{one.performer}{f', {rest}' if rest else ''}", []).append(one)
    for words, unordered in groups.items():
        if len(unordered) < _COLUMNS:
            continue
        members = sorted(unordered, key=lambda one: float(one.bench.fields[LENGTH]))
        values = sorted({round(float(v), 9) for one in members for v in one.values})
        lines = []
        for value in values:
            cells = []
            for one in members:
                near = np.flatnonzero(np.isclose(one.values, value, rtol=1e-6))
                cells.append(shown(float(one.results("thrust_mean")[near[0]]), "") if len(near) else "-")
            lines.append((members[0].told(value), *cells))
        header = ("frequency", *(_size(one, one.bench.fields[LENGTH]) for one in members))
        title = f"mean thrust [N] over frequency and load-fin length by {words}"
        yield Table(title, header, tuple(lines), detail=True)


def _size(series: SweptSeries, size: float) -> str:
    quantity = series.bench.quantity(LENGTH)
    return quantity.show(size) if quantity else f"{size:g}"


def plate_table(entries: Sequence[Entry]) -> Table:
    """Reported tip speeds put into the plate law, and the speeds that the thrust needs."""
    lines: list[tuple[str, ...]] = []
    devices = {load_fin: _device(entries, load_fin) for load_fin in CASES}
    for load_fin, case in CASES.items():
        if (device := devices[load_fin]) is None:
            continue
        law = PlateLaw.of(device)
        for stroke, peak in (("power", "thrust_max"), ("recovery", "thrust_min")):
            mean = f"tip_speed_mean_{stroke}"
            speed, thrust = published(LAB, load_fin, mean), published(LAB, load_fin, peak)
            lines.append((case, stroke, "lab", *_plate_cells(law, speed, math.nan, thrust)))
            for entry in entries:
                if carries(entry) is load_fin and getattr(entry.experiment, "body", "") == "fixed":
                    numbers = entry.scalars()
                    if mean in numbers:
                        own = (numbers[mean].value, numbers["tip_speed_max"].value, numbers[peak].value)
                        mine = PlateLaw.of(_tested(entry))
                        lines.append((case, stroke, f"{entry.performer} ({_origin(entry)})", *_plate_cells(mine, *own)))
    header = (
        "device", "stroke", "by", "mean tip speed [mm/s]", "largest [mm/s]", "Re of the mean",
        "plate law at the mean [N]", "at the largest [N]", "peak thrust [N]", "speed needed [mm/s]", "needed over mean",
    )  # fmt: skip
    return Table("tip speeds and the plate law", header, tuple(lines), (_PLATE,))


def _tested(entry: Entry) -> FinnedTube:
    device = entry.tested()
    assert isinstance(device, FinnedTube)
    return device


def _device(entries: Sequence[Entry], load_fin: bool) -> FinnedTube | None:
    return next((_tested(entry) for entry in entries if carries(entry) is load_fin), None)


def _plate_cells(law: PlateLaw, mean: float, largest: float, thrust: float) -> tuple[str, ...]:
    needed = law.speed(thrust)
    return (
        shown(1e3 * mean, ""), shown(1e3 * largest, ""), shown(law.reynolds(mean), ""), shown(law.force(mean), ""),
        shown(law.force(largest), ""), shown(thrust, ""), shown(1e3 * needed, ""), shown(needed / mean, ""),
    )  # fmt: skip
