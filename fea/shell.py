"""A thin deformable body: mid-surface, thickness, and the 18-node solid shell on them."""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray
from skfem import ElementQuad2, MeshQuad, MeshQuad2

from fea import shell_geometry as geometry
from fea import shell_kernels as kernels
from fea.coupled_mass import CoupledMass
from fea.coupled_scatter import coupled_scatter
from fea.materials import constants
from fea.pattern import Pattern
from fea.per_element import per_element
from fea.scatter import Scatter
from fea.surface import FROM_BELOW, Surface
from lab.materials import Material
from meshes.node_order import VTK_CELL_TYPE, vtk_reference

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Layer = Literal["top", "bottom", "both"]

_NO_PAST = np.zeros((1, kernels.TIES))
_NO_STEP = np.zeros((0, 3))
# Below this many elements starting threads costs more than they save.
_WORTH_THREADS = 200


@dataclass(frozen=True)
class Shell:
    """Total-Lagrangian solid shell: nine nodes on the top and nine on the bottom surface, displacements only.

    Surface node a has the nodes 2a at the bottom and 2a + 1 at the top.  The top is the side from which the
    nodes of an element run anticlockwise.

    Parameters
    ----------
    mesh
        Mid-surface, m: ``MeshQuad2`` whose ``doflocs`` are (3, n), or a plane ``MeshQuad`` or ``MeshQuad2`` in
        z = 0, whose top is its +z side.  Its named boundaries are the edges.
    thickness
        One number or one per surface node, m; measured along the element normals.
    material
        Law and constants.
    density
        Reference density, kg/m^3, one number or one per element; None takes the material's.
    directors
        Unit vectors (surface nodes, 3) along which to measure the thickness instead.
    shear_factor
        Share of the transverse shear stiffness: 5/6 allows for the parabola that the shear stress is.
    stiffening
        Factor on all stresses, one number or one per element: large for what is as good as rigid.
    coupled_mass
        Rigid mass that rides on an edge.

    Attributes
    ----------
    mid
        Surface nodes (surface nodes, 3), m.
    surface_cells
        Surface nodes of every element (elements, 9), ordered as ``ElementQuad2.doflocs``.
    points
        Nodes (nodes, 3), m.
    cells
        Nodes of every element (elements, 18), bottom and top in turn.

    Examples
    --------
    >>> plate = Shell(MeshQuad().refined(2), 0.01, Material())
    >>> plate.nodes, round(float(plate.volumes.sum()), 6)
    (162, 0.01)
    """

    mesh: MeshQuad | MeshQuad2
    thickness: float | Array
    material: Material
    density: float | Array | None = None
    directors: Array | None = None
    shear_factor: float = 5.0 / 6.0
    stiffening: float | Array = 1.0
    coupled_mass: CoupledMass | None = None
    kind: str = field(default="18-node solid shell", init=False)
    mid: Array = field(init=False)
    surface_cells: Ints = field(init=False)
    points: Array = field(init=False)
    cells: Ints = field(init=False)

    def __post_init__(self) -> None:
        mesh, mid = geometry.promoted(self.mesh)
        taken = sorted({"top", "bottom"} & set(mesh.boundaries or {}))
        if taken:
            raise ValueError(f"the edges {taken} must have other names: top and bottom are the sides of the shell")
        vectors = self._thickness_vectors(mesh, mid)
        surface_cells = np.ascontiguousarray(mesh.dofs.element_dofs.T, dtype=np.int64)
        geometry.check_jacobians(mid[surface_cells], 0.5 * vectors[surface_cells])
        for name, value in (
            ("mesh", mesh),
            ("mid", mid),
            ("surface_cells", surface_cells),
            ("points", np.stack([mid - 0.5 * vectors, mid + 0.5 * vectors], axis=1).reshape(-1, 3)),
            ("cells", (2 * surface_cells[:, :, None] + np.arange(2)).reshape(-1, 18)),
        ):
            object.__setattr__(self, name, value)

    def _thickness_vectors(self, mesh: MeshQuad2, mid: Array) -> Array:
        thickness = np.asarray(self.thickness, dtype=float)
        if thickness.shape not in ((), (len(mid),)):
            raise ValueError(f"thickness must be one number or {len(mid)}, one per surface node: {thickness.shape}")
        if not (np.isfinite(thickness) & (thickness > 0.0)).all():
            raise ValueError("thickness must be positive everywhere")
        thickness = np.broadcast_to(thickness, len(mid))
        if self.directors is None:
            return geometry.thickness_vectors(mesh, mid, thickness)
        geometry.check_edges(mesh)
        directors = np.asarray(self.directors, dtype=float)
        if directors.shape != mid.shape or not np.allclose(np.linalg.norm(directors, axis=1), 1.0, atol=1e-6):
            raise ValueError(f"directors must be unit vectors, one for each of the {len(mid)} surface nodes")
        return thickness[:, None] * directors

    @property
    def nodes(self) -> int:
        """Number of nodes; unknown ``3 node + axis`` moves ``node`` along ``axis``."""
        return len(self.points)

    @property
    def top(self) -> Ints:
        """Nodes of the top surface, in the order of ``mid``."""
        return np.arange(1, self.nodes, 2)

    @property
    def bottom(self) -> Ints:
        """Nodes of the bottom surface, in the order of ``mid``."""
        return np.arange(0, self.nodes, 2)

    # ------------------------------------------------------------------ names

    def boundary(self, name: str) -> Ints:
        """Nodes of both layers on a named edge, or of the ``top`` or ``bottom``; ascending."""
        if name == "top":
            return self.top
        return self.bottom if name == "bottom" else self.layer(name)

    def layer(self, name: str, side: Layer = "both") -> Ints:
        """Nodes of one side or of both on a named edge, ascending."""
        surface = np.unique(self._edge(name)[1])
        sides = {"bottom": [0], "top": [1], "both": [0, 1]}
        if side not in sides:
            raise ValueError(f"no side {side!r}; there are {', '.join(sides)}")
        return (2 * surface[:, None] + np.array(sides[side])).ravel()

    def _edge(self, name: str) -> tuple[Ints, Ints]:
        """Elements (m,) along a named edge, and the surface nodes (m, 3) of theirs on it: ends, middle."""
        names = self.mesh.boundaries or {}
        if name not in names:
            raise ValueError(f"the shell has no edge {name!r}; it has {sorted(names)}, and the sides top and bottom")
        facets = np.asarray(names[name], dtype=np.int64)
        elements = self.mesh.f2t[0, facets].astype(np.int64)
        local = np.argmax(self.mesh.t2f[:, elements] == facets, axis=0)
        # Number of an edge in scikit-fem's element to its ends and middle here.
        ends = np.sort(self.mesh.refdom.facets, axis=1)
        number = [int(np.flatnonzero((np.sort(geometry.EDGES[:, :2], axis=1) == pair).all(axis=1))[0]) for pair in ends]
        nodes = geometry.EDGES[np.array(number)[local]]
        return elements, self.surface_cells[elements[:, None], nodes]

    def _edge_faces(self, name: str) -> tuple[Ints, Ints, Array, Array]:
        """Elements (m,), nodes (m, 6), shape functions (6 points, 6) and areas (m, 6 points) of an edge's faces."""
        elements, surface = self._edge(name)
        (g3, w3), (g2, w2) = np.polynomial.legendre.leggauss(3), np.polynomial.legendre.leggauss(2)
        r, z, weights = np.repeat(g3, 2), np.tile(g2, 3), np.outer(w3, w2).ravel()
        along = np.stack([0.5 * r * (r - 1.0), 0.5 * r * (r + 1.0), 1.0 - r * r], axis=1)
        slopes = np.stack([r - 0.5, r + 0.5, -2.0 * r], axis=1)
        sides = 0.5 * np.stack([1.0 - z, 1.0 + z], axis=1)
        nodes = (2 * surface[:, :, None] + np.arange(2)).reshape(-1, 6)
        values, by_r = ((f[:, :, None] * sides[:, None, :]).reshape(6, 6) for f in (along, slopes))
        by_z = (along[:, :, None] * np.array([-0.5, 0.5])).reshape(6, 6)
        normals = np.cross(by_r @ self.points[nodes], by_z @ self.points[nodes])
        return elements, nodes, values, np.linalg.norm(normals, axis=2) * weights

    def shares(self, name: str) -> Array:
        """Area that every node carries of an edge's face, or of ``top`` or ``bottom``, (nodes,), m^2."""
        if name in ("top", "bottom"):
            return self.surface(name).areas(self.points)
        _, nodes, values, areas = self._edge_faces(name)
        result = np.zeros(self.nodes)
        np.add.at(result, nodes, areas @ values)
        return result

    def surface(self, name: str) -> Surface:
        """The ``top`` or ``bottom``, normals out of the shell."""
        if name == "top":
            return Surface(2 * self.surface_cells + 1)
        if name == "bottom":
            return Surface(2 * self.surface_cells[:, FROM_BELOW])
        raise ValueError(f"a shell has the surfaces top and bottom, not {name!r}: loads on an edge are forces")

    # ------------------------------------------------------------------ mechanics

    @cached_property
    def _scatter(self) -> Scatter:
        coupled = self.boundary(self.coupled_mass.boundary) if self.coupled_mass else np.zeros(0, dtype=np.int64)
        return coupled_scatter(self.cells, self.nodes, coupled)

    @cached_property
    def _assembly(self) -> tuple[Pattern, NDArray[np.int32]]:
        scatter = self._scatter
        return scatter.pattern, kernels.expanded(scatter.starts, scatter.widths, self.cells)

    @property
    def pattern(self) -> Pattern:
        """Sparsity of tangent and mass over all unknowns."""
        return self._scatter.pattern

    @cached_property
    def _nodal(self) -> tuple[Array, Array]:
        """Mid-surface and half thickness vectors at the nodes of every element, (elements, 9, 3) each."""
        ends = self.points[self.cells].reshape(-1, 9, 2, 3)
        return ends.mean(axis=2), 0.5 * (ends[:, :, 1] - ends[:, :, 0])

    @cached_property
    def _jacobians(self) -> Array:
        return geometry.jacobians(*self._nodal, geometry.quadrature()[0])

    @cached_property
    def _volumes(self) -> Array:
        """Volume that every quadrature point stands for (elements, points), m^3."""
        return np.asarray(np.linalg.det(self._jacobians) * geometry.quadrature()[1])

    @cached_property
    def _law(self) -> tuple[int, Array]:
        return constants(self.material)

    @cached_property
    def _elements(self) -> kernels.Elements:
        middle, half = self._nodal
        tables, frames = geometry.tables(), geometry.local_frames(self._jacobians)
        transforms = geometry.strain_transforms(self._jacobians, frames, self.shear_factor)
        determinants = np.linalg.det(self._jacobians)
        volumes = self._volumes * per_element(self.stiffening, len(self.cells))
        centre = np.linalg.det(geometry.jacobians(middle, half, np.zeros((1, 3))))
        spread = centre / determinants
        law, parameters = self._law
        stiffness, predictor = kernels.at_rest(law, parameters, transforms, volumes, spread, tables)
        viscous = stiffness
        if parameters[1] != parameters[2]:
            viscous = kernels.viscous_at_rest(parameters, transforms, volumes, spread, predictor, tables)
        base = np.empty((len(self.cells), 3, kernels.VECTORS))
        centred = middle - middle.mean(axis=1, keepdims=True)
        kernels.sample(np.ascontiguousarray(centred.transpose(0, 2, 1)), np.ascontiguousarray(half.transpose(0, 2, 1)),
                       tables, base)  # fmt: skip
        scatter = self._scatter
        starts = np.concatenate([[0], scatter.ends]).astype(np.int64)
        return kernels.Elements(
            self.cells,
            scatter.order,
            starts,
            base,
            transforms,
            volumes,
            spread,
            stiffness,
            viscous,
            predictor,
            geometry.shear_fits(determinants),
        )

    def _by_colour(self, kernel: Callable[..., None], *arguments: Any) -> None:
        """Run a kernel over all elements, in as many threads as numba may use.

        Elements of one colour share no node, and colours follow one another: the sums do not depend on
        the number of threads.
        """
        elements, threads = self._elements, get_num_threads()
        if threads == 1 or len(self.cells) < _WORTH_THREADS:
            kernel(0, len(self.cells), *self._law, elements, geometry.tables(), *arguments)
            return
        with ThreadPoolExecutor(threads) as pool:
            for start, end in itertools.pairwise(elements.starts.tolist()):
                ends = np.linspace(start, end, threads + 1).astype(int).tolist()
                work = [
                    pool.submit(kernel, first, last, *self._law, elements, geometry.tables(), *arguments)
                    for first, last in itertools.pairwise(ends)
                ]
                for part in work:
                    part.result()

    def internal_force(self, displacement: Array, viscosity: float = 0.0, past: Array | None = None) -> Array:
        """Nodal forces (nodes, 3), N, of the elastic stress and the viscous one of viscosity e + past.

        ``past`` is (elements, 53), as ``strains``; see ``fea.shell_kernels``.
        """
        result = np.zeros((self.nodes, 3))
        past = _NO_PAST if past is None else past
        self._by_colour(kernels.add_force, np.ascontiguousarray(displacement), viscosity, past, result)
        return result

    def tangent(
        self, displacement: Array, viscosity: float = 0.0, past: Array | None = None, step: Array | None = None
    ) -> tuple[Array, Array]:
        """What ``internal_force`` returns, and its derivative on ``pattern`` (stored,), N/m.

        ``step`` (nodes, 3), m, is what the displacement has just moved by; see ``fea.kernels.tangent``.
        """
        pattern, slots = self._assembly
        force, data = np.zeros((self.nodes, 3)), np.zeros(len(pattern.indices))
        moved = _NO_STEP if step is None else np.ascontiguousarray(step)
        self._by_colour(
            kernels.add_tangent, np.ascontiguousarray(displacement), viscosity, _NO_PAST if past is None else past,
            moved, slots, force, data,
        )  # fmt: skip
        return force, data

    def strains(self, displacement: Array) -> Array:
        """Sampled covariant Green-Lagrange strains (elements, 53), m^2; see ``fea.shell_kernels``."""
        return kernels.sampled_strains(self._elements, geometry.tables(), np.ascontiguousarray(displacement))

    def strain_energy(self, displacement: Array) -> Array:
        """Strain energy of every element (elements,), J."""
        return kernels.strain_energy(*self._law, self._elements, geometry.tables(), self.strains(displacement))

    @property
    def volumes(self) -> Array:
        """Volume of every element (elements,), m^3."""
        return self._volumes.sum(axis=1)

    def stresses(self, displacement: Array) -> Array:
        """Cauchy stresses (elements, 18, 6), Pa, Voigt 11 22 33 12 13 23, at 3 x 3 x 2 points, z fastest.

        The assumed strains give the stretch U of F = R U, the displacement only the rotation R.
        """
        strains = kernels.local_strains(*self._law, self._elements, geometry.tables(), self.strains(displacement))
        stress = kernels.second_piola_stresses(*self._law, strains)
        # The law saw shears times the square root of the factor: work-conjugate stresses, true strains.
        stress[..., 4:] *= np.sqrt(self.shear_factor)
        strains[..., 4:] /= np.sqrt(self.shear_factor)
        frames = geometry.local_frames(self._jacobians)
        piola, cauchy_green = _tensor(stress, 1.0), np.eye(3) + 2.0 * _tensor(strains, 0.5)
        squares, axes = np.linalg.eigh(cauchy_green)
        stretch = (axes * np.sqrt(squares)[..., None, :]) @ np.swapaxes(axes, -1, -2)
        local = stretch @ piola @ stretch / np.linalg.det(stretch)[..., None, None]
        turn = self._rotations(displacement) @ np.swapaxes(frames, -1, -2)
        cauchy = turn @ local @ np.swapaxes(turn, -1, -2)
        rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
        return np.asarray(cauchy[..., rows, columns] * per_element(self.stiffening, len(self.cells))[..., None])

    def _rotations(self, displacement: Array) -> Array:
        """Rotation (elements, 18, 3, 3) of the deformation gradient of the displacement."""
        ends = (self.points + displacement)[self.cells].reshape(-1, 9, 2, 3)
        middle, half = ends.mean(axis=2), 0.5 * (ends[:, :, 1] - ends[:, :, 0])
        now = geometry.jacobians(middle, half, geometry.quadrature()[0])
        gradient = np.swapaxes(np.linalg.solve(self._jacobians, now), -1, -2)
        left, _, right = np.linalg.svd(gradient)
        return left @ right

    # ------------------------------------------------------------------ mass

    def mass(self, on_boundary: dict[str, float] | None = None) -> Array:
        """Consistent mass on ``pattern`` (stored,), kg, with the coupled one.

        ``on_boundary`` spreads masses (kg) over the faces of named edges.
        """
        density = self.material.density if self.density is None else self.density
        data = np.zeros(len(self.pattern.indices))
        points, _ = geometry.quadrature()
        sides = 0.5 * np.stack([1.0 - points[:, 2], 1.0 + points[:, 2]], axis=1)
        shapes = (geometry.quad9(points[:, :2])[0][:, :, None] * sides[:, None, :]).reshape(18, 18)
        every = np.arange(len(self.cells))
        self._add_mass(data, every, self.cells, shapes, per_element(density, len(self.cells)) * self._volumes)
        for name, mass in (on_boundary or {}).items():
            if mass:
                elements, nodes, values, areas = self._edge_faces(name)
                self._add_mass(data, elements, nodes, values, mass / areas.sum() * areas)
        if self.coupled_mass:
            self.coupled_mass.add_to(data, self)
        return data

    def _add_mass(self, data: Array, elements: Ints, nodes: Ints, shapes: Array, masses: Array) -> None:
        """Add the mass at the points (m, points) of some nodes (m, k) of the ``elements`` (m,)."""
        matrices = np.einsum("eq,qa,qb->eab", masses, shapes, shapes, optimize=True)
        local = np.argmax(self.cells[elements][:, None, :] == nodes[:, :, None], axis=2)
        for axis in range(3):
            place = 3 * local + axis
            slots = self._assembly[1][elements[:, None, None], place[:, :, None], place[:, None, :]]
            data += np.bincount(slots[slots >= 0], matrices[slots >= 0], len(data))

    # ------------------------------------------------------------------ pictures

    def picture(self) -> tuple[Array, Ints, int, Callable[[Array], Array]]:
        """Points (m, 3), cells (elements, 27), VTK's cell type, and what carries a nodal field to the points.

        Nodes at mid-thickness are added behind the others.
        """
        vtk = vtk_reference()
        surface = [int(np.flatnonzero((ElementQuad2.doflocs == node[:2]).all(axis=1))[0]) for node in vtk]
        nodes = self.surface_cells[:, surface]
        cells = np.where(vtk[:, 2] == 0.5, self.nodes + nodes, 2 * nodes + (vtk[:, 2] > 0.5))
        return self._with_middle(self.points), cells, VTK_CELL_TYPE, self._with_middle

    def _with_middle(self, field_: Array) -> Array:
        return np.concatenate([field_, 0.5 * (field_[0::2] + field_[1::2])])


def _tensor(voigt: Array, shear: float) -> Array:
    """Symmetric tensors (..., 3, 3) of Voigt columns (..., 6) whose shears count ``shear``."""
    full = voigt * np.array([1.0, 1.0, 1.0, shear, shear, shear])
    return full[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
