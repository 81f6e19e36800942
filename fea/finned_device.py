"""A tube with fins as a case: three sheets, fins tied to the wall, the pinch, contact, the plate.

The tube is a shell.  Fins are hexahedra by default: a shell's transverse shear is constant through its thickness, which
oblique directors at a fin's root turn into a joint that gives way (``tests/verification/test_finned_joint.py``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshQuad2

from fea.case import Case
from fea.chambers import ChamberRow, Walls
from fea.contact import ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.model import FeaModel
from fea.parts import Deformable
from fea.plate_edge import PlateEdge
from fea.problem import Problem
from fea.setting_up import Mesh
from fea.sheet import Face, Sheet
from fea.shell import Shell
from fea.surface import Surface
from fea.tendons import Ramp
from fea.ties import closest_points
from lab.experiments import FinPush, ShapePropagation
from lab.specimens import FinnedTube
from meshes.finned_tube import BODIES, Body, fin_middle, fin_parameters, half_thickness
from meshes.layered import body_alone

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
FinExperiment = ShapePropagation | FinPush

#: Distance over the tube's radius within which a node lies on a plane or line.
_NEAR = 1e-6
#: Inner walls that come nearer than so many walls to one another get a contact.
_CLOSE = 4.0
#: Stiffness of the plate called rigid, over E t: thousands of times that of the fin.
_PLATE = 3.0
#: Places around the section at mid-length.
_AROUND = 64


@dataclass(repr=False)
class Device:
    """What the stages of an experiment work with.

    Attributes
    ----------
    sheets
        Tube and fins, in the order of their nodes.
    drive
        Approach of top and bottom, m, or pressure, Pa, over time.
    grip
        Nodes of the upper crest line that the pinch moves.
    walls
        Contact of the inner walls, or of the chambers on them, where they can meet.
    chambers
        Where they are inflated.
    mirrors
        Axes across planes of symmetry that leave a part: some of "xy".
    """

    specimen: FinnedTube
    sheets: dict[Body, Sheet]
    problem: Problem
    drive: Ramp
    grip: Ints
    mirrors: str
    plate: PlateEdge | None = None
    walls: PlaneContact | SurfaceContact | None = None
    chambers: ChamberRow | None = None

    @property
    def tube(self) -> Sheet:
        """The tube's wall."""
        return self.sheets["tube"]

    @property
    def fin(self) -> Sheet:
        """The fin at +x."""
        return self.sheets["fin"]

    @property
    def parts(self) -> list[Deformable]:
        """Of the sheets, in order."""
        return [sheet.part for sheet in self.sheets.values()]

    @property
    def points(self) -> Array:
        """All nodes at rest (N, 3), m."""
        return self.problem.points

    @property
    def copies(self) -> int:
        """How often what is modelled occurs in the device."""
        return 2 ** len(self.mirrors)

    def pinch_force(self, state: Array, t: float) -> float:
        """Force on the upper side of the whole device, N, downwards."""
        reaction = -float(self.problem.out_of_balance(state, t)[self.grip, 1].sum())
        return reaction * (2 if "x" in self.mirrors else 1)

    @property
    def pinched_length(self) -> float:
        """What of the crest the pinch holds, m: between the last nodes within the length that was asked for."""
        return float(np.ptp(self.points[self.grip, 2]))

    def approach(self, x: Array) -> float:
        """Of the crest lines' outside at mid-length, m."""
        moved = [side * float(x[node, 1]) for side, node in self._outer_crest.items()]
        return -(2 * moved[0] if "y" in self.mirrors else sum(moved))

    @cached_property
    def _outer_crest(self) -> dict[int, int]:
        """Node of the outside under the pinch's middle, by side."""
        result = {}
        for side, nodes in crest(self.tube, self.points, "upper").items():
            away = np.abs(self.points[nodes, 2] - self.specimen.length / 2)
            result[side] = int(nodes[away.argmin()])
        return result

    def pressure(self, t: float) -> float:
        """In the chambers, Pa."""
        return self.drive(t) if self.chambers is not None else 0.0

    # -- places on the middle surfaces -----------------------------------------------------------

    @cached_property
    def corner(self) -> Ints:
        """Surface node of the fin at P (1,)."""
        away = np.linalg.norm(self.fin.mid - self.specimen.tip_corner, axis=1)
        return np.array([away.argmin()])

    @cached_property
    def crown(self) -> Ints:
        """Surface nodes of the crown of the fin at +x, from crease to tip."""
        on = np.flatnonzero(np.abs(self.fin.mid[:, 1]) < _NEAR * self.specimen.radius)
        return on[np.argsort(self.fin.mid[on] @ self.specimen.fin_axis)]

    @cached_property
    def tip(self) -> Ints:
        """Surface nodes of the tip of the fin at +x, in order along y."""
        there = self.fin.edge("tip")
        return there[np.argsort(self.fin.mid[there, 1])]

    def section(self, x: Array) -> Array:
        """x and y of the middle of the wall at mid-length (m, 2), m, all around, in order from +x."""
        nodes, shares, signs = self._ring
        return np.einsum("mk,mkc->mc", shares, self.tube.now(x, nodes))[:, :2] * signs

    @cached_property
    def _ring(self) -> tuple[Ints, Array, Array]:
        angle = 2 * np.pi * np.arange(_AROUND) / _AROUND
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        signs = np.where(ring < -_NEAR, -1.0, 1.0)
        for axis, name in enumerate("xy"):
            if name not in self.mirrors:
                signs[:, axis] = 1.0
        specimen = self.specimen
        places = np.column_stack([specimen.mid_radius * ring * signs, np.full(_AROUND, specimen.length / 2)])
        nodes, shares = closest_points(Surface(self.tube.cells), self.tube.mid, places, 0.01 * specimen.radius)
        return nodes, shares, signs

    def gap(self, x: Array) -> float:
        """Smallest distance of the inner walls under the crest lines, m."""
        height = (self.points + x[: len(self.points)])[:, 1]
        upper = float(height[self._inner_crest[1]].min())
        return 2 * upper if "y" in self.mirrors else upper - float(height[self._inner_crest[-1]].max())

    @cached_property
    def _inner_crest(self) -> dict[int, Ints]:
        return crest(self.tube, self.points, "lower")


