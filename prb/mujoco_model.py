"""From a mechanism to MuJoCo: a model, an edited model, or MJCF text."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from prb.inertia import inertial
from prb.mechanism import CLAMP, Branch, Hinge, Knee, Mechanism, Vector
from prb.rotations import quaternion, rest_rotation, turn_about_x

Array = NDArray[np.float64]
TIP = "tip"
_JOINT_TYPES = {"rotation": mujoco.mjtJoint.mjJNT_HINGE, "slide": mujoco.mjtJoint.mjJNT_SLIDE}
#: End of the range on whose other side a knee's tendon pulls, far beyond every coordinate (rad or m).
_FAR = 1e6
#: Inertia of a hidden joint over stiffness * time^2 of its branch: its own motion is that much faster.
_LIGHT = 1e-4
#: Time (s) and damping ratio with which dry friction brings a joint to rest below its limit.
_STICKS = (0.004, 1.0)
#: Mass of a hidden body, which turns about its centre, kg.
_HIDDEN_MASS = 1e-9


@contextmanager
def silence() -> Iterator[None]:
    """Keep MuJoCo from writing a log file: what it warns of is found and reported by us."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def build_spec(mechanism: Mechanism, markers: Sequence[Vector] = (), time_step: float = 0.25e-3) -> mujoco.MjSpec:
    """MuJoCo specification of a mechanism, without gravity and contacts.

    Parameters
    ----------
    markers
        Places from the tip's centre in the fixed axes with slack springs, m; they ride on the tip's link.
    time_step
        s.

    Returns
    -------
    spec
        One body per link, one hidden body per Maxwell branch, sites ``tip``, ``marker0``, ..., and a position
        sensor (m) for each site.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "pseudo-rigid-body model"
    spec.compiler.degree = False
    spec.option.timestep = time_step
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    bodies: dict[int, mujoco.MjsBody] = {CLAMP: spec.worldbody}
    for number in range(len(mechanism.links)):
        bodies[number] = _add_link(bodies[mechanism.parent(number)], mechanism, number)
    for name, place in _sites(mechanism, markers).items():
        bodies[mechanism.tip[0]].add_site(name=name, pos=place, size=[0.001] * 3)
        spec.add_sensor(
            name=name, type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name
        )
    for name, _, branch in _branches(mechanism):
        _add_hidden(spec, name, branch)
    for declared in _tendons(mechanism):
        tendon = spec.add_tendon(name=declared.name)
        for joint, share in declared.shares:
            tendon.wrap_joint(joint, share)
        tendon.stiffness, tendon.springlength, tendon.damping[0] = declared.stiffness, declared.slack, declared.damping
    return spec


def _add_link(parent: mujoco.MjsBody, mechanism: Mechanism, number: int) -> mujoco.MjsBody:
    link = mechanism.links[number]
    mass, centre, inertia, turn = inertial(mechanism, number)
    body = parent.add_body(name=link.name, pos=mechanism.place(number), quat=quaternion(link.rotation))
    body.explicitinertial, body.mass, body.ipos = True, mass, centre
    body.inertia, body.iquat = inertia, turn
    for hinge in link.hinges:
        joint = body.add_joint(name=hinge.name, type=_JOINT_TYPES[hinge.kind], axis=hinge.axis)
        joint.stiffness, joint.springref = [hinge.stiffness, *hinge.higher], hinge.rest
        joint.damping = [hinge.damping, *hinge.higher_damping]
        joint.frictionloss, joint.solref_friction = hinge.friction, _STICKS
    # The box is there to be looked at: mass and inertia are explicit, because of what the tip carries.
    size = [link.length / 2.0, link.width / 2.0, link.thickness / 2.0]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=[size[0], 0.0, 0.0], quat=turn_about_x(link.angle),
        contype=0, conaffinity=0,
    )  # fmt: skip
    return body


def _add_hidden(spec: mujoco.MjSpec, name: str, branch: Branch) -> None:
    """A flywheel whose angle is the state of a branch, and whose damper makes the branch relax."""
    body = spec.worldbody.add_body(name=name)
    body.explicitinertial, body.mass, body.ipos = True, _HIDDEN_MASS, [0.0, 0.0, 0.0]
    body.inertia = [_hidden_inertia(branch)] * 3
    joint = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[1.0, 0.0, 0.0])
    joint.damping[0] = branch.stiffness * branch.time


def _hidden_inertia(branch: Branch) -> float:
    # Not below what the simulator takes for a singular inertia.
    return max(_LIGHT * branch.stiffness * branch.time**2, 1e-13)


def _knees(mechanism: Mechanism) -> Iterator[tuple[Hinge, Knee, bool]]:
    for hinge in mechanism.hinges:
        if hinge.above:
            yield hinge, hinge.above, True
        if hinge.below:
            yield hinge, hinge.below, False


def _branches(mechanism: Mechanism) -> Iterator[tuple[str, Hinge, Branch]]:
    for hinge in mechanism.hinges:
        for number, branch in enumerate(hinge.branches):
            yield f"{hinge.name} branch {number}", hinge, branch


@dataclass(frozen=True)
class _Tendon:
    """A knee, a tie or a branch: shares of joints, k, k2, k3, slack range, and damping."""

    name: str
    shares: tuple[tuple[str, float], ...]
    stiffness: tuple[float, float, float]
    slack: tuple[float, float] = (0.0, 0.0)
    damping: float = 0.0


def _tendons(mechanism: Mechanism) -> list[_Tendon]:
    """Knees, ties, then branches."""
    found = []
    for hinge, knee, above in _knees(mechanism):
        at, slope = hinge.rest + knee.at, knee.stiffness - hinge.stiffness
        name, slack = (f"{hinge.name} above", (-_FAR, at)) if above else (f"{hinge.name} below", (at, _FAR))
        found.append(_Tendon(name, ((hinge.name, 1.0),), (slope, 0.0, 0.0), slack))
    for tie in mechanism.ties:
        found.append(_Tendon(f"{tie.name} tie", tie.shares, (tie.stiffness, *tie.higher), damping=tie.damping))
    for name, hinge, branch in _branches(mechanism):
        found.append(_Tendon(name, ((hinge.name, 1.0), (name, -1.0)), (branch.stiffness, 0.0, 0.0)))
    return found


def _sites(mechanism: Mechanism, markers: Sequence[Vector]) -> dict[str, Array]:
    """Tip and markers in the frame of the tip's link, m."""
    number, tip = mechanism.tip
    places = np.array(markers, dtype=np.float64).reshape(-1, 3)
    turn = rest_rotation(mechanism, number)
    inside = tip + (places if turn is None else places @ turn)
    return {TIP: np.array(tip)} | {f"marker{i}": place for i, place in enumerate(inside)}


