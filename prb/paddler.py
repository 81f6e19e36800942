"""The paddling device of section 4.5.3 as numbers: what a study and a fit say, made ready for the compiled motion.

``Paddler`` holds one half of the device.  Its numbers are the parameters of the topology ``paddler``, each with unit,
bounds and the reason for its nominal value, and, where a fit has learned them, the curves of the fin.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.experiments import PaddleThrust
from lab.specimens import FinnedTube
from prb.declaration import Declaration
from prb.fin_curves import TERMS, FinCurves
from prb.paddler_kernel import PATH, STATE, Numbers, march, turned, two_exponentials

Array = NDArray[np.float64]
#: Names that a topology's parameters must have for its device to paddle.
NEEDED = (
    "tube_mass", "piston", "flat_pressure", "widening", "tube_damper", "stop", "fill", "vent", "rest_angle", "sweep",
    "hinge_share", "fin_mass", "fin_breadth", "opposite", "opposite_limit", "opposite_beyond", "equal",
    "equal_limit", "equal_beyond", "fin_damper", "plate", "carried", "load_reach", "load_breadth", "body_mass",
    "body_carried", "body_drag", "sensor_time",
)  # fmt: skip
#: Coordinates and their speeds, which come first in a state and after the time in a path.
_MOTION = 6
#: Longest step, s: at 0.5 ms the peaks of thrust are off by less than a thousandth.
LONGEST_STEP = 0.5e-3
#: Largest ``Motion.step_error`` of a result.
_STEADY = 0.02
#: Longest step times the fastest rate of the springs and dampers; the method is stable up to 2.78.
_STABLE = 2.0


@dataclass(frozen=True)
class Plate:
    """A rigid plate of the fin, its mass and the water's force at its middle.

    Parameters
    ----------
    outer
        Whether it belongs to the link beyond the hinge.
    arm
        Its middle from the begin of its link, m.
    mass, area, carried
        kg, m^2, and the water that moves with its normal, kg.
    """

    name: str
    outer: bool
    arm: float
    length: float
    mass: float
    area: float
    carried: float


@dataclass(frozen=True)
class Stroke:
    """How the device is driven.

    Parameters
    ----------
    pressure, frequency
        Of the open valve, Pa; Hz.
    cycles
        Strokes, those that are left out of means included.
    duty
        Share of a cycle with the valve open.
    free
        Whether the body swims.
    density
        Of the water, kg/m^3.
    pull
        Constant force forwards on the whole body, N, as of a thread that tows it.
    """

    pressure: float
    frequency: float
    cycles: int
    duty: float = 0.5
    free: bool = False
    density: float = 1000.0
    pull: float = 0.0


@dataclass(frozen=True)
class Paddler:
    """One half of the device.

    Parameters
    ----------
    values
        By the names in ``NEEDED``, SI.
    fin_length
        m.
    load
        Mass (kg), length beyond the tip and breadth (m) of the load fin; None: without.
    curves
        Learned ones, which take the place of values.
    """

    values: Mapping[str, float]
    fin_length: float
    load: tuple[float, float, float] | None = None
    curves: FinCurves | None = None

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def widening(self) -> float:
        """x1 of the flat tube, m."""
        return self.curves.widening if self.curves else self["widening"]

    @property
    def turn(self) -> Array:
        """Coefficients of g(x1), (5,)."""
        if self.curves and self.curves.turn is not None:
            return np.array(self.curves.turn)
        return np.array([self["rest_angle"], -self["sweep"] / self["widening"]] + [0.0] * (TERMS - 2))

    def springs(self) -> tuple[Array, Array]:
        """Two-term exponentials (2, 2, 4) of stiffness and limit in both senses, and the slopes beyond, (2,)."""
        found, beyond = np.zeros((2, 2, 4)), np.zeros(2)
        for side, name in enumerate(("opposite", "equal")):
            learned = getattr(self.curves, name) if self.curves else None
            if learned:
                found[side], beyond[side] = (learned.stiffness, learned.limit), learned.beyond
            else:
                found[side, :, 0], beyond[side] = (self[name], self[f"{name}_limit"]), self[f"{name}_beyond"]
        return found, beyond

    def plates(self, density: float = 1000.0) -> list[Plate]:
        """Both links of the fin, and the load fin beyond them."""
        breadth, share, length = self["fin_breadth"], self["hinge_share"], self.fin_length
        parts = [
            ("fin", False, share * length / 2, share * length, share * self["fin_mass"], breadth),
            ("outer", True, (1 - share) * length / 2, (1 - share) * length, (1 - share) * self["fin_mass"], breadth),
        ]
        if self.load:
            mass, beyond, wide = self.load
            beyond, wide = beyond * self["load_reach"], wide * self["load_breadth"]
            parts.append(("load", True, (1 - share) * length + beyond / 2, beyond, mass, wide))
        per_length = self["carried"] * density * np.pi / 4
        return [Plate(n, o, arm, span, m, span * w, per_length * w**2 * span) for n, o, arm, span, m, w in parts]

    def numbers(self, stroke: Stroke) -> Numbers:
        """Ready for ``prb.paddler_kernel``."""
        at_flat = self["piston"] * self["flat_pressure"]
        stiffness = at_flat / self.widening
        spring, beyond = self.springs()
        points = [[float(p.outer), p.arm, p.mass, p.area, p.carried] for p in self.plates(stroke.density)]
        return Numbers(
            turn=self.turn,
            tube=np.array([self["tube_mass"], stiffness, self["tube_damper"], self.widening, self["stop"] * stiffness]),
            hinge=np.array([self["hinge_share"] * self.fin_length, self["fin_damper"]]),
            spring=spring, beyond=beyond, points=np.array(points), plate=stroke.density * self["plate"],
            body=np.array([
                self["body_mass"] + self["body_carried"], stroke.density * self["body_drag"] / 2, stroke.pull / 2
            ]),
            valve=np.array([self["piston"] * stroke.pressure, self["fill"], self["vent"]]), free=stroke.free,
        )  # fmt: skip

    def phases(self, stroke: Stroke, step: float) -> Array:
        """Open and shut valve: force (N), lag (s), duration (s) and number of steps, (2, 4)."""
        period = 1.0 / stroke.frequency
        rows = [
            (self["piston"] * stroke.pressure, self["fill"], stroke.duty * period),
            (0.0, self["vent"], (1 - stroke.duty) * period),
        ]
        return np.array([[force, lag, span, max(int(np.ceil(span / step - 1e-9)), 2)] for force, lag, span in rows])


@dataclass(frozen=True)
class Motion:
    """A path of the half device, one row per step of the simulation.

    Attributes
    ----------
    path
        Columns ``prb.paddler_kernel.PATH``, (rows, 16); MuJoCo leaves works and energies NaN.
    step_error
        Change of sensed thrust and tip speed by half the step, rms over rms, the larger; None: not looked at.
    """

    paddler: Paddler
    stroke: Stroke
    path: Array
    step_error: float | None = None

    def __getitem__(self, name: str) -> Array:
        return self.path[:, PATH.index(name)]

    @property
    def completed(self) -> bool:
        """Whether the motion stayed finite."""
        return bool(np.isfinite(self.path[-1, : 1 + _MOTION]).all())

    @property
    def fault(self) -> str:
        """Why the motion is no result; empty where it is one."""
        if not self.completed:
            return f"the motion runs away with steps of {self.step:.3g} s; shorten time_step"
        if self.step_error is not None and not self.step_error <= _STEADY:
            return (
                f"the motion is not steady: steps of {self.step:.3g} s still change thrust or tip speed by "
                f"{self.step_error:.1%} against steps twice as long; shorten time_step"
            )
        return ""

    @property
    def seconds(self) -> float:
        """Time that the path covers, s."""
        return self.stroke.cycles / self.stroke.frequency

    @property
    def step(self) -> float:
        """Longest step that was taken, s."""
        return float(np.diff(self["time"][: len(self.path) // self.stroke.cycles]).max())

    @property
    def fin_angle(self) -> Array:
        """theta_1 from the rear axis, (rows,), rad."""
        return np.asarray(np.polynomial.polynomial.polyval(self["x1"], self.paddler.turn), dtype=float)

    @property
    def thrust(self) -> Array:
        """Of the whole device, (rows,), N: on the mount; of a free body, by the water on its fins."""
        return 2.0 * (self["water_force"] if self.stroke.free else -self["reaction"])

    @property
    def sensed(self) -> Array:
        """``thrust`` as a sensor shows it: its mean over the last ``sensor_time``, (rows,), N."""
        time, thrust = self["time"], self.thrust
        impulse = np.concatenate([[0.0], np.cumsum(np.diff(time) * (thrust[1:] + thrust[:-1]) / 2)])
        span = self.paddler["sensor_time"]
        before = np.interp(time - span, time, impulse)
        return (impulse - before) / np.clip(time - time[0], 1e-12, span)

    @property
    def tip(self) -> Array:
        """Place of the last plate's end from the body, outward and forwards, (rows, 2), m."""
        links = self.links()
        return links[:, -1]

    def links(self) -> Array:
        """Root, hinge and end of the fin with what it carries, (rows, 3, 2), m, from the body's place."""
        theta, q = self.fin_angle, self["buckling"]
        last = self.paddler.plates()[-1]
        inner, outer = self.paddler["hinge_share"] * self.paddler.fin_length, last.arm + last.length / 2
        root = np.column_stack([self["x1"], np.zeros_like(theta)])
        hinge = root + inner * _along(theta)
        return np.stack([root, hinge, hinge + outer * _along(theta + q)], axis=1)

    @property
    def tip_speed(self) -> Array:
        """Of the last plate's end from the body, (rows,), m/s."""
        theta, q, vx = self.fin_angle, self["buckling"], self["x1_speed"]
        slope = np.polynomial.polynomial.polyval(self["x1"], np.polynomial.polynomial.polyder(self.paddler.turn))
        last = self.paddler.plates()[-1]
        inner, outer = self.paddler["hinge_share"] * self.paddler.fin_length, last.arm + last.length / 2
        velocity = (slope * vx * inner)[:, None] * _across(theta)
        velocity += ((slope * vx + self["buckling_speed"]) * outer)[:, None] * _across(theta + q)
        velocity[:, 0] += vx
        return np.linalg.norm(velocity, axis=1)

    def books(self) -> dict[str, float]:
        """Energy of the half device, J: what the actuator and the pull gave, what was lost, and what is left of it."""
        end, begin = self.path[-1], self.path[0]
        at = {name: float(end[i] - begin[i]) for i, name in enumerate(PATH)}
        stored = at["kinetic"] + at["potential"]
        given = at["work"] + at["pull_work"]
        return {
            "given": given, "water": at["water_loss"], "dampers": at["damper_loss"], "stored": stored,
            "missing": given - at["water_loss"] - at["damper_loss"] - stored,
        }  # fmt: skip


