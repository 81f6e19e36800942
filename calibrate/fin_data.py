"""Records of a fin as what a paddling model needs: how flattening turns it, and how its hinge gives way."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.bench_datum import BenchDatum
from lab.experiments import FinPush, ShapePropagation
from lab.experiments.fin_drive import FIN_STAGES
from lab.records import Record
from lab.specimens import FinnedTube
from prb.fin_curves import TERMS, FinCurves, Four, SenseCurves, two_term

Array = NDArray[np.float64]
#: x1 over the approach of top and bottom where nothing is measured: a wall that keeps its length as a stadium.
STADIUM = np.pi / 4 - 0.5
#: Where a knee may be over the largest turn, and states from which on two exponentials are fitted.
_KNEES = np.geomspace(0.01, 1.0, 60)
_TWO_TERMS = 4


@dataclass(frozen=True)
class FinDatum(BenchDatum):
    """Of a paddler's fin."""

    learner = "a paddler's fin"
    specimens = (FinnedTube,)
    experiments = (ShapePropagation, FinPush)


def learn_fin(data: Sequence[FinDatum], hinge_share: float, widening: float) -> FinCurves:
    """Curves of one device's fin.

    Parameters
    ----------
    hinge_share
        Place of the model's hinge over the fin's length.
    widening
        x1 of the flat tube (m), used where no record shows it.

    Raises
    ------
    ValueError
        In one line, for records that do not belong together or from which nothing can be learned.
    """
    for item in data[1:]:
        if _bare(item.specimen) != _bare(data[0].specimen):
            raise ValueError(
                f"{item.label} is of another specimen than {data[0].label}; a fin is learned of one device"
            )
    shapes = [item for item in data if isinstance(item.experiment, ShapePropagation)]
    errors: dict[str, float] = {}
    turn, travels = None, [(0.0, 0.0), (widening / STADIUM, widening)]
    if shapes:
        travels = _travels(shapes[0].record)
        x1 = np.concatenate([widths(item.record) for item in shapes])
        angle = np.concatenate([item.record["fin_angle"] for item in shapes])
        widening = float(x1.max())
        turn, errors["turn"] = _polynomial(x1, angle, widening)
    senses: dict[str, SenseCurves] = {}
    way, width = np.transpose(travels)
    for sense in ("opposite", "equal"):
        pushes = [i for i in data if isinstance(i.experiment, FinPush) and i.experiment.sense == sense]
        if pushes:
            at = np.interp([float(i.record["travel"][-1]) for i in pushes], way, width) / widening
            senses[sense], found = _sense(pushes, at, hinge_share)
            errors |= {f"{sense} {name}": value for name, value in found.items()}
    return FinCurves(
        widening=widening, travels=tuple(travels), turn=turn, errors=errors, specimen=_bare(data[0].specimen), **senses,
    )  # fmt: skip


def widths(record: Record) -> Array:
    """x1 (n,), m: how far the tube's sides have moved outward, from its mid-length section."""
    half = np.ptp(record["section"][:, :, 0], axis=1) / 2
    return np.asarray(half - half[0])


def spring_of(record: Record, lever: float) -> tuple[float, float, float]:
    """Stiffness (N*m/rad), limit moment (N*m) and slope beyond it over that before, of a push at ``lever`` (m)."""
    from scipy.optimize import minimize_scalar

    turn, moment = turns(record, lever)
    knees = _KNEES * turn.max()
    errors = [_two_lines(turn, moment, knee)[0] for knee in knees]
    here = int(np.argmin(errors))
    if not np.isfinite(errors[here]):
        raise ValueError("the plate's force never rises")
    ends = (knees[max(here - 1, 0)], knees[min(here + 1, len(knees) - 1)])
    knee = float(minimize_scalar(lambda k: _two_lines(turn, moment, k)[0], bounds=ends, options={"xatol": 1e-6}).x)
    _, first, share = min(_two_lines(turn, moment, k) for k in (knee, float(knees[here])))
    return first, first * knee, share


def _two_lines(turn: Array, moment: Array, knee: float) -> tuple[float, float, float]:
    """Squared error, slope up to a knee, and slope beyond over that, of two lines through the moments."""
    columns = np.column_stack([np.minimum(turn, knee), np.maximum(turn - knee, 0.0)])
    (first, beyond), *_ = np.linalg.lstsq(columns, moment, rcond=None)
    share = float(np.clip(beyond / first, 0.0, 1.0)) if first > 0 else 0.0
    shape = columns @ [1.0, share]
    first = float(moment @ shape / (shape @ shape))
    error = float(np.sum((first * shape - moment) ** 2))
    return (error if first > 0 else float("inf")), first, share


