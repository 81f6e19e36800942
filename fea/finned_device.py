"""A tube with fins as a case: one shell of three sheets, fins tied to the wall, the pinch, contact, the plate."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshQuad2

from fea.case import Case
from fea.chambers import ChamberRow
from fea.contact import ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.model import FeaModel
from fea.plate_edge import PlateEdge
from fea.problem import Problem
from fea.setting_up import Mesh
from fea.shell import Shell
from fea.surface import Surface
from fea.tendons import Ramp
from fea.ties import closest_points
from lab.experiments import FinPush, ShapePropagation
from lab.specimens import FinnedTube
from meshes.finned_tube import Body, fin_parameters, thickness_and_directors

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
    part: Shell
    problem: Problem
    drive: Ramp
    grip: Ints
    mirrors: str
    plate: PlateEdge | None = None
    walls: PlaneContact | SurfaceContact | None = None
    chambers: ChamberRow | None = None

    @property
    def copies(self) -> int:
        """How often what is modelled occurs in the device."""
        return 2 ** len(self.mirrors)

    def pinch_force(self, state: Array, t: float) -> float:
        """Force on the upper side of the whole device, N, downwards."""
        reaction = -float(self.problem.out_of_balance(state, t)[self.grip, 1].sum())
        return reaction * (2 if "x" in self.mirrors else 1)

    def approach(self, x: Array) -> float:
        """Of the crest lines' outside at mid-length, m."""
        moved = [side * float(x[nodes[0], 1]) for side, nodes in self._outer_crest.items()]
        return -(2 * moved[0] if "y" in self.mirrors else sum(moved))

    @cached_property
    def _outer_crest(self) -> dict[int, Ints]:
        """Nodes of the outside under the pinch's middle (1,) each."""
        result = {}
        for side, nodes in crest(self.part, self.specimen, "top").items():
            away = np.abs(self.part.points[nodes, 2] - self.specimen.length / 2)
            result[side] = nodes[[int(away.argmin())]]
        return result

    def pressure(self, t: float) -> float:
        """In the chambers, Pa."""
        return self.drive(t) if self.chambers is not None else 0.0

    def middle(self, x: Array, surface_nodes: Ints) -> Array:
        """Displacements (n, 3), m, of the middle surface."""
        return 0.5 * (x[2 * surface_nodes] + x[2 * surface_nodes + 1])

    # -- places on the middle surface ------------------------------------------------------------

    def nodes_of(self, body: Body) -> Ints:
        """Surface nodes of a sheet, ascending."""
        return np.unique(self.part.surface_cells[bodies(self.part)[body]])

    @cached_property
    def corner(self) -> Ints:
        """Surface node at P (1,)."""
        fin = self.nodes_of("fin")
        away = np.linalg.norm(self.part.mid[fin] - self.specimen.tip_corner, axis=1)
        return fin[[int(away.argmin())]]

    @cached_property
    def crown(self) -> Ints:
        """Surface nodes of the crown of the fin at +x, from crease to tip."""
        fin = self.nodes_of("fin")
        fin = fin[np.abs(self.part.mid[fin, 1]) < _NEAR * self.specimen.radius]
        return fin[np.argsort(self.part.mid[fin] @ self.specimen.fin_axis)]

    @cached_property
    def tip(self) -> Ints:
        """Surface nodes of the tip of the fin at +x, in order along y."""
        there = np.intersect1d(self.part.layer("tip", "bottom") // 2, self.nodes_of("fin"))
        return there[np.argsort(self.part.mid[there, 1])]

    def section(self, x: Array) -> Array:
        """x and y of the middle of the wall at mid-length (m, 2), m, all around, in order from +x."""
        nodes, shares, signs = self._ring
        now = self.part.mid[nodes] + self.middle(x, nodes.ravel()).reshape(*nodes.shape, 3)
        return np.einsum("mk,mkc->mc", shares, now)[:, :2] * signs

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
        sheet = Surface(self.part.surface_cells[bodies(self.part)["tube"]])
        nodes, shares = closest_points(sheet, self.part.mid, places, 0.01 * specimen.radius)
        return nodes, shares, signs

    def gap(self, x: Array) -> float:
        """Smallest distance of the inner walls under the crest lines, m."""
        height = (self.part.points + x[: self.part.nodes])[:, 1]
        upper = float(height[self._inner_crest[1]].min())
        return 2 * upper if "y" in self.mirrors else upper - float(height[self._inner_crest[-1]].max())

    @cached_property
    def _inner_crest(self) -> dict[int, Ints]:
        return crest(self.part, self.specimen, "bottom")


def bodies(part: Shell) -> dict[Body, Ints]:
    """Elements of every sheet."""
    return {name: np.asarray(cells) for name, cells in (part.mesh.subdomains or {}).items()}


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
    part = sheets(specimen, model, mesh)
    mirrors = "".join(a for a, edge in (("x", "crest"), ("y", "side")) if edge in (mesh.boundaries or {}))
    case = Case(part, solver=model.linear_solver)
    tied = _tie_fins(case, part)
    _mirror(case, part, mirrors, tied)
    drive, grip = Ramp(), _grip(part, specimen, experiment.pinched_length(specimen))
    _hold(case, part, mirrors, grip)
    if experiment.drive == "pressure" and "y" not in mirrors:
        raise ValueError("chambers are inflated alike above and below: take a quarter or a half (y >= 0)")
    if experiment.drive == "pinch":
        for side, nodes in grip.items():
            case.fix(nodes, "y", to=-0.5 * side, ramp=drive)
    device: dict[str, Any] = {}
    _add_contact(case, part, specimen, experiment, mirrors, device)
    if experiment.drive == "pressure":
        _inflate(case, part, specimen, model, drive, device)
    problem = case.problem(seconds)
    return Device(specimen, part, problem, drive, grip[1], mirrors, **device)


def sheets(specimen: FinnedTube, model: FeaModel, mesh: MeshQuad2) -> Shell:
    """Tube and fins as one shell of unconnected sheets."""
    points, cells = mesh.doflocs.T, mesh.dofs.element_dofs.T
    thickness, directions = np.empty(len(points)), np.empty((len(points), 3))
    for body, elements in (mesh.subdomains or {}).items():
        nodes = np.unique(cells[elements])
        thickness[nodes], directions[nodes] = thickness_and_directors(specimen, points[nodes], body)
    steady = max(specimen.material.viscous_time, model.steadying)
    material = specimen.material.model_copy(update={"viscous_time": steady})
    return Shell(mesh, thickness, material, directors=directions)


def _tie_fins(case: Case, part: Shell) -> Ints:
    """Nodes of both layers of the creases, which now ride on the outside of the tube."""
    outside = Surface(part.surface("top").facets[bodies(part)["tube"]])
    crease = part.layer("crease")
    case.tie(crease, outside)
    return crease


def _mirror(case: Case, part: Shell, mirrors: str, tied: Ints) -> None:
    points, size = part.points, float(np.ptp(part.points[:, 2]))
    for axis in mirrors:
        there = np.flatnonzero(np.abs(points[:, "xyz".index(axis)]) < _NEAR * size)
        # Tied nodes keep to the plane with what they are tied to.
        case.fix(np.setdiff1d(there, tied), axis)


def _hold(case: Case, part: Shell, mirrors: str, grip: dict[int, Ints]) -> None:
    """Keep the device where it is by the crest lines, without force while it is symmetric."""
    for nodes in grip.values():
        heights = part.points[nodes, 2]
        case.fix(nodes[[int(np.abs(heights - heights.mean()).argmin())]], "z")
        if "x" not in mirrors:
            case.fix(nodes, "x")


def _grip(part: Shell, specimen: FinnedTube, length: float) -> dict[int, Ints]:
    """Outer nodes of the crest lines above (1) and below (-1) that the pinch moves."""
    result = {}
    for side, nodes in crest(part, specimen, "top").items():
        away = np.abs(part.points[nodes, 2] - specimen.length / 2)
        result[side] = nodes[away <= length / 2 + _NEAR * specimen.radius]
        if len(result[side]) < 3:
            raise ValueError("the mesh has no nodes on the crest where the pinch is: make it by meshes.finned_tube")
    return result


def crest(part: Shell, specimen: FinnedTube, layer: str) -> dict[int, Ints]:
    """Nodes of a layer of the wall on the crest lines above (1) and below (-1)."""
    nodes = np.unique(part.surface(layer).facets[bodies(part)["tube"]])
    on = nodes[np.abs(part.points[nodes, 0]) < _NEAR * specimen.radius]
    sides = {side: on[side * part.points[on, 1] > 0] for side in (1, -1)}
    return {side: found for side, found in sides.items() if len(found)}


def _add_contact(
    case: Case, part: Shell, specimen: FinnedTube, experiment: FinExperiment, mirrors: str, made: dict[str, Any]
) -> None:
    """What may touch: the plate, inner walls, fins and tube; terms come into ``made`` as they are made."""

    def add(name: str, make: Callable[[Array], Any]) -> None:
        def remembered(points: Array) -> Any:
            made[name] = make(points)
            return made[name]

        case.add(remembered)

    if isinstance(experiment, FinPush):
        add("plate", lambda points: _plate(part, specimen, experiment, points))
    pressed = experiment.drive == "pressure"
    left = 0.0 if pressed else 2 * specimen.inner_radius - experiment.travel
    if left > _CLOSE * specimen.wall:
        return
    law, upper = ContactLaw(specimen.material.youngs_modulus, specimen.wall), _standing(part, 1.0)
    if "y" in mirrors:
        # Chambers in the way meet their images before the walls do.
        height = specimen.chambers.height if pressed else 0.0
        plane = Plane(np.array([0.0, height, 0.0]), np.array([0.0, 1.0, 0.0]))
        add("walls", lambda points: PlaneContact(upper, points, plane, law))
    else:
        add("walls", lambda points: SurfaceContact(upper, _standing(part, -1.0), points, law))


def _inflate(case: Case, part: Shell, specimen: FinnedTube, model: FeaModel, drive: Ramp, made: dict[str, Any]) -> None:
    """The chambers of the upper side, as far as the part has them."""
    chambers, inside = specimen.chambers, specimen.inner_radius
    half = chambers.number * chambers.pitch(inside) / 2
    quarter = 0.5 if "crest" in (part.mesh.boundaries or {}) else 1.0
    wall = chambers.wall
    cavity = (chambers.width - 2 * wall) * (chambers.height - wall) * (chambers.length - 2 * wall)

    def within(places: Array) -> NDArray[np.bool_]:
        angle, radius = np.arctan2(places[:, 1], places[:, 0]), np.hypot(places[:, 0], places[:, 1])
        near = np.abs(places[:, 2] - specimen.length / 2) < chambers.length / 2
        return (np.abs(angle - np.pi / 2) < half) & near & (radius < specimen.radius)

    def across(places: Array) -> Array:
        size = np.hypot(places[:, 0], places[:, 1])
        return np.column_stack([-places[:, 1] / size, places[:, 0] / size, np.zeros(len(places))])

    def row(points: Array) -> ChamberRow:
        stiffness = model.chamber_tops * specimen.material.youngs_modulus * wall
        made["chambers"] = ChamberRow(
            part, within, chambers.height, quarter * chambers.number * cavity, stiffness, across, drive
        )
        return made["chambers"]

    case.add(row)


def _standing(part: Shell, side: float) -> Surface:
    """Inside of the tube above (1) or below (-1), without what stands upright beside y = 0."""
    inside = part.surface("bottom").facets[bodies(part)["tube"]]
    middles = part.points[inside].mean(axis=1)
    return Surface(inside[side * middles[:, 1] > 0.6 * np.abs(middles[:, 0])])


def _plate(part: Shell, specimen: FinnedTube, push: FinPush, points: Array) -> PlateEdge:
    fin = np.unique(part.surface_cells[bodies(part)["fin"]])
    psi, along = fin_parameters(specimen, part.mid[fin])
    order = np.lexsort((along, np.round(psi / _NEAR)))
    _, counts = np.unique(np.round(psi / _NEAR), return_counts=True)
    columns = fin[order].reshape(len(counts), -1)
    angles = psi[order].reshape(columns.shape)[:, 0]
    shares = np.gradient(angles)
    shares[[0, -1]] /= 2
    face = 2 * columns + (push.sense == "equal")
    return PlateEdge(
        face, shares / specimen.fin_arc, along[order].reshape(columns.shape), points,
        _PLATE * specimen.material.youngs_modulus * specimen.fin_thickness, specimen.fin_thickness,
    )  # fmt: skip