def set_up(
    specimen: FinnedTube, experiment: FinExperiment, model: FeaModel, mesh: Mesh, seconds: float = 0.0
) -> Device:
    """The device of an experiment, at rest.

    The part that ``mesh`` shows is taken: its edges ``crest`` and ``side`` are planes of symmetry.

    Parameters
    ----------
    seconds
        Time that passes while the parameter goes by 1, for viscous stress; 0: none.

    Raises
    ------
    ValueError
        A mesh of another element or specimen; a fin that is pushed by itself and has a mirror image.
    """
    if not isinstance(mesh, MeshQuad2) or model.element != "shell" or "fin" not in (mesh.subdomains or {}):
        raise ValueError("a tube with fins is solved as a shell: take a mesh by meshes.finned_tube and element 'shell'")
    if why := experiment.misfit(specimen):
        raise ValueError(why)
    specimen = model.applied_to(specimen)
    sheets = make_sheets(specimen, model, mesh)
    tube, fin = sheets["tube"], sheets["fin"]
    mirrors = "".join(a for a, edge in (("x", "crest"), ("y", "side")) if edge in (mesh.boundaries or {}))
    case = Case(*(sheet.part for sheet in sheets.values()), solver=model.linear_solver)
    tied = _tie_fins(case, sheets)
    _mirror(case, mirrors, tied)
    drive, grip = Ramp(), _grip(tube, case.points, specimen, experiment.pinched_length(specimen))
    _hold(case, mirrors, grip)
    if experiment.drive == "pressure" and "y" not in mirrors:
        raise ValueError("chambers are inflated alike above and below: take a quarter or a half (y >= 0)")
    if experiment.drive == "pinch":
        for side, nodes in grip.items():
            case.fix(nodes, "y", to=-0.5 * side, ramp=drive)
    device: dict[str, Any] = {}
    if isinstance(experiment, FinPush):
        _add(case, device, "plate", lambda points: _plate(fin, specimen, experiment, points))
    _add_walls(case, tube, specimen, experiment, mirrors, device)
    if experiment.drive == "pressure":
        _add(case, device, "chambers", lambda points: _chambers(tube, specimen, model, drive))
    problem = case.problem(seconds)
    return Device(specimen, sheets, problem, drive, grip[1], mirrors, **device)