def turns(record: Record, lever: float) -> tuple[Array, Array]:
    """Turn (rad) and moment (N*m) of a hinge ``lever`` (m) before the plate, while it pushes."""
    pushing = (record["stage"] == FIN_STAGES.index("push")) & np.isfinite(record["force"])
    if pushing.sum() < 3:
        raise ValueError(f"the push has {int(pushing.sum())} states; at least 3 are needed")
    return np.arctan2(record["push"][pushing], lever), record["force"][pushing] * lever


def lever_of(specimen: FinnedTube, experiment: FinPush, hinge_share: float) -> float:
    """From the model's hinge to where the plate meets the fin, m; ValueError where it is before the hinge."""
    lever = (experiment.place - hinge_share) * specimen.fin_length
    if not lever > 0:
        raise ValueError(
            f"the plate at {experiment.place:g} of the fin does not reach beyond its hinge, {hinge_share:g}"
        )
    return lever


def exponentials(s: Array, values: Array) -> tuple[Four, float]:
    """Two-term exponential of positive ``values`` (n,) over s (n,), and its rms error over the largest value.

    One state gives a constant and two or three give one term.
    """
    if len(s) == 1 or float(np.ptp(s)) == 0.0:
        constant = float(np.mean(values))
        return (constant, 0.0, 0.0, 0.0), float(np.sqrt(np.mean((values - constant) ** 2))) / float(values.max())
    slope, start = np.polyfit(s, np.log(values), 1)
    found: Four = (float(np.exp(start)), float(slope), 0.0, 0.0)
    if len(s) >= _TWO_TERMS:
        found = min([found, *_two_terms(s, values, found)], key=lambda four: _misfit(four, s, values))
    return found, _misfit(found, s, values)


def _two_terms(s: Array, values: Array, one: Four) -> list[Four]:
    from scipy.optimize import least_squares

    def residual(four: Array) -> Array:
        return (two_term((four[0], four[1], four[2], four[3]), s) - values) / values.max()

    ends = []
    for share, rate in ((0.5, -3.0), (0.5, 3.0), (-0.3, 5.0), (0.3, -8.0)):
        start = [one[0] * (1 - share), one[1], one[0] * share, rate]
        # Rates beyond these are steps between two states that the records say nothing about.
        low, high = [-np.inf, -12.0, -np.inf, -12.0], [np.inf, 12.0, np.inf, 12.0]
        a, b, c, d = least_squares(residual, start, bounds=(low, high), max_nfev=400).x.tolist()
        if two_term((a, b, c, d), np.linspace(0.0, 1.0, 101)).min() > 0.2 * values.min():
            ends.append((a, b, c, d))
    return ends


def _misfit(four: Four, s: Array, values: Array) -> float:
    return float(np.sqrt(np.mean((two_term(four, s) - values) ** 2)) / values.max())


def _polynomial(x1: Array, angle: Array, widening: float) -> tuple[tuple[float, float, float, float, float], float]:
    degree = min(TERMS - 1, len(np.unique(x1)) - 1)
    scaled = np.polynomial.polynomial.polyfit(x1 / widening, angle, degree)
    error = np.polynomial.polynomial.polyval(x1 / widening, scaled) - angle
    c = np.zeros(TERMS)
    c[: degree + 1] = scaled / widening ** np.arange(degree + 1)
    size = max(float(np.ptp(angle)), 1e-12)
    return (float(c[0]), float(c[1]), float(c[2]), float(c[3]), float(c[4])), float(np.sqrt(np.mean(error**2))) / size


def _travels(record: Record, most: int = 41) -> list[tuple[float, float]]:
    """States at which both the approach and x1 have grown, thinned out, m."""
    travel, width = record["travel"], widths(record)
    rows = np.unique(np.linspace(0, len(travel) - 1, most).round().astype(int))
    kept = [(0.0, 0.0)]
    for row in rows:
        if travel[row] > kept[-1][0] and width[row] > kept[-1][1]:
            kept.append((float(travel[row]), float(width[row])))
    if len(kept) < 2:
        raise ValueError("the tube's sides do not move outward while it is flattened")
    return kept


def _sense(pushes: Sequence[FinDatum], at: Array, share: float) -> tuple[SenseCurves, dict[str, float]]:
    springs = []
    for item in pushes:
        try:
            springs.append(spring_of(item.record, lever_of(item.specimen, item.experiment, share)))
        except ValueError as error:
            raise ValueError(f"{item.label}: {error}") from None
    table = np.array(springs)
    stiffness, first = exponentials(at, table[:, 0])
    limit, second = exponentials(at, table[:, 1])
    curves = SenseCurves(stiffness=stiffness, limit=limit, beyond=float(table[:, 2].mean()))
    return curves, {"stiffness": first, "limit": second}


def _bare(specimen: FinnedTube) -> dict[str, Any]:
    """A device without its load fin, of which pushes and pinches know nothing."""
    return specimen.model_copy(update={"load_fin": None}).model_dump(mode="json")
