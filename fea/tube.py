"""A pinched tube as a case: wall, pads, block, tendons, contact of the inner wall."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation
from skfem import MeshQuad2

from fea.body import Body
from fea.case import Case
from fea.contact import ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.model import FeaModel
from fea.parts import Deformable
from fea.problem import Problem
from fea.setting_up import Mesh
from fea.shell import Shell
from fea.surface import Surface
from fea.tendons import BlockLoad, Line, Tendons
from lab.experiments import Pinch, PinchedBending, ShapeRecovery
from lab.specimens import PinchedTube
from meshes.tube import pad_share, radial_directions, wall_thickness

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
TubeExperiment = Pinch | PinchedBending | ShapeRecovery

#: Stiffness of tendons over E t^2 / R: stiff beside the section, which they flatten by millimetres.
_TENDON = 30.0
#: Width, over the radius, in which a tendon becomes taut.
_SLACK = 1e-4
#: Stiffness of a pusher called rigid, over E t: some hundred times that of a thin tube.
_PUSHER = 30.0
#: Gap over the wall beyond which none is told.
_FAR = 3.0
#: Contact of the wall: multipliers of a tighter law do not settle where stiff pads meet on single points.
_CONTACT = {"tolerance": 0.05, "factor": 20.0}


@dataclass(repr=False)
class Tube:
    """What the stages of an experiment work with.

    Attributes
    ----------
    ring
        Inner and outer node of the mid-length section (m, 2), in order around.
    eighth
        Three mirrors leave an eighth: z >= length/2, x >= 0, y >= 0.
    """

    specimen: PinchedTube
    part: Deformable
    problem: Problem
    tendons: Tendons
    block_load: BlockLoad
    contact: SurfaceContact | PlaneContact
    ring: Ints
    eighth: bool

    @property
    def lines(self) -> int:
        """Number of lines between pads that are modelled: of an eighth the first alone."""
        return 1 if self.eighth else self.specimen.pairs

    @property
    def meeting(self) -> float:
        """Shortening, m, at which the pads of one pair would just meet."""
        return 2 * (self.specimen.radius - self.specimen.wall - self.specimen.pad_height)

    @property
    def copies(self) -> int:
        """How often what is modelled occurs in the device."""
        return 8 if self.eighth else 1

    def pose(self, state: Array, t: float) -> Array:
        """Of the distal block's face (6,), m and rotation vector, rad, as seen from the proximal one."""
        block, pose = self.problem.links.rigid[0], self.problem.links.pose(0, state, t)
        turn = Rotation.from_matrix(block.turn(pose)).as_rotvec()
        return np.concatenate([pose[:3] * (2.0 if self.eighth else 1.0), turn])

    def section(self, x: Array) -> Array:
        """x and y of the middle of the wall at mid-length (m, 2), m."""
        places = (self.part.points + x[: self.part.nodes])[self.ring].mean(axis=1)[:, :2]
        if not self.eighth:
            return places
        half = np.concatenate([places, places[-2::-1] * [-1, 1]])
        return np.concatenate([half, half[-2:0:-1] * [1, -1]])

    def touch(self, x: Array) -> tuple[float, float]:
        """Smallest gap between inner walls, m, infinite where far, and contact force, N."""
        found = self.contact.report(x)
        # A mirror is half-way to the other wall, and four eighths meet there.
        width, meeting = (2, 4) if self.eighth else (1, 1)
        gap, force = width * found["smallest gap [m]"], meeting * found["normal force [N]"]
        return gap if gap < _FAR * self.specimen.wall else np.inf, force

    def flexibility(self, state: Array, t: float) -> tuple[Array, int]:
        """Change of the pose by a small wrench at the face's centre (6, 6), and negative eigenvalues, -1 unknown.

        From the elastic tangent of an accepted increment, its viscous stress kept as it is, the tendons' lengths
        held, nothing else on the block.  Turns are about the axes of space.  NaN of an eighth, which knows one motion.
        """
        x, links = self.problem.displacement(state, t), self.problem.links
        with self.tendons.kept(x, t), self.block_load.loose():
            self.problem.linearise(state, t)
        count = self.problem.linear.negative_pivots
        negative = -1 if count is None else count
        if self.eighth:
            return np.full((6, 6), np.nan), negative
        place = links.pose_place(0)
        unit = np.zeros((links.unknowns, 6))
        unit[place] = np.eye(6)
        turning = block_diag(np.eye(3), links.rigid[0].spin(links.pose(0, state, t)[3:]))
        flexibility = turning @ self.problem.solve(unit)[place] @ turning.T
        return (flexibility + flexibility.T) / 2, negative


