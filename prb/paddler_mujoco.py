"""The paddling half device in MuJoCo: a twin of the compiled motion, MJCF for other simulators, and its own fluids.

MuJoCo's x is outward (u), its y forwards (v).  Everything but the water and springs that change with the flattening is
native: slides, hinges, the learned turn as a joint equality with a polynomial, buckling as tendons that pull on one
side, the actuator as a motor on the slide whose control is its force.  The plate law is a passive force (``passive``):

    for each site ``plate ...`` with the velocity u of the link there and the plate's normal n (the site's y-axis):
    F = -rho c |u| (u . n) A n, with rho c A in the custom number of the same name.

Water that a plate carries along its normal (``carried``) is left out: no mass here acts along one direction alone.
Forces in ``qfrc_passive`` are invisible to force sensors, so thrust is read where the body is held: minus the force of
the equality ``mount`` on the slide ``swim`` (``qfrc_constraint``).
"""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.mujoco_model import silence
from prb.paddler import Motion, Paddler, Plate, Stroke
from prb.paddler_kernel import PATH, Numbers, buckling_spring
from prb.water import Water

Array = NDArray[np.float64]
#: End of the range on whose other side a tendon pulls, m or rad.
_FAR = 1e6
#: Moment of inertia of a link that is a point mass, kg*m^2: far below that of its mass about the hinge.
_POINT = 1e-11
#: Thickness of drawn plates over their length, and of those that MuJoCo's fluids see.
_THIN = 0.02
#: Of water, Pa*s.
_VISCOSITY = 1e-3
_LEFT = "Springs that change with the flattening{} are left to a passive force."
#: What a model in another water than the plate law's says of it.
_OWN = {
    "ellipsoid": f"The fin's plates are in MuJoCo's fluid as ellipsoids.  {_LEFT.format(', and drag of the body,')}",
    "inertia-box": f"The fin's plates are in MuJoCo's fluid as boxes.  {_LEFT.format(', and drag of the body,')}",
    "none": f"No water acts on fins and body.  {_LEFT.format('')}",
}
#: A motion that is faster runs away, as a compiled one: outward, m/s, and of the hinge, rad/s.
_FASTEST = (1e3, 1e5)
_ROUNDING = 1e-9


