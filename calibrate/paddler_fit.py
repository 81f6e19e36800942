"""Fit of kind ``paddler``: a fin from finite elements, and what the published thrust says about the rest.

Four published peaks and two means are followed by many free numbers.  A good fit is therefore no evidence for its
numbers: the result says which combinations of them the thrust sees, and what other sets, as good, have in common.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibrate.fin_data import FinDatum, learn_fin
from calibrate.objective import Problem
from calibrate.paddler_scores import fin_table, score_of, speeds_table
from calibrate.paddler_sets import Directions, Sets, correlated, directions_of, in_words, sets_as_good
from calibrate.paddler_targets import CASES, devices, thrust_problem, thrust_targets
from calibrate.performers import performer_of
from calibrate.result import plain
from calibrate.search import find
from calibrate.spec import PaddlerFit
from lab.experiments import PaddleThrust
from lab.specimens import FinnedTube
from prb.model import PrbModel
from prb.paddler import is_paddler, paddler_of, stroke_of
from prb.water import paddle_in

__all__ = ["FinDatum", "fit_paddler"]

Array = NDArray[np.float64]
#: Parameters that learned curves take the place of.
_LEARNED = {
    "turn": ("rest_angle", "sweep"),
    "opposite": ("opposite", "opposite_limit", "opposite_beyond"),
    "equal": ("equal", "equal_limit", "equal_beyond"),
}
#: Cycles of a swimming body that do not count, and that do.
_SWIM = PaddleThrust(body="free", cycles=12, warm_up=8)
#: Share of a coordinate in what is seen above which it counts as pinned down, and below which as open.
_PINNED, _OPEN = 0.8, 0.2
_HELD = PaddleThrust(cycles=3, warm_up=1)


@dataclass(frozen=True)
class Behaviour:
    """What a set does in both cases: peaks and mean of thrust (N), extreme buckling (rad), speeds (m/s)."""

    thrust: Array
    buckling: Array
    tip_speed: Array
    swim_speed: Array


def fit_paddler(
    spec: PaddlerFit, model: PrbModel, data: Sequence[FinDatum], specimen: FinnedTube | None, threads: int = 1
) -> dict[str, Any]:
    """Curves of the fin, the best set of free numbers, and what is known of them, as plain JSON data.

    Parameters
    ----------
    model
        PRB performer with the topology ``paddler``.
    data
        Records, used and held out.
    specimen
        The device whose thrust is followed; None without free numbers.

    Returns
    -------
    result
        ``fin`` (see ``prb.fin_curves.FinCurves``) or None, ``parameters``, ``scores`` of the records, ``sets`` (values
        in the order of the parameters, SI) and ``directions`` in the unit cube, ``tables``, ``notes``.

    Raises
    ------
    ValueError
        In one line: nothing to learn from, or numbers that cannot be searched.
    """
    begin = perf_counter()
    if not is_paddler(model.topology):
        raise ValueError(f"topology {model.topology.name} does not paddle; a fit of kind paddler needs paddler")
    used = [item for item in data if item.used]
    notes: list[str] = []
    tables: list[dict[str, Any]] = []
    scores: list[dict[str, Any]] = []
    if used:
        values = model.values(used[0].specimen)
        curves = learn_fin(used, values["hinge_share"], values["widening"])
        model = model.model_copy(update={"fin": curves})
        scores = [score_of(curves, item, values["hinge_share"]) for item in data]
        tables.append(fin_table(curves, scores))
        notes.append(f"The fin was learned from {', '.join(item.label for item in used)}; nothing is searched for it.")
        if len(used) == len(data):
            notes.append("Nothing is held out of the fin: all its errors are in sample.")
    result: dict[str, Any] = {
        "kind": spec.kind, "fin": model.fin.model_dump(mode="json") if model.fin else None, "parameters": [],
        "scores": scores, "sets": [], "directions": [], "used": [item.label for item in used],
    }  # fmt: skip
    if spec.free:
        assert specimen is not None
        _check_free(spec, model)
        found, told, more = _searched(spec, model, specimen, threads)
        result |= found
        tables += told
        notes += more
    if specimen is not None:
        tables.append(speeds_table(specimen))
    return plain({**result, "tables": tables, "notes": notes, "wall_time_s": perf_counter() - begin})


def _check_free(spec: PaddlerFit, model: PrbModel) -> None:
    if model.fin is None:
        return
    given = [name for curve, names in _LEARNED.items() if getattr(model.fin, curve) for name in names]
    if twice := [name for name in ("widening", *given) if name in spec.free]:
        raise ValueError(f"free: {', '.join(twice)} cannot be searched, since the fin's records give it")


def _searched(
    spec: PaddlerFit, model: PrbModel, specimen: FinnedTube, threads: int
) -> tuple[dict[str, Any], list[dict[str, Any]], list[str]]:
    """What was found as plain data, tables and sentences."""
    targets = thrust_targets(specimen, spec.follows)
    problem = thrust_problem(
        targets, spec.free, performer_of(model, threads), buckles=spec.buckles, mean_weight=spec.mean_weight
    )
    found = find(problem, spec.search)
    sets = sets_as_good(problem, found.unit, found.residual, spec.sets, spec.tolerance, spec.search.seed)
    seen = directions_of(problem.derivative(sets.units[0]))
    values = problem.space.values(sets.units)
    behave = [behaviour(model, specimen, dict(zip(problem.space.names, row.tolist(), strict=True))) for row in values]
    parameters = [
        {
            "name": c.name, "unit": c.unit, "lower": c.lower, "upper": c.upper, "value": float(values[0, i]),
            # So few figures give no interval; sets that are as good give a range.
            "standard_error": None, "interval": [None, None],
            "among_sets": [float(values[:, i].min()), float(values[:, i].max())],
            "seen": float(seen.seen[i]), "spread": float(sets.spread()[i]),
        }
        for i, c in enumerate(problem.space.coordinates)
    ]  # fmt: skip
    told = {
        "parameters": parameters, "objective": float(sets.objectives[0]), "objective_unit": "1",
        "history": list(found.history), "evaluations": problem.evaluations, "seed": spec.search.seed,
        "sets": [
            {"values": _short(row), "objective": float(size), "thrust": _short(b.thrust),
             "buckling": _short(b.buckling), "tip_speed": _short(b.tip_speed), "swim_speed": _short(b.swim_speed)}
            for row, size, b in zip(values, sets.objectives, behave, strict=True)
        ],
        "directions": [
            {"size": float(size), "direction": _short(row)}
            for size, row in zip(seen.sizes, seen.directions, strict=True)
        ],
    }  # fmt: skip
    tables = [
        _thrust_table(spec, specimen, behave[0]), _numbers_table(problem, values, seen, sets),
        _directions_table(problem, seen), _sets_table(behave, sets),
    ]  # fmt: skip
    return told, tables, _sentences(spec, problem, seen, sets, behave)


def _short(values: Array) -> Any:
    """Nested lists of six digits: many sets go into one attribute of a file."""
    return np.vectorize(lambda value: float(f"{value:.6g}"))(values).tolist()


def behaviour(model: PrbModel, specimen: FinnedTube, values: dict[str, float]) -> Behaviour:
    """What the model does with ``values`` in place of its own, without and with load fin."""
    thrust, buckling, tip, swim = [], [], [], []
    for device in devices(specimen):
        paddler = paddler_of(device, {**model.values(device), **values}, model.fin)
        held, free = (paddle_in(model.water, paddler, stroke_of(e), model.time_step) for e in (_HELD, _SWIM))
        counts = held["time"] >= _HELD.warm_up / _HELD.frequency
        shown = held.sensed[counts]
        mean = float(np.trapezoid(shown, held["time"][counts])) / float(np.ptp(held["time"][counts]))
        thrust.append([shown.max(), shown.min(), mean])
        buckling.append([held["buckling"][counts].min(), held["buckling"][counts].max()])
        tip.append(held.tip_speed[counts].max())
        way = np.interp([_SWIM.warm_up, _SWIM.cycles], free["time"] * _SWIM.frequency, free["body"])
        swim.append(float(np.diff(way)[0]) * _SWIM.frequency / (_SWIM.cycles - _SWIM.warm_up))
    return Behaviour(np.array(thrust), np.array(buckling), np.array(tip), np.array(swim))


def _thrust_table(spec: PaddlerFit, specimen: FinnedTube, behave: Behaviour) -> dict[str, Any]:
    rows = []
    for case, target, found, angle in zip(
        CASES, thrust_targets(specimen, spec.follows), behave.thrust, behave.buckling, strict=True
    ):
        wanted = [target.record.scalars.get(name) for name in ("thrust_max", "thrust_min", "thrust_mean")]
        pairs = [f"{v:.3g} ({w.value:g})" if w else f"{v:.3g} (-)" for v, w in zip(found, wanted, strict=True)]
        rows.append([case, *pairs, f"{np.rad2deg(angle[0]):.1f}", f"{np.rad2deg(angle[1]):.1f}"])
    header = ["case", "peak [N]", "least [N]", "mean [N]", "buckling in recovery [deg]", "in power stroke [deg]"]
    return {"title": f"thrust of the best set (published {spec.follows})", "header": header, "rows": rows, "notes": []}


def _numbers_table(problem: Problem, values: Array, seen: Directions, sets: Sets) -> dict[str, Any]:
    rows = []
    for i, c in enumerate(problem.space.coordinates):
        ends = f"{c.show(float(values[:, i].min()))} to {c.show(float(values[:, i].max()))}"
        rows.append([c.name, c.show(float(values[0, i])), ends, f"{100 * sets.spread()[i]:.0f}", f"{seen.seen[i]:.2f}"])
    header = ["number", "best set", "among sets as good", "of its box [%]", "seen by the thrust"]
    note = "seen: share of the number in the directions that peaks and means react to at the best set (1: all of it)"
    return {"title": "free numbers", "header": header, "rows": rows, "notes": [note]}


def _directions_table(problem: Problem, seen: Directions) -> dict[str, Any]:
    rows = [
        [str(k + 1), f"{size:.3g}", in_words(problem.space, row)]
        for k, (size, row) in enumerate(zip(seen.sizes, seen.directions, strict=True))
    ]
    header = ["direction", "residual per box", "numbers with their shares"]
    note = "numbers searched on a logarithmic scale move by powers; what is across all these directions moves nothing"
    return {"title": "combinations that the thrust sees", "header": header, "rows": rows, "notes": [note]}


def _sets_table(behave: Sequence[Behaviour], sets: Sets) -> dict[str, Any]:
    rows = []
    for size, b in zip(sets.objectives, behave, strict=True):
        angle = np.rad2deg(b.buckling[:, 0])
        cells = [100 * size, *angle, *(100 * b.tip_speed), *(1e3 * b.swim_speed)]
        rows.append([f"{cell:.3g}" for cell in cells])
    header = ["misfit [%]", "buckling, bare [deg]", "with load fin [deg]", "tip, bare [cm/s]", "with load fin [cm/s]",
              "swims, bare [mm/s]", "with load fin [mm/s]"]  # fmt: skip
    return {"title": "sets that are as good", "header": header, "rows": rows, "notes": []}


def _sentences(
    spec: PaddlerFit, problem: Problem, seen: Directions, sets: Sets, behave: Sequence[Behaviour]
) -> list[str]:
    names, count, objective = problem.space.names, len(problem.space), float(sets.objectives[0])
    pinned = [names[i] for i in np.argsort(-seen.seen) if seen.seen[i] >= _PINNED]
    open_ = [names[i] for i in np.argsort(seen.seen) if seen.seen[i] <= _OPEN]
    found = [
        f"{count} free numbers follow {problem.size} published ones with a misfit of {objective:.2%} (rms over the "
        f"largest thrust): a match proves nothing by itself.",
        f"The thrust sees {seen.rank} directions of {count}. Alone pinned down: {', '.join(pinned) or 'no number'}; "
        f"left open: {', '.join(open_) or 'none'}.",
    ]
    if sets.tried and len(sets.units) == 1:
        found.append(f"None of {sets.tried} further searches ends at a set with a misfit below {spec.tolerance:.1%}.")
    if len(sets.units) > 1:
        bare, loaded = (np.rad2deg([b.buckling[case, 0] for b in behave]) for case in (0, 1))
        swim = 1e3 * np.array([b.swim_speed[1] for b in behave])
        found.append(
            f"{len(sets.units) - 1} of {sets.tried} further searches end at sets as good (misfit below "
            f"{spec.tolerance:.1%}). Among them the fin buckles in recovery by {-loaded.max():.3g} to "
            f"{-loaded.min():.3g} deg with the load fin and {-bare.max():.3g} to {-bare.min():.3g} deg without, and "
            f"the loaded device swims at {swim.min():.3g} to {swim.max():.3g} mm/s."
        )
        pairs = correlated(sets.units, names)[:6]
        if pairs:
            told = ", ".join(f"{a} with {b} ({r:+.2f})" for a, b, r in pairs)
            found.append(f"Numbers that make up for one another among these sets (rank correlation): {told}.")
    return found
