"""A deformable solid: scikit-fem's discretisation, and its forces, tangent, mass and energy."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import Basis

from fea import kernels
from fea.coupled_mass import CoupledMass
from fea.coupled_scatter import coupled_scatter
from fea.elements import SolidElement, quadratic, some
from fea.materials import ISOCHORIC, constants
from fea.pattern import Pattern
from fea.per_element import per_element
from fea.scatter import Scatter
from fea.surface import Surface
from lab.materials import Material

Array = NDArray[np.float64]
Cells = NDArray[np.int64]

_NO_STEP = np.zeros((0, 3))
_NO_PAST = np.zeros((0, 0, 6))


@dataclass(frozen=True)
class Body:
    """Total-Lagrangian solid of 27-node hexahedra or 10-node tetrahedra.

    Under an isochoric law the volume ratio is projected inside every element (linear in hexahedra, constant in
    tetrahedra), so that nothing locks up to Poisson's ratios near 1/2.  A constant leaves the three quadratic
    conformal motions of a tetrahedron without stiffness and costs an order of accuracy; therefore
    tetrahedra take as much bulk modulus point by point as a Poisson's ratio of 0.45 has, which
    does not lock them, and project the rest.  The other laws, for which volume and shape are not
    apart, are never projected.

    Parameters
    ----------
    mesh
        scikit-fem mesh of hexahedra or tetrahedra with named boundaries, m; linear ones get quadratic nodes.
    material
        Law and constants.
    density
        Reference density, kg/m^3, one number or one per element; None takes the material's.
    project_volume
        False takes the volume ratio point by point under isochoric laws too.
    stiffening
        Factor on all stresses, one number or one per element: large for what is as good as rigid.
    coupled_mass
        Rigid mass that rides on a boundary.

    Raises
    ------
    ValueError
        For inverted elements, coordinates that are not finite, and nodes without element.
    """

    mesh: Any
    material: Material
    density: float | Array | None = None
    project_volume: bool = True
    stiffening: float | Array = 1.0
    coupled_mass: CoupledMass | None = None
    element: SolidElement = field(init=False)
    points: Array = field(init=False)
    cells: Cells = field(init=False)
    solid: kernels.Solid = field(init=False)
    order: int = field(init=False)
    _right_handed: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        mesh, element = quadratic(self.mesh)
        cells = np.ascontiguousarray(mesh.dofs.element_dofs.T, dtype=np.int64)
        points = np.ascontiguousarray(mesh.doflocs.T[: int(mesh.dofs.N)])
        _refuse("node coordinates are not finite in", ~np.isfinite(points[cells]).all(axis=(1, 2)))
        order = element.order_for(points[cells])
        values, slopes, reference = element.shapes(order)
        jacobians = _jacobians(points[cells], slopes)
        determinants = np.linalg.det(jacobians)
        hand = np.sign(determinants[:, :1])
        _refuse("inverted (or without volume):", ~(determinants * hand > 0).all(axis=1))
        gradients = np.ascontiguousarray(np.linalg.inv(jacobians).transpose(0, 1, 3, 2) @ slopes)
        weights = np.abs(determinants) * reference * per_element(self.stiffening, len(cells))
        modes = np.zeros((len(cells), 0, len(reference)))
        stiff = self.material.bulk_modulus / self.material.shear_modulus
        pointwise = min(element.pointwise_bulk / stiff, 1.0) if self.project_volume else 1.0
        if pointwise < 1 and constants(self.material)[0] == ISOCHORIC:
            modes = _volume_modes(values @ points[cells], weights, element.volume_order)
        solid = kernels.Solid(gradients, weights, modes, pointwise, cells)
        for name, value in (
            ("mesh", mesh), ("element", element), ("points", points), ("cells", cells), ("solid", solid),
            ("order", order), ("_right_handed", hand[:, 0] > 0),
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    @property
    def kind(self) -> str:
        """What its elements are called."""
        return self.element.name

    @property
    def nodes(self) -> int:
        """Number of nodes; unknown ``3 node + axis`` moves ``node`` along ``axis``."""
        return len(self.points)

    @property
    def weights(self) -> Array:
        """Reference volume that every quadrature point stands for, (elements, points), m^3."""
        return self.solid.weights / per_element(self.stiffening, len(self.cells))

    @property
    def volumes(self) -> Array:
        """Reference volume of every element, (elements,), m^3."""
        return self.weights.sum(axis=1)

    @cached_property
    def basis(self) -> Basis:
        """scikit-fem's basis at the quadrature points of the stiffness; its unknowns are the nodes."""
        return Basis(self.mesh, self.element.element(), quadrature=self.element.rule(self.order))

    @cached_property
    def _scatter(self) -> Scatter:
        coupled = self.boundary(self.coupled_mass.boundary) if self.coupled_mass else np.zeros(0, dtype=np.int64)
        return coupled_scatter(self.cells, self.nodes, coupled)

    @property
    def pattern(self) -> Pattern:
        """Sparsity of tangent and mass over all unknowns."""
        return self._scatter.pattern

    def boundary(self, name: str) -> Cells:
        """Nodes of a named boundary, ascending."""
        return self.surface(name).nodes

    def surface(self, name: str) -> Surface:
        """Facets of a named boundary, or of the whole outside under the name ``all``; normals point outward."""
        elements, local = self._facets(name)
        return Surface(self.cells[elements[:, None], local], self.element.facet_shape)

    def _facets(self, name: str) -> tuple[Cells, Cells]:
        """Element (facets,) and its own numbers of the nodes (facets, nodes) of every facet of a boundary."""
        named = self.mesh.boundaries or {}
        if name in named:
            facets = np.asarray(named[name])
        elif name == "all":
            facets = self.mesh.boundary_facets()
        else:
            raise ValueError(f"the mesh has no boundary {name!r}; it has {sorted(named)}")
        elements = self.mesh.f2t[0, facets].astype(np.int64)
        number = np.argmax(self.mesh.t2f[:, elements] == facets, axis=0)
        local = self.element.facets()[number]
        turned = ~self._right_handed[elements]
        local[turned] = local[turned][:, self.element.mirrored_facet()]
        return elements, local

    def shares(self, name: str) -> Array:
        """Area that every node carries of a named boundary (nodes,), m^2: integral of its shape function."""
        return self.surface(name).areas(self.points)

    def internal_force(self, displacement: Array, viscosity: float = 0.0, past: Array | None = None) -> Array:
        """Nodal forces (nodes, 3), N, of the stress S(E) + C0 : (viscosity E + past).

        ``past`` is (elements, points, 6); see ``fea.kernels``.
        """
        viscous = self._viscous(viscosity, past)
        return kernels.internal_force(self.solid, displacement, *constants(self.material), *viscous)

    def tangent(
        self, displacement: Array, viscosity: float = 0.0, past: Array | None = None, step: Array | None = None
    ) -> tuple[Array, Array]:
        """What ``internal_force`` returns, and its derivative on ``pattern`` (stored,), N/m.

        ``step`` (nodes, 3), m, is what the displacement has just moved by; see ``fea.kernels.tangent``.
        """
        viscous = self._viscous(viscosity, past)
        return kernels.tangent(
            self.solid, self._scatter, displacement, *constants(self.material), *viscous,
            _NO_STEP if step is None else step,
        )  # fmt: skip

    def _viscous(self, viscosity: float, past: Array | None) -> tuple[float, Array]:
        if not viscosity > 0:
            return 0.0, _NO_PAST
        return float(viscosity), np.zeros((*self.weights.shape, 6)) if past is None else past

    def strains(self, displacement: Array) -> Array:
        """Green-Lagrange strains (elements, points, 6), Voigt 11, 22, 33, 12, 13, 23 with doubled shears."""
        return kernels.strains(self.solid, displacement)

    def stresses(self, displacement: Array, viscosity: float = 0.0, past: Array | None = None) -> Array:
        """Cauchy stresses (elements, points, 6), Pa, Voigt 11, 22, 33, 12, 13, 23."""
        viscous = self._viscous(viscosity, past)
        stress = kernels.cauchy(self.solid, displacement, *constants(self.material), *viscous)
        return np.asarray(stress * per_element(self.stiffening, len(self.cells))[..., None])

    def strain_energy(self, displacement: Array) -> Array:
        """Strain energy of every element (elements,), J."""
        return kernels.strain_energy(self.solid, displacement, *constants(self.material))

    def mass(self, on_boundary: dict[str, float] | None = None) -> Array:
        """Consistent mass on ``pattern`` (stored,), kg, with the coupled one.

        ``on_boundary`` spreads masses (kg) over named faces.
        """
        density = self.material.density if self.density is None else self.density
        values, slopes, reference = self.element.shapes(self.element.mass_order)
        determinants = np.abs(np.linalg.det(_jacobians(self.points[self.cells], slopes)))
        data = np.zeros(len(self.pattern.indices))
        masses = per_element(density, len(self.cells)) * reference * determinants
        self._add_mass(data, values, masses, self._scatter.starts, self.cells)
        for name, mass in (on_boundary or {}).items():
            if mass:
                self._add_face_mass(data, name, mass)
        if self.coupled_mass:
            self.coupled_mass.add_to(data, self)
        return data

    def _add_face_mass(self, data: Array, name: str, mass: float) -> None:
        elements, local = self._facets(name)
        surface = self.surface(name)
        shapes = surface.shapes()
        tangents = np.einsum("qjk,fkc->fqjc", shapes.slopes, self.points[surface.facets])
        areas = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * shapes.weights
        starts = self._scatter.starts[elements[:, None, None], local[:, :, None], local[:, None, :]]
        self._add_mass(data, shapes.values, mass / areas.sum() * areas, starts, surface.facets)

    def _add_mass(self, data: Array, values: Array, masses: Array, starts: NDArray[np.int32], cells: Cells) -> None:
        """Add matrices of shape functions ``values`` (points, k) under ``masses`` (cells, points), kg."""
        k = values.shape[1]
        products = (values[:, :, None] * values[:, None, :]).reshape(len(values), k * k)
        matrices = (masses @ products).reshape(-1, k, k)
        stored = starts >= 0
        widths = np.broadcast_to(self._scatter.widths[cells][:, :, None], starts.shape)[stored]
        for offset in (0, 3 * widths, 6 * widths - 1):
            data += np.bincount(starts[stored] + offset, matrices[stored], len(data))

    def picture(self) -> tuple[Array, Cells, int, Callable[[Array], Array]]:
        """Points (nodes, 3), m; cells (elements, k) in VTK's order and its cell type; and how nodal fields map."""
        cells = self.cells.copy()
        cells[~self._right_handed] = cells[~self._right_handed][:, self.element.mirrored()]
        return self.points, cells[:, self.element.vtk_order()], self.element.vtk_type, lambda nodal: nodal


def _jacobians(corners: Array, slopes: Array) -> Array:
    """dX/dr (elements, points, 3, 3) of nodes (elements, k, 3) and slopes (points, 3, k)."""
    return np.matmul(slopes[None], corners[:, None]).transpose(0, 1, 3, 2)


def _volume_modes(places: Array, weights: Array, order: int) -> Array:
    """Polynomials in the coordinates, orthonormal in ``weights``, (elements, modes, points).

    In the coordinates themselves, not in those of the reference element: on distorted meshes only these keep the
    order of convergence (Arnold, Boffi & Falk 2002).
    """
    columns = np.ones((*weights.shape, 1))
    if order:
        centre = (weights[:, None] @ places) / weights.sum(axis=1)[:, None, None]
        columns = np.concatenate([columns, places - centre], axis=2)
    root = np.sqrt(weights)[:, :, None]
    return np.ascontiguousarray((np.linalg.qr(root * columns).Q / root).transpose(0, 2, 1))


def _refuse(what: str, bad: NDArray[np.bool_]) -> None:
    if bad.any():
        raise ValueError(f"{what} elements {some(np.flatnonzero(bad))} of {len(bad)}")
