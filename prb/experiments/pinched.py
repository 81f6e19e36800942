"""Pinching and bending a tube as a hinge whose numbers were learned (``prb.hinge_curves``)."""

from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np

from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.experiments.pinch_drive import PinchDrive
from lab.records import Record
from lab.specimens import PinchedTube, Specimen
from prb.experiments.common import heading
from prb.experiments.pinched_record import pinched_record
from prb.model import PrbModel
from prb.statics import Chain, NotConverged
from prb.tube_statics import Bent, Point, bear, push
from prb.tube_walk import Row, Walk

_UNFITTED = "how a pinched tube bends must be learned first: give this performer a fit of kind hinge"


def pinch(specimen: Specimen, experiment: Pinch, model: PrbModel) -> Record:
    """Pinch until the closing that the fit has seen; channels as ``lab.experiments.Pinch`` says.

    Not of this model: ``shortening`` of single tendons, and how the pinch alone tilts or shifts the free block.
    ``section`` is the ellipse of the learned flattening that has the open tube's perimeter.
    """
    head = heading(specimen, experiment, model)
    if reason := _refusal(specimen, experiment, model):
        return Record(**head, status="unsupported", reason=reason)
    begin = perf_counter()
    assert isinstance(specimen, PinchedTube)
    walk = Walk(specimen, experiment, model)
    return pinched_record(head, walk, list(walk.unloaded()), begin)


def pinched_bending(specimen: Specimen, experiment: PinchedBending, model: PrbModel) -> Record:
    """Bend with the tendons' lengths held; channels as ``lab.experiments.PinchedBending`` says.

    The tendons feel the bend by the energy of the hinge: F_p falls by what its stiffness loses along the travel.
    """
    head = heading(specimen, experiment, model)
    if reason := _refusal(specimen, experiment, model, needed=experiment.pinched):
        return Record(**head, status="unsupported", reason=reason)
    begin = perf_counter()
    assert isinstance(specimen, PinchedTube)
    walk = Walk(specimen, experiment, model)
    rows: list[Row] = []
    try:
        for row in _bending(walk, experiment):
            rows.append(row)
    except NotConverged as failure:
        return pinched_record(head, walk, rows, begin, status="diverged", reason=str(failure))
    return pinched_record(head, walk, rows, begin)


def shape_recovery(specimen: Specimen, experiment: ShapeRecovery, model: PrbModel) -> Record:
    """Unsupported: a hinge of rigid halves keeps no memory of a shape."""
    reason = "whether the wall snaps back is decided by its shape, which rigid halves on a hinge do not have"
    return Record(**heading(specimen, experiment, model), status="unsupported", reason=reason)


def _refusal(specimen: Specimen, experiment: PinchDrive, model: PrbModel, *, needed: bool = True) -> str:
    if not isinstance(specimen, PinchedTube):
        return f"a {specimen.kind} has no pads to pinch; this needs a PinchedTube"
    curves = model.hinge
    if curves is None:
        return _UNFITTED if needed else ""
    if not needed:
        return ""
    if experiment.pair_forces is not None:
        return "pair_forces are none of the states that the hinge was fitted to; give pinch_angle"
    if (experiment.law, specimen.pairs) != (curves.law, curves.pairs):
        return (
            f"law {experiment.law!r} with {specimen.pairs} pairs: the hinge was fitted to law {curves.law!r} with "
            f"{curves.pairs}"
        )
    return curves.refusal(experiment.pinch_angle)


def _bending(walk: Walk, e: PinchedBending) -> Iterator[Row]:
    point = Point(e.place, np.array([np.cos(e.direction), np.sin(e.direction), 0.0]))
    count = e.bend_increments
    ramp = (np.arange(1, count + 1) / count).tolist()
    if e.order == "load first":
        assert e.load is not None
        yield Row("rest", 0.0, *(start := walk.at(0.0)), Bent(start[1].slack, 0.0))
        for share in ramp:
            yield Row("load", 0.0, *start, bear(start[1], point, share * e.load))
        for share in walk.shares():
            state, chain = walk.at(share)
            yield Row("pinch", share, state, chain, bear(chain, point, e.load))
        return
    share, here = 0.0, walk.at(0.0)
    if e.pinched:
        for row in walk.unloaded():
            share = row.share
            yield row
        here = walk.at(share)
    else:
        yield Row("rest", 0.0, *here, Bent(here[1].slack, 0.0))
    steps = [*ramp, *ramp[-2::-1], 0.0][: 2 * count if e.returns else count]
    for number, bent in enumerate(_loaded(here[1], point, e, steps)):
        yield Row("bend" if number < count else "return", share, *here, bent)


def _loaded(chain: Chain, point: Point, e: PinchedBending, steps: Sequence[float]) -> Iterator[Bent]:
    if e.load is not None:
        for step in steps:
            yield bear(chain, point, step * e.load)
    else:
        assert e.push is not None
        rig = 0.0 if e.rig_stiffness is None else 1.0 / e.rig_stiffness
        yield from push(chain, point, [step * e.push for step in steps], rig)