def make_sheets(specimen: FinnedTube, model: FeaModel, mesh: MeshQuad2) -> dict[Body, Sheet]:
    """Tube and fins as unconnected parts, tube first; fins of ``model.fin_element``."""
    steady = max(specimen.material.viscous_time, model.steadying)
    material = specimen.material.model_copy(update={"viscous_time": steady})
    result: dict[Body, Sheet] = {}
    nodes = 0
    for body in (name for name in BODIES if name in (mesh.subdomains or {})):
        surface = body_alone(mesh, body)
        half = half_thickness(specimen, surface.doflocs.T, body)
        if body == "tube":
            result[body] = Sheet.make(surface, half, material, "shell", nodes)
        else:
            middle = fin_middle(specimen, surface)
            result[body] = Sheet.make(surface, half, material, model.fin_element, nodes, middle)
        nodes += result[body].part.nodes
    return result


def _tie_fins(case: Case, sheets: dict[Body, Sheet]) -> Ints:
    """Nodes of the creases through the thickness, which now ride on the outside of the tube."""
    fins = [sheet for body, sheet in sheets.items() if body != "tube"]
    crease = np.concatenate([fin.through[fin.edge("crease")].ravel() for fin in fins])
    case.tie(crease, sheets["tube"].face("upper"))
    return crease


def _mirror(case: Case, mirrors: str, tied: Ints) -> None:
    points, size = case.points, float(np.ptp(case.points[:, 2]))
    for axis in mirrors:
        there = np.flatnonzero(np.abs(points[:, "xyz".index(axis)]) < _NEAR * size)
        # Tied nodes keep to the plane with what they are tied to.
        case.fix(np.setdiff1d(there, tied), axis)


def _hold(case: Case, mirrors: str, grip: dict[int, Ints]) -> None:
    """Keep the device where it is by the crest lines, without force while it is symmetric."""
    for nodes in grip.values():
        heights = case.points[nodes, 2]
        case.fix(nodes[[int(np.abs(heights - heights.mean()).argmin())]], "z")
        if "x" not in mirrors:
            case.fix(nodes, "x")


def _grip(tube: Sheet, points: Array, specimen: FinnedTube, length: float) -> dict[int, Ints]:
    """Outer nodes of the crest lines above (1) and below (-1) that the pinch moves."""
    result = {}
    for side, nodes in crest(tube, points, "upper").items():
        away = np.abs(points[nodes, 2] - specimen.length / 2)
        result[side] = nodes[away <= length / 2 + _NEAR * specimen.radius]
        if len(result[side]) < 3:
            raise ValueError("the mesh has no nodes on the crest where the pinch is: make it by meshes.finned_tube")
    return result


def crest(tube: Sheet, points: Array, face: Face) -> dict[int, Ints]:
    """Nodes of a face of the wall on the crest lines above (1) and below (-1); ``points`` of the case (N, 3), m."""
    nodes = tube.face(face).nodes
    on = nodes[np.abs(points[nodes, 0]) < _NEAR * float(np.ptp(tube.mid[:, 2]))]
    sides = {side: on[side * points[on, 1] > 0] for side in (1, -1)}
    return {side: found for side, found in sides.items() if len(found)}


