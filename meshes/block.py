"""Structured meshes made in memory, without gmsh and files: for cases of one's own and for tests."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lab.specimens import TwistedBeam
from meshes.options import MeshOptions
from meshes.structured import surface_mesh
from meshes.twist import twisted

if TYPE_CHECKING:
    from skfem import MeshHex2, MeshQuad2


def block_mesh(lengths: tuple[float, float, float], options: MeshOptions) -> "MeshHex2":
    """Box from the origin, ``lengths`` (m) along x, y, z, with the boundaries root and tip (along x) and sides."""
    from skfem import MeshHex, MeshHex2

    counts = (options.along, options.across, options.through)
    box = MeshHex.init_tensor(*(np.linspace(0, size, n + 1) for size, n in zip(lengths, counts, strict=True)))
    # Made left-handed by scikit-fem, which does not mind; VTK does.
    corners = box.elem.refdom.p.T
    mirrored = [int(np.flatnonzero((corners == corner[[1, 0, 2]]).all(axis=1))[0]) for corner in corners]
    mesh = MeshHex2.from_mesh(MeshHex(box.p, box.t[mirrored]))
    near = 1e-9 * lengths[0]
    return mesh.with_boundaries(
        {
            "root": lambda x: x[0] < near,
            "tip": lambda x: x[0] > lengths[0] - near,
            "sides": lambda x: (x[0] > near) & (x[0] < lengths[0] - near),
        }
    )


def moved(mesh: "MeshHex2", points: NDArray[np.float64]) -> "MeshHex2":
    """The mesh with its nodes at ``points`` (nodes, 3), m; boundaries kept."""
    from skfem import MeshHex2

    return MeshHex2(np.ascontiguousarray(points.T), mesh.t, _boundaries=mesh.boundaries)


def beam_mesh(specimen: TwistedBeam, options: MeshOptions) -> "MeshHex2":
    """The mesh of ``make_mesh`` and ``read_mesh``, up to the numbering."""
    straight = block_mesh((1.0, 1.0, 1.0), options)
    return moved(straight, twisted(straight.doflocs.T, specimen, options))


def beam_surface(specimen: TwistedBeam, options: MeshOptions) -> "MeshQuad2":
    """The middle surface of the beam, with the edges root, tip and sides; its normal is +z where the width is +y."""

    def place(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        return twisted(np.column_stack([a, b, np.full_like(a, 0.5)]), specimen, options)

    return surface_mesh((options.along, options.across), place, ("root", "tip", "sides", "sides"))