def compile_mechanism(
    mechanism: Mechanism, markers: Sequence[Vector] = (), time_step: float = 0.25e-3
) -> mujoco.MjModel:
    """Compiled model of a mechanism; see ``build_spec``.

    Two parallel hinges at one place, as R1 and R2 of an untwisted beam, have a singular inertia.  Statics can
    do without it, so the simulator's warning is left to dynamic experiments, which refuse such mechanisms.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Inertia matrix is too close to singular")
        return build_spec(mechanism, markers, time_step).compile()


def to_mjcf(mechanism: Mechanism, markers: Sequence[Vector] = (), time_step: float = 0.25e-3) -> str:
    """MJCF text of a mechanism; MuJoCo writes its numbers with six digits."""
    spec = build_spec(mechanism, markers, time_step)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Inertia matrix is too close to singular")
        spec.compile()
    return spec.to_xml()


def write_mechanism(
    model: mujoco.MjModel, data: mujoco.MjData, mechanism: Mechanism, markers: Sequence[Vector]
) -> None:
    """Turn ``model`` into that of another mechanism of the same structure with as many markers.

    Some 20 times cheaper than compiling, which dominates a fit otherwise.  Everything that depends on
    a mechanism's numbers is written; ``data`` is scratch of the same sizes.
    """
    for number, link in enumerate(mechanism.links):
        mass, centre, inertia, turn = inertial(mechanism, number)
        body, half = number + 1, link.length / 2.0
        model.body_pos[body] = mechanism.place(number)
        model.body_quat[body] = quaternion(link.rotation)
        model.body_mass[body], model.body_ipos[body] = mass, centre
        model.body_inertia[body], model.body_iquat[body] = inertia, turn
        model.geom_size[number] = half, link.width / 2.0, link.thickness / 2.0
        model.geom_pos[number, 0], model.geom_quat[number] = half, turn_about_x(link.angle)
    _write_hinges(model, mechanism.hinges)
    branches = [branch for *_, branch in _branches(mechanism)]
    if branches:
        model.body_inertia[-len(branches) :] = [[_hidden_inertia(b)] * 3 for b in branches]
        model.dof_damping[-len(branches) :] = [b.stiffness * b.time for b in branches]
    tendons = _tendons(mechanism)
    if tendons:
        stiffness = np.array([t.stiffness for t in tendons])
        model.tendon_stiffness[:], model.tendon_stiffnesspoly[:] = stiffness[:, 0], stiffness[:, 1:]
        model.tendon_lengthspring[:] = [t.slack for t in tendons]
        model.tendon_damping[:] = [t.damping for t in tendons]
        model.wrap_prm[:] = [share for t in tendons for _, share in t.shares]
    model.site_pos[:] = list(_sites(mechanism, markers).values())
    with silence():
        mujoco.mj_setConst(model, data)


def _write_hinges(model: mujoco.MjModel, hinges: Sequence[Hinge]) -> None:
    count = len(hinges)
    model.jnt_axis[:count] = [hinge.axis for hinge in hinges]
    model.jnt_stiffness[:count] = [hinge.stiffness for hinge in hinges]
    model.dof_damping[:count] = [hinge.damping for hinge in hinges]
    model.dof_frictionloss[:count] = [hinge.friction for hinge in hinges]
    model.qpos_spring[:count] = [hinge.rest for hinge in hinges]
    model.jnt_stiffnesspoly[:count] = [hinge.higher for hinge in hinges]
    model.dof_dampingpoly[:count] = [hinge.higher_damping for hinge in hinges]
