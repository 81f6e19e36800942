"""A deformable solid: scikit-fem's discretisation, and its forces, tangent, mass and energy."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementHex2, FacetBasis, MeshHex2
from skfem.assembly.basis import AbstractBasis

from fea import kernels
from fea.materials import constants
from fea.pattern import Pattern, element_pattern
from lab.materials import Material

Array = NDArray[np.float64]

#: Exact for products of quadratic shape functions on parallelepipeds: 27 points.
QUADRATURE_ORDER = 5
_NO_PAST = np.zeros((1, 1, 6))


@dataclass(frozen=True)
class Body:
    """Total-Lagrangian solid of 27-node hexahedra.

    Parameters
    ----------
    mesh
        scikit-fem mesh with named boundaries; m.
    material
        Law and constants.
    density
        Reference density, kg/m^3; None takes the material's.
    """

    mesh: MeshHex2
    material: Material
    density: float | None = None
    basis: Basis = field(init=False)
    gradients: Array = field(init=False)
    weights: Array = field(init=False)
    cells: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        basis = Basis(self.mesh, ElementHex2(), intorder=QUADRATURE_ORDER)
        gradients = np.stack([shape[0].grad for shape in basis.basis])
        for name, value in (
            ("basis", basis),
            ("gradients", np.ascontiguousarray(gradients.transpose(2, 3, 1, 0))),
            ("weights", np.ascontiguousarray(basis.dx)),
            ("cells", np.ascontiguousarray(basis.element_dofs.T, dtype=np.int64)),
        ):
            object.__setattr__(self, name, value)

    @property
    def nodes(self) -> int:
        """Number of nodes; unknown ``3 node + axis`` moves ``node`` along ``axis``."""
        return int(self.basis.N)

    @property
    def points(self) -> Array:
        """Reference coordinates (nodes, 3), m."""
        return self.basis.doflocs.T

    @cached_property
    def _assembly(self) -> tuple[Pattern, NDArray[np.int32]]:
        return element_pattern(self.cells, self.nodes)

    @property
    def pattern(self) -> Pattern:
        """Sparsity of tangent and mass over all unknowns."""
        return self._assembly[0]

    def boundary(self, name: str) -> NDArray[np.int64]:
        """Nodes of a named boundary, ascending."""
        if name not in (self.mesh.boundaries or {}):
            raise ValueError(f"the mesh has no boundary {name!r}; it has {sorted(self.mesh.boundaries or {})}")
        return np.unique(self.basis.get_dofs(name).flatten()).astype(np.int64)

    def shares(self, name: str) -> Array:
        """Area that every node carries of a named boundary (nodes,), m^2: integral of its shape function."""
        face = self._face(name)
        result = np.zeros(self.nodes)
        for nodes, shape in zip(face.element_dofs, face.basis, strict=True):
            result += np.bincount(nodes, np.sum(shape[0].value * face.dx, axis=1), self.nodes)
        return result

    def _face(self, name: str) -> FacetBasis:
        return FacetBasis(self.mesh, ElementHex2(), facets=self.mesh.boundaries[name], intorder=QUADRATURE_ORDER)

    def internal_force(self, displacement: Array, viscosity: float = 0.0, past: Array | None = None) -> Array:
        """Nodal forces (nodes, 3), N, of the stress S(E) + C0 : (viscosity E + past).

        ``past`` is (elements, points, 6); see ``fea.kernels``.
        """
        return kernels.internal_force(
            self.gradients, self.weights, self.cells, displacement, *constants(self.material),
            viscosity, _NO_PAST if past is None else past,
        )  # fmt: skip

    def tangent(
        self, displacement: Array, viscosity: float = 0.0, past: Array | None = None, step: Array | None = None
    ) -> tuple[Array, Array]:
        """What ``internal_force`` returns, and its derivative on ``pattern`` (stored,), N/m.

        ``step`` (nodes, 3), m, is what the displacement has just moved by; see ``fea.kernels.tangent``.
        """
        pattern, slots = self._assembly
        data = np.zeros(len(pattern.indices))
        force = kernels.tangent(
            self.gradients, self.weights, self.cells, displacement, *constants(self.material),
            viscosity, _NO_PAST if past is None else past,
            np.zeros_like(displacement) if step is None else step, slots, data,
        )  # fmt: skip
        return force, data

    def strains(self, displacement: Array) -> Array:
        """Green-Lagrange strains (elements, points, 6), Voigt 11, 22, 33, 12, 13, 23 with doubled shears."""
        return kernels.strains(self.gradients, self.cells, displacement)

    def strain_energy(self, displacement: Array) -> Array:
        """Strain energy of every element (elements,), J."""
        return kernels.strain_energy(self.gradients, self.weights, self.cells, displacement, *constants(self.material))

    def mass(self, on_boundary: dict[str, float] | None = None) -> Array:
        """Consistent mass on ``pattern`` (stored,), kg; ``on_boundary`` spreads masses (kg) over named faces."""
        density = self.material.density if self.density is None else self.density
        data = np.zeros(len(self.pattern.indices))
        self._add_mass(data, self.basis, np.arange(len(self.cells)), density)
        for name, mass in (on_boundary or {}).items():
            if mass:
                face = self._face(name)
                self._add_mass(data, face, face.tind, mass / float(face.dx.sum()))
        return data

    def _add_mass(self, data: Array, basis: AbstractBasis, elements: NDArray[np.int64], density: float) -> None:
        shapes = np.stack([np.broadcast_to(shape[0].value, basis.dx.shape) for shape in basis.basis])
        matrices = (shapes * (density * basis.dx)).transpose(1, 0, 2) @ shapes.transpose(1, 2, 0)
        slots = self._assembly[1][elements]
        for axis in range(3):
            slot = slots[:, axis::3, axis::3]
            data += np.bincount(slot[slot >= 0], matrices[slot >= 0], len(data))