def longest_step(paddler: Paddler, n: Numbers, step: float) -> float:
    """``step`` (s), or a shorter one where the half device has springs or dampers that are faster."""
    springs = paddler.springs()[0]
    fastest = 0.0
    for x in (0.0, paddler.widening):
        xx, xq, qq = _inertia(n, x)
        determinant = xx * qq - xq * xq
        stiff = max(float(two_exponentials(springs[side, 0], x / paddler.widening)[0]) for side in (0, 1))
        # The trace of M^-1 K bounds the largest eigenvalue; likewise that of the dampers.
        square = (qq * (n.tube[1] + n.tube[4]) + xx * stiff) / determinant
        fastest = max(fastest, float(np.sqrt(square)), float(qq * n.tube[2] + xx * n.hinge[1]) / determinant)
    return min(step, _STABLE / fastest)


def _inertia(n: Numbers, x: float) -> tuple[float, float, float]:
    """Mass matrix of widening and buckling of a straight fin: kg, kg*m and kg*m^2."""
    theta, slope, _ = turned(x, n.turn)
    xx, xq, qq = float(n.tube[0]), 0.0, 0.0
    for outer, arm, mass, _, carried in n.points.tolist():
        across, normal = np.sin(theta), np.cos(theta) + slope * (arm + outer * n.hinge[0])
        turning = outer * arm
        xx += mass * across**2 + (mass + carried) * normal**2
        xq += (mass + carried) * normal * turning
        qq += (mass + carried) * turning**2
    return xx, xq, qq


