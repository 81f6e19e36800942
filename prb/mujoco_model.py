"""From a declared mechanism to MuJoCo: a model, an edited model, or MJCF text."""

import warnings
from collections.abc import Sequence

import mujoco
import numpy as np

from prb.mechanism import Link, Mechanism, Vector

TIP = "tip"
_JOINT_TYPES = {"rotation": mujoco.mjtJoint.mjJNT_HINGE, "slide": mujoco.mjtJoint.mjJNT_SLIDE}


def _inertial(link: Link, end_mass: float) -> tuple[float, float, tuple[float, float, float]]:
    """Mass (kg), place of its centre on the link's axis (m), and moments of inertia there (kg*m^2).

    Of the box with a point mass at its far end, about x and the box's two lateral axes.
    """
    mass = link.mass + end_mass
    centre = (link.mass / 2.0 + end_mass) * link.length / mass
    swing = link.mass * (link.length / 2.0 - centre) ** 2 + end_mass * (link.length - centre) ** 2
    x2, y2, z2 = (side**2 * link.mass / 12.0 for side in (link.length, link.width, link.thickness))
    return mass, centre, (y2 + z2, x2 + z2 + swing, x2 + y2 + swing)


def _turn_about_x(angle: float) -> list[float]:
    return [float(np.cos(angle / 2.0)), float(np.sin(angle / 2.0)), 0.0, 0.0]


def _end_masses(mechanism: Mechanism) -> list[float]:
    return [0.0] * (len(mechanism.links) - 1) + [mechanism.tip_mass]


def build_spec(mechanism: Mechanism, markers: Sequence[Vector] = (), time_step: float = 0.25e-3) -> mujoco.MjSpec:
    """MuJoCo specification of a mechanism, without gravity and contacts.

    Parameters
    ----------
    markers
        Places from the tip's centre in the fixed axes at rest, m; they ride on the last link.
    time_step
        s.

    Returns
    -------
    spec
        One body per link, sites ``tip``, ``marker0``, ..., and a position sensor (m) for each site.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "pseudo-rigid-body model"
    spec.option.timestep = time_step
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    body, offset = spec.worldbody, 0.0
    for link, end_mass in zip(mechanism.links, _end_masses(mechanism), strict=True):
        body = _add_link(body, link, offset, end_mass)
        offset = link.length
    for name, place in _sites(markers).items():
        body.add_site(name=name, pos=[offset + place[0], place[1], place[2]], size=[0.001] * 3)
        spec.add_sensor(
            name=name, type=mujoco.mjtSensor.mjSENS_FRAMEPOS, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=name
        )
    return spec


def _sites(markers: Sequence[Vector]) -> dict[str, Vector]:
    return {TIP: (0.0, 0.0, 0.0)} | {f"marker{i}": place for i, place in enumerate(markers)}


def _add_link(parent: mujoco.MjsBody, link: Link, offset: float, end_mass: float) -> mujoco.MjsBody:
    mass, centre, inertia = _inertial(link, end_mass)
    turn = _turn_about_x(link.angle)
    body = parent.add_body(name=link.name, pos=[offset, 0.0, 0.0])
    body.explicitinertial, body.mass, body.ipos = True, mass, [centre, 0.0, 0.0]
    body.inertia, body.iquat = inertia, turn
    for hinge in link.hinges:
        joint = body.add_joint(name=hinge.name, type=_JOINT_TYPES[hinge.kind], axis=hinge.axis)
        joint.stiffness[0], joint.damping[0] = hinge.stiffness, hinge.damping
    # The box is there to be looked at: mass and inertia are explicit, because of the point mass.
    size = [link.length / 2.0, link.width / 2.0, link.thickness / 2.0]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=[size[0], 0.0, 0.0], quat=turn, contype=0, conaffinity=0
    )
    return body


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
    """Turn ``model`` into that of another mechanism with the same links, joints and markers.

    Some 20 times cheaper than compiling, which dominates a fit otherwise.  Everything that depends on
    a mechanism's numbers is written; ``data`` is scratch of the same sizes.
    """
    offset = 0.0
    for i, (link, end_mass) in enumerate(zip(mechanism.links, _end_masses(mechanism), strict=True)):
        mass, centre, inertia = _inertial(link, end_mass)
        turn, half = _turn_about_x(link.angle), link.length / 2.0
        model.body_pos[i + 1, 0] = offset
        model.body_mass[i + 1], model.body_ipos[i + 1, 0] = mass, centre
        model.body_inertia[i + 1], model.body_iquat[i + 1] = inertia, turn
        model.geom_size[i] = half, link.width / 2.0, link.thickness / 2.0
        model.geom_pos[i, 0], model.geom_quat[i] = half, turn
        offset = link.length
    hinges = mechanism.hinges
    model.jnt_axis[:] = [hinge.axis for hinge in hinges]
    model.jnt_stiffness[:] = mechanism.stiffness
    model.dof_damping[:] = [hinge.damping for hinge in hinges]
    model.site_pos[:] = list(_sites(markers).values())
    model.site_pos[:, 0] += offset
    mujoco.mj_setConst(model, data)
