"""Command ``model``: a fitted PRB as MJCF for any design, without a new run."""

import math
from collections.abc import Sequence
from pathlib import Path

from lab.units import to_si
from pipeline.designs import design
from pipeline.plan import Plan
from pipeline.stages.fit import mjcf_of
from pipeline.stages.perform import completed_result, fitted_prb
from pipeline.study import PrbPerformer, StudyError
from pipeline.suiting import check_topology, misfit
from prb.hinge_curves import HingeCurves
from results.store import write_text


def model(
    plan: Plan, performer: str, specimen: str, changes: Sequence[str], output: Path, pinch: str = "", share: float = 1.0
) -> str:
    """Write the MJCF of ``performer`` for a specimen with changed fields; return what it holds, and every doubt.

    Parameters
    ----------
    specimen
        Name in the study; empty: its only one.
    changes
        As ``twist=75 deg``.
    pinch, share
        Of a fitted hinge: pinch angle as text with its unit, and how far it is pinched, from 0, open, to 1, closed.

    Raises
    ------
    StudyError
        In one line, for a performer without parameters, an unknown specimen, or a change or pinch that does not fit it.
    """
    chosen = plan.study.performers.get(performer)
    if not isinstance(chosen, PrbPerformer):
        known = ", ".join(name for name, p in plan.study.performers.items() if isinstance(p, PrbPerformer))
        raise StudyError(f"no PRB performer {performer!r} in the study; there is {known or 'none'}")
    beam, about = design(plan.study, specimen, changes)
    try:
        check_topology(beam, chosen)
    except ValueError as error:
        raise StudyError(f"performers.{performer}: {error}") from None
    warnings: tuple[str, ...] = ()
    if chosen.fit:
        if not Path(plan.fit_output(chosen.fit)).is_file():
            raise StudyError(f"fit {chosen.fit} has not been made yet; run the study first")
        chosen, warnings = fitted_prb(plan, completed_result(plan, chosen.fit), chosen, beam)
    if chosen.hinge is not None:
        chosen, said = _pinched(chosen, chosen.hinge, pinch or "0 deg", share)
        about = f"{about}, {said}"
    elif pinch:
        raise StudyError(f"performers.{performer}: --pinch belongs to a model with a fit of kind hinge")
    values = chosen.values(beam)
    tests = [e for c in plan.study.campaigns.values() if not misfit(beam, e := plan.study.experiments[c.experiment])]
    experiment = next((e for e in tests if e.in_motion), None) or next(iter(plan.study.experiments.values()))
    write_text(output, mjcf_of(chosen, values, beam, experiment))
    numbers = ", ".join(f"{p.name} {p.show(values[p.name])}" for p in chosen.topology.declare(beam))
    lines = [f"{output}: {chosen.topology.name} for {about}: {numbers}", *(f"doubt: {doubt}" for doubt in warnings)]
    return "\n".join(lines)


def _pinched(model: PrbPerformer, curves: HingeCurves, pinch: str, share: float) -> tuple[PrbPerformer, str]:
    """The model of a tube pinched that far, and its state in words."""
    try:
        angle = to_si(pinch, "rad")
    except ValueError as error:
        raise StudyError(f"--pinch: {error}") from None
    if not 0.0 <= angle <= 2 * math.pi:
        raise StudyError(f"--pinch {pinch} must lie between 0 and 360 deg")
    if not 0.0 <= share <= 1.0:
        raise StudyError(f"--share {share:g} must lie between 0, open, and 1, closed")
    if why := curves.refusal(angle):
        raise StudyError(f"--pinch {pinch}: {why}")
    mine = model.pinched(curves.state(angle, share).parameters)
    assert isinstance(mine, PrbPerformer)
    return mine, f"pinched at {pinch} by {share:g} of its travel"
