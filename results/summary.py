"""One line per model: how far it is from a reference, in and out of sample, and what it costs."""

import math
from collections.abc import Sequence

import numpy as np

from results.accuracy import HELD_OUT, IN_SAMPLE, NOT_FITTED, Row
from results.tables import Table

#: What a reader needs to know about the numbers of the table.
NOTE = (
    "errors: root mean square over the samples of the tracking error in % of the reference's motion, and of eq. 5.13 "
    "in mm; (n) samples; in sample: the fit behind the model has seen them; not fitted: nothing was fitted"
)
_HEADER = ("model", "origin", "in sample", "held out", "not fitted", "10 s take [s]", "speed-up")


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
                    _text(shown), _text(_median(mine, "speed_up")),
                )
            )  # fmt: skip
    return Table(title, _HEADER, tuple(lines), (NOTE,))


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