def paddler_spec(paddler: Paddler, stroke: Stroke, *, water: Water = "plate", time_step: float = 1e-4) -> mujoco.MjSpec:
    """Specification of the half device."""
    n = paddler.numbers(stroke)
    spec = mujoco.MjSpec()
    spec.modelname = "paddler"
    spec.compiler.degree = False
    spec.option.timestep, spec.option.gravity = time_step, [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    if water in ("ellipsoid", "inertia-box"):
        spec.option.density, spec.option.viscosity = stroke.density, _VISCOSITY
    _add_bodies(spec, paddler, stroke, n, water)
    _add_springs(spec, paddler, n)
    solver = {"solref": [2.0 * time_step, 1.0], "solimp": [0.9999, 0.9999, 1e-3, 0.5, 2.0]}
    _add_equality(spec, "turns", "turn", "widen", [0.0, *n.turn[1:]], solver)
    if not stroke.free:
        _add_equality(spec, "mount", "swim", "", [0.0] * 5, solver)
    motor = spec.add_actuator(name="actuator", target="widen", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_motor()
    spec.add_text(name="water", data=(__doc__ or "").split("\n\n", 1)[1] if water == "plate" else _OWN[water])
    return spec


def _add_bodies(spec: mujoco.MjSpec, paddler: Paddler, stroke: Stroke, n: Numbers, water: Water) -> None:
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    body = _add_body(spec.worldbody, "body", [0.0, 0.0, 0.0], n.body[0])
    body.add_joint(name="swim", type=slide, axis=[0.0, 1.0, 0.0])
    tube = _add_body(body, "tube", [0.0, 0.0, 0.0], n.tube[0])
    widen = tube.add_joint(name="widen", type=slide, axis=[1.0, 0.0, 0.0])
    widen.stiffness[0], widen.damping[0] = n.tube[1], n.tube[2]
    plates = paddler.plates(stroke.density)
    links = {False: _add_body(tube, "fin", [0.0, 0.0, 0.0])}
    angle = (n.turn[0] - np.pi / 2) / 2
    links[False].quat = [np.cos(angle), 0.0, 0.0, np.sin(angle)]
    links[False].add_joint(name="turn", type=hinge, axis=[0.0, 0.0, 1.0])
    links[True] = _add_body(links[False], "outer", [n.hinge[0], 0.0, 0.0])
    links[True].add_joint(name="buckle", type=hinge, axis=[0.0, 0.0, 1.0]).damping[0] = n.hinge[1]
    for plate in plates:
        _add_plate(spec, links[plate.outer], plate, n.plate * plate.area, water)


def _add_body(parent: mujoco.MjsBody, name: str, place: list[float], mass: float = 0.0) -> mujoco.MjsBody:
    body = parent.add_body(name=name, pos=place)
    if mass:
        body.explicitinertial, body.mass, body.ipos, body.inertia = True, mass, [0.0] * 3, [_POINT] * 3
    return body


def _add_plate(spec: mujoco.MjSpec, link: mujoco.MjsBody, plate: Plate, strength: float, water: Water) -> None:
    """A welded body, so that every plate has a mass of its own at its middle."""
    breadth, thickness = plate.area / plate.length, _THIN * plate.length
    body = _add_body(link, f"plate {plate.name}", [plate.arm, 0.0, 0.0], plate.mass)
    if water == "inertia-box":
        # MuJoCo takes the box that it loads from mass and inertia.
        sides = np.array([plate.length, thickness, breadth]) ** 2
        body.inertia = plate.mass / 12.0 * (sides.sum() - sides)
    geom = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[plate.length / 2, thickness / 2, breadth / 2], contype=0, conaffinity=0
    )
    if water == "ellipsoid":
        geom.fluid_ellipsoid = 1.0
    body.add_site(name=f"plate {plate.name}", size=[0.001] * 3)
    if water == "plate":
        spec.add_numeric(name=f"plate {plate.name}", data=[strength])


def _add_springs(spec: mujoco.MjSpec, paddler: Paddler, n: Numbers) -> None:
    """Stop of the slide, and the hinge's spring where it does not change with the flattening."""
    _add_tendon(spec, "stop", "widen", n.tube[4], (-_FAR, n.tube[3]))
    for side, (name, sign) in enumerate((("opposite", 1.0), ("equal", -1.0))):
        if _changes(n):
            continue
        k, limit = n.spring[side, :, 0] + n.spring[side, :, 2]
        for part, at, slope in (("", 0.0, k), (" limit", limit / k, (n.beyond[side] - 1.0) * k)):
            _add_tendon(spec, f"{name}{part}", "buckle", slope, (-_FAR, at) if sign > 0 else (-at, _FAR))


def _changes(n: Numbers) -> bool:
    """Whether the hinge's spring depends on the flattening, which no native spring can."""
    return bool((n.spring[:, :, [1, 3]] * n.spring[:, :, [0, 2]]).any())


def _add_tendon(spec: mujoco.MjSpec, name: str, joint: str, stiffness: float, slack: tuple[float, float]) -> None:
    tendon = spec.add_tendon(name=name)
    tendon.wrap_joint(joint, 1.0)
    tendon.stiffness[0], tendon.springlength = stiffness, slack


def _add_equality(
    spec: mujoco.MjSpec, name: str, joint: str, of: str, polynomial: list[float], solver: dict[str, list[float]]
) -> None:
    equality = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_JOINT, name1=joint, name2=of, **solver)
    equality.objtype = mujoco.mjtObj.mjOBJ_JOINT
    equality.data[:5] = polynomial


def paddler_mjcf(paddler: Paddler, stroke: Stroke, *, water: Water = "plate", time_step: float = 1e-4) -> str:
    """MJCF text of the half device; what is left to a passive force its text ``water`` says."""
    spec = paddler_spec(paddler, stroke, water=water, time_step=time_step)
    spec.compile()
    return str(spec.to_xml())


@contextmanager
def passive(model: mujoco.MjModel, paddler: Paddler, stroke: Stroke, water: Water = "plate") -> Iterator[None]:
    """Plate loads, body drag and learned springs as MuJoCo's passive force, for every model while it lasts."""
    n, drag = paddler.numbers(stroke), _drag(paddler, stroke, water)
    loaded = paddler.plates(stroke.density) if water == "plate" else []
    plates = [(model.site(f"plate {p.name}").id, n.plate * p.area) for p in loaded]
    dofs = {name: int(model.joint(name).dofadr[0]) for name in ("swim", "widen", "buckle")}
    changes, velocity = _changes(n), np.zeros(6)

    def load(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        for site, strength in plates:
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site, velocity, 1)
            across, speed = velocity[4], np.sqrt(velocity[3] ** 2 + velocity[4] ** 2 + velocity[5] ** 2)
            force = -strength * speed * across * data.site_xmat[site].reshape(3, 3)[:, 1]
            place, body = data.site_xpos[site], model.site_bodyid[site]
            mujoco.mj_applyFT(model, data, force, np.zeros(3), place, body, data.qfrc_passive)
        forward = data.qvel[dofs["swim"]]
        data.qfrc_passive[dofs["swim"]] += n.body[2] - drag * abs(forward) * forward
        if changes:
            q, s = float(data.qpos[dofs["buckle"]]), float(data.qpos[dofs["widen"]] / n.tube[3])
            moment, _, by_s = buckling_spring(q, s, n)
            data.qfrc_passive[dofs["buckle"]] -= moment
            data.qfrc_passive[dofs["widen"]] -= by_s / n.tube[3]

    mujoco.set_mjcb_passive(load)
    try:
        yield
    finally:
        mujoco.set_mjcb_passive(None)