def _add(case: Case, made: dict[str, Any], name: str, make: Callable[[Array], Any]) -> None:
    """A term that comes into ``made`` as it is made."""

    def remembered(points: Array) -> Any:
        made[name] = make(points)
        return made[name]

    case.add(remembered)


def _add_walls(
    case: Case, tube: Sheet, specimen: FinnedTube, experiment: FinExperiment, mirrors: str, made: dict[str, Any]
) -> None:
    """Contact of the inner walls, where they come near."""
    pressed = experiment.drive == "pressure"
    left = 0.0 if pressed else 2 * specimen.inner_radius - experiment.travel
    if left > _CLOSE * specimen.wall:
        return
    law, upper = ContactLaw(specimen.material.youngs_modulus, specimen.wall), _standing(tube, 1.0)
    if "y" in mirrors:
        # Chambers in the way see to themselves.
        plane = Plane(np.zeros(3), np.array([0.0, 1.0, 0.0]))
        _add(case, made, "walls", lambda points: PlaneContact(upper, points, plane, law))
    else:
        _add(case, made, "walls", lambda points: SurfaceContact(upper, _standing(tube, -1.0), points, law))


def _chambers(tube: Sheet, specimen: FinnedTube, model: FeaModel, drive: Ramp) -> ChamberRow:
    """The chambers of the upper side, as far as the part has them."""
    chambers, inside = specimen.chambers, specimen.inner_radius
    half = chambers.number * chambers.pitch(inside) / 2
    quarter = 0.5 if "crest" in (tube.mesh.boundaries or {}) else 1.0
    wall = chambers.wall
    cavity = (chambers.width - 2 * wall) * (chambers.height - wall) * (chambers.length - 2 * wall)

    def within(places: Array) -> NDArray[np.bool_]:
        angle = np.arctan2(places[:, 1], places[:, 0])
        return (np.abs(angle - np.pi / 2) < half) & (np.abs(places[:, 2] - specimen.length / 2) < chambers.length / 2)

    def across(places: Array) -> Array:
        size = np.hypot(places[:, 0], places[:, 1])
        return np.column_stack([-places[:, 1] / size, places[:, 0] / size, np.zeros(len(places))])

    assert isinstance(tube.part, Shell)
    count = quarter * chambers.number
    sides = 2 * count * wall * chambers.height * chambers.length
    touching = chambers.width / (chambers.width + chambers.gap)
    walls = Walls(
        specimen.material.youngs_modulus, wall, model.chamber_tops, model.chamber_walls, touching, sides
    )  # fmt: skip
    return ChamberRow(tube.part, within, chambers.height, count * cavity, walls, across, drive)


def _standing(tube: Sheet, side: float) -> Surface:
    """Inside of the tube above (1) or below (-1), without what stands upright beside y = 0."""
    middles = tube.mid[tube.cells].mean(axis=1)
    return tube.face("lower", np.flatnonzero(side * middles[:, 1] > 0.6 * np.abs(middles[:, 0])))


def _plate(fin: Sheet, specimen: FinnedTube, push: FinPush, points: Array) -> PlateEdge:
    psi, along = fin_parameters(specimen, fin.mid)
    order = np.lexsort((along, np.round(psi / _NEAR)))
    _, counts = np.unique(np.round(psi / _NEAR), return_counts=True)
    columns = order.reshape(len(counts), -1)
    angles = psi[columns[:, 0]]
    shares = np.gradient(angles)
    shares[[0, -1]] /= 2
    face = fin.through[columns, -1 if push.sense == "equal" else 0]
    return PlateEdge(
        face, shares / specimen.fin_arc, along[columns], points,
        _PLATE * specimen.material.youngs_modulus * specimen.fin_thickness, specimen.fin_thickness,
    )  # fmt: skip