def set_up(specimen: PinchedTube, experiment: TubeExperiment, model: FeaModel, mesh: Mesh) -> Tube:
    """The tube of an experiment, at rest; time runs in s.

    Raises
    ------
    ValueError
        Another element's mesh; an eighth for what lacks its symmetry.
    """
    if isinstance(mesh, MeshQuad2) != (model.element == "shell"):
        raise ValueError(f"a {type(mesh).__name__} is no mesh for the element {model.element!r} of the model")
    specimen = model.applied_to(specimen)
    eighth = "crest" in (mesh.boundaries or {})
    if eighth:
        _check_symmetry(specimen, experiment)
    part = _wall(specimen, experiment, model, mesh)
    case = Case(part, solver=model.linear_solver)
    block = case.rigid("block", "tip", at=(0.0, 0.0, specimen.length))
    if eighth:
        case.symmetry("middle", "z").symmetry("crest", "x").symmetry("side", "y")
        block.hold("x", "y", "rx", "ry", "rz")
    else:
        case.fix("root")
    ring = _ring(part, specimen)
    made: dict[str, Any] = {}

    def tendons(points: Array) -> Tendons:
        stiffness = _TENDON * specimen.material.youngs_modulus * specimen.wall**2 / specimen.radius
        lines = _lines(part, specimen, ring, eighth)
        made["tendons"] = Tendons(points, lines, stiffness, _SLACK * specimen.radius, 1 / 8 if eighth else 1.0)
        return made["tendons"]

    def block_load(points: Array) -> BlockLoad:
        direction, place = getattr(experiment, "direction", 0.0), getattr(experiment, "place", 0.0)
        rig = getattr(experiment, "rig_stiffness", None) or _PUSHER * specimen.material.youngs_modulus * specimen.wall
        # The face's centre and another point of the axis, which the block carries along.
        centre, beyond = block.nodes[0], block.nodes[-1]
        share = place / (points[beyond] - points[centre])[2]
        along = np.array([np.cos(direction), np.sin(direction), 0.0])
        made["load"] = BlockLoad(np.array([centre, beyond]), np.array([1.0 - share, share]), along, rig)
        return made["load"]

    def contact(points: Array) -> SurfaceContact | PlaneContact:
        made["contact"] = _contact(part, specimen, model, points, eighth)
        return made["contact"]

    case.add(tendons).add(block_load).add(contact)
    if model.outer_contact and not eighth:
        case.add(lambda points: _outside(part, specimen, model, points))
    problem = case.problem(seconds=1.0)
    return Tube(specimen, part, problem, made["tendons"], made["load"], made["contact"], ring, eighth)


def _check_symmetry(specimen: PinchedTube, experiment: TubeExperiment) -> None:
    shares = experiment.shares(specimen.pairs)
    if not isinstance(experiment, Pinch) or shares[0] == 0 or shares[1:].any():
        raise ValueError("an eighth of the tube serves a Pinch by the first pair alone: take the whole mesh")


