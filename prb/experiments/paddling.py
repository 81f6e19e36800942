"""The paddling device in water (``prb.paddler``), and what its rigid links cannot be put through."""

from time import perf_counter
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from lab.experiments import FinPush, PaddleThrust, ShapePropagation
from lab.records import Channel, Fields, Record, channels
from lab.specimens import FinnedTube, Specimen
from prb.experiments.common import heading, how
from prb.model import PrbModel
from prb.water import paddle_in

if TYPE_CHECKING:
    from prb.paddler import Motion

Array = NDArray[np.float64]
_VTK_LINE = 3
#: States kept for pictures, of the last cycle.
_STATES = 25


def paddle_thrust(specimen: Specimen, experiment: PaddleThrust, model: PrbModel) -> Record:
    """Paddle from rest; channels as ``lab.experiments.PaddleThrust`` says.

    ``thrust`` of a held body is the force on its mount, inertia included, as the sensor's mean over ``sensor_time``
    shows it; that of a swimming body, which no sensor holds, is the water's force on its fins.
    """
    head = heading(specimen, experiment, model)
    if reason := refusal(specimen, model):
        return Record(**head, status="unsupported", reason=reason)
    assert isinstance(specimen, FinnedTube)
    from prb.paddler import paddler_of, stroke_of  # compiled code, which other experiments do not need

    paddler = paddler_of(specimen, model.values(specimen), model.fin)
    begin = perf_counter()
    motion = paddle_in(model.water, paddler, stroke_of(experiment), model.time_step)
    wall_time = perf_counter() - begin
    facts = how(specimen, model, wall_time, wall_time_per_s=wall_time / motion.seconds, time_step=motion.step)
    facts |= _of_water(model, motion)
    if model.fin and (notes := model.fin.doubts(specimen)):
        facts["notes"] = list(notes)
    if motion.fault:
        return Record(**head, how=facts, status="diverged", reason=motion.fault)
    return Record(**head, channels=_channels(experiment, motion), how=facts, fields=_fields(specimen, motion))


def _of_water(model: PrbModel, motion: "Motion") -> dict[str, Any]:
    """Law of the water, what ran it, and how the run was checked: energies of both halves, or another step."""
    if model.water == "plate":
        energy = {name: 2.0 * value for name, value in motion.books().items()}
        return {"water": model.water, "run_by": "the compiled motion", "energy_J": energy}
    return {"water": model.water, "run_by": f"MuJoCo {mujoco.__version__}", "step_error": motion.step_error}


def responses(experiment: PaddleThrust, motion: "Motion") -> dict[str, Array]:
    """Values of the channels by name, at the experiment's samples."""
    times = experiment.times
    values = {
        "thrust": motion.sensed, "x1": motion["x1"], "fin_angle": motion.fin_angle, "buckling": motion["buckling"],
        "tip_speed": motion.tip_speed, "input_force": 2.0 * motion["input_force"],
    }  # fmt: skip
    if experiment.body == "free":
        values |= {"body": motion["body"], "body_speed": motion["body_speed"]}
    return {"time": times} | {name: np.interp(times, motion["time"], column) for name, column in values.items()}


def refusal(specimen: Specimen, model: PrbModel) -> str:
    """Why a model cannot paddle; empty where it can."""
    if not isinstance(specimen, FinnedTube):
        return f"a {specimen.kind} has no fins to paddle with; this needs a FinnedTube"
    from prb.paddler import NEEDED, is_paddler

    if not is_paddler(model.topology):
        missing = next(name for name in NEEDED if name not in model.topology.names)
        return f"topology {model.topology.name} has no parameter {missing!r}; paddler is one that paddles"
    return ""


def shape_propagation(specimen: Specimen, experiment: ShapePropagation, model: PrbModel) -> Record:
    """Unsupported: how flattening turns the fin is what the model is given."""
    reason = "how flattening turns and bends the fin is what rigid links are given, by parameters or a fit of FEA"
    return Record(**heading(specimen, experiment, model), status="unsupported", reason=reason)


def fin_push(specimen: Specimen, experiment: FinPush, model: PrbModel) -> Record:
    """Unsupported: what a push finds is what the model is given."""
    reason = "how the fin gives way to a plate is what rigid links are given, by parameters or a fit of FEA"
    return Record(**heading(specimen, experiment, model), status="unsupported", reason=reason)


_ABOUT: dict[str, tuple[str, str]] = {
    "time": ("s", "time since the valve first opened"),
    "thrust": ("N", "force forwards of the whole device"),
    "x1": ("m", "motion of the tube's side"),
    "fin_angle": ("rad", "angle of the fin's proximal part from the tube's rear axis"),
    "buckling": ("rad", "angle of the distal part against the proximal one, positive by the load of the power stroke"),
    "tip_speed": ("m/s", "speed of the tip from the body"),
    "input_force": ("N", "of the actuator on both halves"),
    "body": ("m", "way of the body forwards"),
    "body_speed": ("m/s", "speed of the body forwards"),
}


def _channels(experiment: PaddleThrust, motion: "Motion") -> dict[str, Channel]:
    found: dict[str, Any] = responses(experiment, motion)
    return channels(*(Channel(name, _ABOUT[name][0], v, ("time",), _ABOUT[name][1]) for name, v in found.items()))


def _fields(specimen: FinnedTube, motion: "Motion") -> Fields:
    """Both fins as lines, root, hinge and end, over the last cycle."""
    last = np.flatnonzero(motion["time"] >= motion["time"][-1] - 1.0 / motion.stroke.frequency - 1e-9)
    shown = last[np.linspace(0, len(last) - 1, _STATES).round().astype(int)]
    outward, forward = np.moveaxis(motion.links()[shown], -1, 0)
    z = specimen.place - forward - motion["body"][shown, None]
    x = specimen.mid_radius + outward
    places = np.concatenate([np.stack([sign * x, np.zeros_like(x), z], axis=-1) for sign in (1.0, -1.0)], axis=1)
    rest = motion.links()[0]
    first = np.stack([specimen.mid_radius + rest[:, 0], np.zeros(3), specimen.place - rest[:, 1]], axis=-1)
    points = np.concatenate([first, first * [-1.0, 1.0, 1.0]])
    cells = np.array([[0, 1], [1, 2], [3, 4], [4, 5]], dtype=np.int64)
    moved = Channel("displacement", "m", places - points, ("state", "point", "axis"), "displacement of the links' ends")
    return Fields(points, cells, _VTK_LINE, motion["time"][shown], {"displacement": moved})