def _along(theta: Array) -> Array:
    return np.column_stack([np.sin(theta), -np.cos(theta)])


def _across(theta: Array) -> Array:
    return np.column_stack([np.cos(theta), np.sin(theta)])


def paddle(paddler: Paddler, stroke: Stroke, step: float = LONGEST_STEP, start: Array | None = None) -> Motion:
    """Motion from rest, or from a state (11,), with steps of at most ``step`` (s)."""
    begin, numbers = np.zeros(STATE) if start is None else start, paddler.numbers(stroke)
    phases = paddler.phases(stroke, longest_step(paddler, numbers, step))
    return Motion(paddler, stroke, march(begin, phases, stroke.cycles, numbers))


def is_paddler(topology: Declaration) -> bool:
    """Whether a topology has the parameters of a paddling device."""
    return set(NEEDED) <= set(topology.names)


def paddler_of(specimen: FinnedTube, values: Mapping[str, float], curves: FinCurves | None = None) -> Paddler:
    """The half device of a tube with fins."""
    load = None if (fin := specimen.load_fin) is None else (fin.mass, fin.length, fin.width)
    return Paddler({name: float(values[name]) for name in NEEDED}, specimen.fin_length, load, curves)


def stroke_of(experiment: PaddleThrust) -> Stroke:
    """How an experiment drives the device."""
    e = experiment
    return Stroke(e.pressure, e.frequency, e.cycles, e.duty, e.body == "free", e.water_density)
