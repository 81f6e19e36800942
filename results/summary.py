"""One line per model: how far it is from a reference, in and out of sample, where most, and what it costs."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from lab.pinching import axis_difference
from results.accuracy import AXES, HELD_OUT, IN_SAMPLE, NOT_FITTED, Row
from results.slugs import short
from results.tables import Table

#: What a reader needs to know about the numbers of the table.
NOTE = (
    "errors: tracking error in % (norm of the difference over the norm of the reference's motion) and eq. 5.13 in mm "
    "(root mean square distance of markers), of both the root mean square over the samples; (n) samples; in sample: "
    "the fit behind the model has seen them; not fitted: nothing was fitted; as one: tracking error of all samples put "
    "together as one motion, so that the large motions count most; largest: the worst tracking error, and the swept "
    "values of its sample"
)
_ON_THE_CLAMP = "a shaken beam's motion is that relative to its clamp, over one steady period"
#: Names up to this length are symbols, as ``k_yy``; longer ones are words.
_SYMBOL = 4
_HEADER = ("model", "origin", "in sample", "held out", "not fitted", "as one", "largest", "10 s take [s]", "speed-up")


def summary(title: str, groups: Sequence[Sequence[Row]]) -> Table:
    """Models down, kinds of error across.

    Parameters
    ----------
    groups
        Rows of motions against a reference each, as from ``results.accuracy.against_record``.
    """
    lines = []
    for rows in groups:
        for model in dict.fromkeys(row.model for row in rows):
            mine = [row for row in rows if row.model == model]
            seconds = _median(mine, "seconds_per_10_s")
            # The published rows have their time in the row itself.
            shown = seconds if math.isfinite(seconds) else _median(mine, "tracking_error", "wall_time_s")
            lines.append(
                (
                    model, mine[0].origin, *(_errors(mine, use) for use in (IN_SAMPLE, HELD_OUT, NOT_FITTED)),
                    _as_one(mine), _largest(mine), _text(shown), _text(_median(mine, "speed_up")),
                )
            )  # fmt: skip
    shaken = any(row.experiment == "BaseShake" for rows in groups for row in rows)
    return Table(title, _HEADER, tuple(lines), (NOTE, _ON_THE_CLAMP) if shaken else (NOTE,))


def told_once(tables: Sequence[Table]) -> list[Table]:
    """The tables, each note under the first one alone that has it."""
    told: set[str] = set()
    found = []
    for table in tables:
        found.append(replace(table, notes=tuple(note for note in table.notes if note not in told)))
        told.update(table.notes)
    return found


def errors_by_quantity(
    title: str, rows: Sequence[Row], of_largest: bool | Collection[str] = False, by_use: bool = False
) -> Table:
    """Models down, quantities across: errors over all samples, and where they are largest; of axes in deg.

    Parameters
    ----------
    rows
        Numbers of one campaign against one reference.
    of_largest
        Differences as shares of the quantity's largest reference value of all samples, for quantities that vanish
        in some; else of each sample's own.  Names: for these quantities alone.
    by_use
        A line for samples that the fit behind a model has seen, and one for those that it has not.
    """
    names = list(dict.fromkeys(row.quantity for row in rows))
    largest = (names if of_largest else ()) if isinstance(of_largest, bool) else of_largest
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.model, row.use if by_use else ""), []).append(row)
    lines = []
    for (model, use), mine in groups.items():
        cells = [_differences([row for row in mine if row.quantity == name], name in largest) for name in names]
        about = (use, str(len({row.sample for row in mine}))) if by_use else ()
        lines.append((model, mine[0].origin, *about, *cells))
    share = "of the largest reference value" if of_largest is True else "of the reference"
    note = (
        f"difference in % {share}: root mean square over the samples, and the largest with the swept values of its "
        "sample"
    )
    if any(name in AXES for name in names):
        note += "; of axes in deg"
    if some := [name for name in names if name in largest and of_largest is not True]:
        note += f"; of {', '.join(some)} in % of the largest reference value"
    header = ("model", "origin", *(("use", "samples") if by_use else ()), *map(_headed, names))
    return Table(f"Errors: {title}", header, tuple(lines), (note,))


def _headed(name: str) -> str:
    words = name.replace("_", " ") if len(name) > _SYMBOL else name
    return f"{words} [deg]" if name in AXES else words


def _differences(rows: Sequence[Row], of_largest: bool) -> str:
    if rows and rows[0].quantity in AXES:
        turned = ((math.degrees(axis_difference(row.value, row.reference_value)), row.sample) for row in rows)
        return _worst([(angle, sample) for angle, sample in turned if math.isfinite(angle)])
    largest = max((abs(row.reference_value) for row in rows if math.isfinite(row.reference_value)), default=0.0)
    known = [
        (100.0 * (row.value - row.reference_value) / unit, row.sample)
        for row in rows
        if math.isfinite(row.value - row.reference_value)
        and (unit := largest if of_largest else abs(row.reference_value))
    ]
    return _worst(known)


def _worst(known: Sequence[tuple[float, str]]) -> str:
    """Root mean square of errors, and the largest with its sample."""
    if not known:
        return "-"
    worst, sample = max(known, key=lambda pair: abs(pair[0]))
    mean = _digits(_rms(np.array([error for error, _ in known])))
    return mean if len(known) == 1 else f"{mean} ({_digits(worst, '+')} at {short(sample)})"


def _digits(value: float, sign: str = "") -> str:
    """Two digits, without an exponent for large numbers."""
    return f"{value:{sign}.0f}" if abs(value) >= 10.0 else f"{value:{sign}.2g}"


def _as_one(rows: Sequence[Row]) -> str:
    """Norm of all differences over the norm of all motions of the reference, of several samples."""
    shares = {row.sample: row.value for row in rows if row.quantity == "tracking_error" and row.value > 0.0}
    distances = {row.sample: row.value for row in rows if row.quantity == "tracking_rms" and row.sample in shares}
    if len(distances) < 2:
        return ""
    sizes = np.array([distance / shares[sample] for sample, distance in distances.items()])
    return f"{100 * _rms(np.array(list(distances.values()))) / _rms(sizes):.3g} %"


def _largest(rows: Sequence[Row]) -> str:
    """The worst of several samples."""
    known = [row for row in rows if row.quantity == "tracking_error" and math.isfinite(row.value)]
    if len(known) < 2:
        return ""
    worst = max(known, key=lambda row: row.value)
    return f"{100 * worst.value:.3g} % at {short(worst.sample)}"


def _errors(rows: Sequence[Row], use: str) -> str:
    chosen = [row for row in rows if row.use == use]
    shares = _values(chosen, "tracking_error")
    failed = sum(row.quantity == "tracking_error" and math.isnan(row.value) for row in chosen)
    if not len(shares):
        return f"- ({failed} without a result)" if failed else ""
    distances = _values(chosen, "tracking_rms")
    millimetres = f", {1e3 * _rms(distances):.3g} mm" if len(distances) else ""
    holes = f"; {failed} without a result" if failed else ""
    return f"{100 * _rms(shares):.3g} %{millimetres} ({len(shares)}{holes})"


def _values(rows: Sequence[Row], quantity: str, column: str = "value") -> np.ndarray:
    values = np.array([getattr(row, column) for row in rows if row.quantity == quantity], dtype=float)
    return values[np.isfinite(values)]


def _median(rows: Sequence[Row], quantity: str, column: str = "value") -> float:
    values = _values(rows, quantity, column)
    return float(np.median(values)) if len(values) else math.nan


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _text(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else ""