def _drag(paddler: Paddler, stroke: Stroke, water: Water) -> float:
    """Drag of half the body, N*s^2/m^2, which no fluid of MuJoCo's sees: only the fins' plates are in it."""
    return 0.0 if water == "none" else float(paddler.numbers(stroke).body[1])


def paddle_in_mujoco(paddler: Paddler, stroke: Stroke, *, water: Water = "plate", time_step: float = 1e-4) -> Motion:
    """The motion of ``prb.paddler.paddle``, from rest, by MuJoCo; works and energies stay NaN.

    Parameters
    ----------
    time_step
        Longest step, s: a period has a whole number of them.

    Raises
    ------
    ValueError
        For water that a plate carries, which MuJoCo has no place for.
    """
    if paddler["carried"] > 0 and water == "plate":
        raise ValueError("carried: MuJoCo has no mass that acts along a plate's normal alone; set it to 0")
    per_cycle = int(np.ceil(1.0 / (stroke.frequency * time_step) - _ROUNDING))
    times: Array = np.arange(stroke.cycles * per_cycle + 1) / (stroke.frequency * per_cycle)
    forces = actuator_force(paddler, stroke, times)
    model = paddler_spec(paddler, stroke, water=water, time_step=float(times[1])).compile()
    with silence(), passive(model, paddler, stroke, water):
        states, mount, along = _march(model, forces)
    speed = states[:, 3]
    on_fins = along - paddler.numbers(stroke).body[2] + _drag(paddler, stroke, water) * np.abs(speed) * speed
    path = np.full((len(times), len(PATH)), np.nan)
    path[:, : PATH.index("input_force") + 1] = np.column_stack([times, states, forces])
    path[:, [PATH.index("reaction"), PATH.index("water_force")]] = np.column_stack([mount, on_fins])
    return Motion(paddler, stroke, path)


def _march(model: mujoco.MjModel, forces: Array) -> tuple[Array, Array, Array]:
    """States (n, 6) from rest, and at each the mount's force and all passive force along the body's slide, (n,).

    A motion that runs away ends with NaN: MuJoCo, left alone, would begin anew from rest.
    """
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = mujoco.MjData(model)
    moved = [int(model.joint(name).dofadr[0]) for name in ("swim", "widen", "buckle")]
    states, loads = np.full((len(forces), 6), np.nan), np.full((len(forces), 2), np.nan)
    for row, force in enumerate(forces):
        states[row] = *data.qpos[moved], *data.qvel[moved]
        data.ctrl[0] = force
        mujoco.mj_step(model, data)  # leaves the forces at its begin
        loads[row] = data.qfrc_constraint[moved[0]], data.qfrc_passive[moved[0]]
        _, outward, buckling = data.qvel[moved]
        if not (abs(outward) < _FASTEST[0] and abs(buckling) < _FASTEST[1]):
            break
    return states, loads[:, 0], loads[:, 1]


def actuator_force(paddler: Paddler, stroke: Stroke, times: Array) -> Array:
    """Force of the actuator on the half device at ``times``, N: it follows the valve with a lag."""
    full, begin, force = paddler["piston"] * stroke.pressure, 0.0, 0.0
    found = np.zeros_like(times)
    for _ in range(stroke.cycles):
        for target, lag, span in (
            (full, paddler["fill"], stroke.duty / stroke.frequency),
            (0.0, paddler["vent"], (1 - stroke.duty) / stroke.frequency),
        ):
            inside = times >= begin - 1e-12
            found[inside] = target + (force - target) * np.exp(-(times[inside] - begin) / lag)
            force = target + (force - target) * float(np.exp(-span / lag))
            begin += span
    return found
