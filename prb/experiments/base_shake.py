"""Steady orbit of the tip over a clamp that shakes."""

from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import BaseShake
from lab.records import Channel, Record, Scalar, channels
from lab.specimens import Specimen
from prb.experiments.common import heading, how, links_as_lines
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.release import refusal, unstable
from prb.shaking import Orbit, orbits, rest_of, step_of
from prb.statics import Chain, NotConverged

Array = NDArray[np.float64]
#: States kept for pictures, both ends of the period included.
_STATES = 17


def base_shake(specimen: Specimen, experiment: BaseShake, model: PrbModel) -> Record:
    """Clamp shaken until the orbit is steady; seen from the clamp, where every link feels its inertial force.

    Returns
    -------
    record
        Channels ``time`` (samples,), ``markers`` (samples, markers, 3) and ``tip`` (samples, 3) over the last
        period, relative to the clamp, m; scalars ``periods``, ``change`` and ``remaining``.  Fields: the links as lines
        over the last period.
    """
    step = step_of(experiment, model.time_step)
    compiled = compile_mechanism(model.mechanism(specimen).in_motion, experiment.markers, step)
    compiled.opt.gravity[:] = experiment.own_gravity or (0.0, 0.0, 0.0)
    head = heading(specimen, experiment, model)
    begin = perf_counter()
    if reason := refusal(compiled):
        facts = how(specimen, model, perf_counter() - begin, time_step=step)
        return Record(**head, how=facts, status="unsupported", reason=reason)
    try:
        chain = Chain(compiled)
        rest = rest_of(chain, experiment)
    except NotConverged as failure:
        facts = how(specimen, model, perf_counter() - begin, time_step=step)
        return Record(**head, how=facts, status="diverged", reason=str(failure))
    [orbit] = orbits([compiled], [mujoco.MjData(compiled)], [experiment], [rest])
    facts = how(specimen, model, perf_counter() - begin, time_step=step)
    if orbit is None:
        return Record(**head, how=facts, status="diverged", reason=unstable(step))
    facts |= {"seconds_per_10_s": facts["wall_time_s"] * 10.0 / (orbit.worth * experiment.period)}
    return Record(
        **head,
        channels=_channels(experiment, orbit.path),
        scalars={
            "periods": Scalar(
                float(orbit.periods), "1", "periods until the orbit was steady, those of the rise included"
            ),
            "change": Scalar(orbit.change, "1", "largest change of the path in the last period over its size"),
            "remaining": Scalar(orbit.remaining, "1", "transient that may be left over the size of the path"),
        },
        how=facts,
        fields=links_as_lines(chain, experiment.times, orbit.joints, rest, _STATES),
        **unsteady(orbit),
    )


def unsteady(orbit: Orbit) -> dict[str, Any]:
    """Status and reason of an orbit that still changes; empty for a steady one."""
    return {"status": "diverged", "reason": orbit.reason} if orbit.reason else {}


def _channels(experiment: BaseShake, path: Array) -> dict[str, Channel]:
    return channels(
        Channel("time", "s", experiment.times, ("time",), "time since the clamp passed its middle along +z"),
        Channel("markers", "m", path[:, 1:], ("time", "marker", "axis"), "marker displacement relative to the clamp"),
        Channel("tip", "m", path[:, 0], ("time", "axis"), "displacement of the tip's centre relative to the clamp"),
    )
