"""Accuracy rows: every number of a performer beside its reference, one row per number."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

from pydantic import TypeAdapter

from lab.experiments import Experiment, PaddleThrust
from lab.measures import relative_error, tracking_error, tracking_rms
from lab.published import figures
from lab.records import Record, Scalar
from lab.specimens import Specimen

#: Whether a number was seen by the fit behind its model.
IN_SAMPLE, HELD_OUT, NOT_FITTED = "in sample", "held out", "not fitted"

#: Lines across a tube, which are the same after half a turn, and angles between two of them.
AXES = (
    "deformation_axis", "hinge_axis", "turn_axis", "deformation_axis_error", "hinge_axis_error",
)  # fmt: skip
#: Numbers whose difference is no share of anything: a direction, and a sign.
_WITHOUT_SHARE = ("tilt", "sense", *AXES)

#: A record that a fit has seen: campaign, performer or lab table that made it, sample (slug).
Seen = tuple[str, str, str]


@dataclass(frozen=True)
class Entry:
    """A record with its place in the study.

    Parameters
    ----------
    campaign, performer, slug, specimen
        Names in the study; the slug holds the swept values.
    experiment
        The experiment, which knows how to reduce the record.
    path
        Record file.
    seen
        What the fit behind the performer was given, directly or through the fit behind what it was fitted to; None
        where nothing is fitted.
    """

    campaign: str
    performer: str
    slug: str
    specimen: str
    experiment: Experiment
    record: Record
    path: str
    seen: frozenset[Seen] | None = None

    def scalars(self) -> dict[str, Scalar]:
        """Reduced numbers; empty unless the record completed."""
        return self.experiment.reduce(self.record) if self.record.completed else {}

    def tested(self) -> Specimen:
        """The specimen that the record tells, with what a fit may have changed."""
        return TypeAdapter(Specimen).validate_python(dict(self.record.specimen))


@dataclass(frozen=True)
class Row:
    """One number, as a line of ``accuracy.csv``; SI units, NaN where a number does not exist."""

    campaign: str
    specimen: str
    sample: str
    experiment: str
    quantity: str
    unit: str
    origin: str
    model: str
    value: float
    reference: str
    reference_origin: str
    reference_value: float
    relative_error: float
    use: str
    wall_time_s: float
    note: str = ""


HEADER = tuple(field.name for field in fields(Row))


def as_cells(row: Row) -> tuple[object, ...]:
    """The row's cells, NaN as an empty cell."""
    cells = (getattr(row, name) for name in HEADER)
    return tuple("" if isinstance(cell, float) and math.isnan(cell) else cell for cell in cells)


def use_of(entry: Entry, reference: str) -> str:
    """Whether the entry's fit has seen its sample of this reference."""
    if entry.seen is None:
        return NOT_FITTED
    return IN_SAMPLE if (entry.campaign, reference, entry.slug) in entry.seen else HELD_OUT


def against_scalars(
    entry: Entry,
    names: Sequence[tuple[str, str]],
    reference: str,
    origin: str,
    values: Mapping[str, Scalar],
    label: str,
) -> Iterator[Row]:
    """Rows of the quantities ``names`` (name, unit) of an entry against reference numbers.

    A model that cannot do the experiment gets rows without a value, with the reason as note.
    """
    reduced = entry.scalars()
    for name, unit in names:
        value = reduced[name].value if name in reduced else math.nan
        reference_value = values[name].value if name in values else math.nan
        error = math.nan if name in _WITHOUT_SHARE else relative_error(value, reference_value)
        yield _row(entry, label, name, unit, value, reference, origin, reference_value, error)


def against_record(entry: Entry, other: Entry) -> Iterator[Row]:
    """Rows of a record against another performer's of the same sample.

    The main numbers; of a motion also the tracking error of its markers, the time for 10 s and the speed-up.
    """
    reference, origin = other.performer, other.record.origin
    if entry.experiment.in_motion and not isinstance(entry.experiment, PaddleThrust):
        error, distance = tracking(entry, other)
        yield _row(entry, entry.slug, "tracking_error", "1", error, reference, origin, 0.0, error)
        yield _row(entry, entry.slug, "tracking_rms", "m", distance, reference, origin, 0.0, math.nan)
    numbers = other.scalars()
    names = [(name, scalar.unit) for name, scalar in (numbers or entry.scalars()).items()]
    yield from against_scalars(entry, names, reference, origin, numbers, entry.slug)
    if entry.experiment.in_motion:
        times = seconds_per_10_s(entry.record), seconds_per_10_s(other.record)
        yield _row(entry, entry.slug, "seconds_per_10_s", "s", times[0], reference, origin, times[1], math.nan)
        if entry.record.origin == "prb" and origin != "prb":
            ratio = times[1] / times[0]
            yield _row(entry, entry.slug, "speed_up", "1", ratio, reference, origin, 1.0, math.nan)


def tracking(entry: Entry, other: Entry) -> tuple[float, float]:
    """Tracking error (a fraction) and eq. 5.13 (m) of a motion against another; NaN unless both have a result."""
    if not (entry.record.completed and other.record.completed):
        return math.nan, math.nan
    ours, theirs = entry.record["markers"], other.record["markers"]
    return tracking_error(ours, theirs), tracking_rms(ours, theirs)


def seconds_per_10_s(record: Record) -> float:
    """Wall time that 10 s of motion take, s; NaN for what is measured or has no time.

    Performers that time the motion alone say so themselves; else it is the wall time of the whole run over
    the time that it simulated.
    """
    if "seconds_per_10_s" in record.how:
        return float(record.how["seconds_per_10_s"])
    if not record.completed or "time" not in record.channels or "wall_time_s" not in record.how:
        return math.nan
    simulated = float(record.how.get("simulated_s", record["time"][-1] - record["time"][0]))
    return _wall_time(record) * 10.0 / simulated


def _row(
    entry: Entry, label: str, name: str, unit: str, value: float, reference: str, origin: str, of: float, error: float
) -> Row:
    record = entry.record
    return Row(
        entry.campaign, entry.specimen, label, entry.experiment.kind, name, unit, record.origin, entry.performer, value,
        reference, origin, of, error, use_of(entry, reference), _wall_time(record), record.reason,
    )  # fmt: skip


def _wall_time(record: Record) -> float:
    return float(record.how.get("wall_time_s", math.nan))


def published_ring_down() -> list[Row]:
    """What the dissertation itself reports of its two models (5.4.2), for comparison of kinds, not of numbers."""
    known = figures()
    cases = (("fea", "c5-fea-error", "c5-fea-time", NOT_FITTED), ("prb", "c5-prb-error", "c5-prb-time", IN_SAMPLE))
    note = "published; the recording and the definition of the percentage are not; time for 10 s simulated"
    return [
        Row(
            "published", "dissertation beam", "not published", "RingDown", "tracking_error", "1", origin,
            f"dissertation-{origin}", known[error]["value"] / 100, "dissertation-lab", "lab", 0.0,
            known[error]["value"] / 100, use, known[time]["value"], note,
        )
        for origin, error, time, use in cases
    ]  # fmt: skip


def holes(entries: Iterable[Entry]) -> list[Entry]:
    """Entries whose sample diverged or failed."""
    return [entry for entry in entries if entry.record.status in ("diverged", "failed")]