def _wall(specimen: PinchedTube, experiment: TubeExperiment, model: FeaModel, mesh: Mesh) -> Deformable:
    shortest = min(experiment.duration, getattr(experiment, "bend_duration", np.inf))
    steady = max(specimen.material.viscous_time, model.steadying * shortest)
    material = specimen.material.model_copy(update={"viscous_time": steady})
    points, cells = mesh.doflocs.T, mesh.dofs.element_dofs.T
    stiffening = np.where(pad_share(specimen, points[cells[:, -1]]) > 0.99, specimen.pad_stiffening, 1.0)
    if isinstance(mesh, MeshQuad2):
        thickness, directions = wall_thickness(specimen, points), radial_directions(specimen, points)
        return Shell(mesh, thickness, material, directors=directions, stiffening=stiffening)
    return Body(mesh, material, stiffening=stiffening)


def _ring(part: Deformable, specimen: PinchedTube) -> Ints:
    points = part.points
    there = np.flatnonzero(np.abs(points[:, 2] - specimen.length / 2) < 1e-6 * specimen.length)
    angle, radius = np.arctan2(points[there, 1], points[there, 0]), np.hypot(points[there, 0], points[there, 1])
    spoke = np.round(angle / 1e-6).astype(np.int64)
    spoke[spoke == -round(np.pi / 1e-6)] *= -1
    order = np.lexsort((radius, spoke))
    _, first, counts = np.unique(spoke[order], return_index=True, return_counts=True)
    return there[np.stack([order[first], order[first + counts - 1]], axis=1)]


def _lines(part: Deformable, specimen: PinchedTube, ring: Ints, eighth: bool) -> list[Line]:
    middles = part.points[ring].mean(axis=1)
    angles = np.arctan2(middles[:, 1], middles[:, 0])

    def pad(angle: float) -> Ints:
        off = np.abs((angles - angle + np.pi) % (2 * np.pi) - np.pi)
        if off.min() > 1e-3:
            raise ValueError(f"the mesh has no node on the pad at {np.rad2deg(angle):.6g} deg: make it by meshes.tube")
        return ring[int(off.argmin())]

    directions, pairs = specimen.pad_directions(), specimen.pairs
    if eighth:
        nodes = pad(directions[0])
        line = Line(nodes, np.full(len(nodes), 2 / len(nodes)), np.array([0.0, 0.0, specimen.length]))
        return [line]
    result = []
    for k in range(pairs):
        one, other = pad(directions[k]), pad(directions[k + pairs])
        weights = np.concatenate([np.full(len(one), 1 / len(one)), np.full(len(other), -1 / len(other))])
        result.append(Line(np.concatenate([one, other]), weights, np.zeros(3)))
    return result


def _law(part: Deformable, specimen: PinchedTube, model: FeaModel) -> ContactLaw:
    return ContactLaw(part.material.youngs_modulus, specimen.wall, model.friction, **_CONTACT)


def _outside(part: Deformable, specimen: PinchedTube, model: FeaModel, points: Array) -> SurfaceContact:
    """Of the outer wall with itself: a tube folded far meets itself outside too."""
    outside = part.surface("top" if isinstance(part, Shell) else "outside")
    return SurfaceContact(outside, outside, points, _law(part, specimen, model))


def _contact(
    part: Deformable, specimen: PinchedTube, model: FeaModel, points: Array, eighth: bool
) -> SurfaceContact | PlaneContact:
    """Of the inner wall with itself, or with the plane half-way to its image."""
    law = _law(part, specimen, model)
    inside = part.surface("bottom" if isinstance(part, Shell) else "inside")
    if not eighth:
        return SurfaceContact(inside, inside, points, law)
    # The other wall is the image in y = 0; what stands upright beside that plane cannot meet its image.
    middles = points[inside.facets].mean(axis=1)
    upper = Surface(inside.facets[middles[:, 1] > 0.5 * middles[:, 0]])
    return PlaneContact(upper, points, Plane(np.zeros(3), np.array([0.0, 1.0, 0.0])), law)
