"""A pinched tube as a case on structured meshes of any fineness, for verification and for benchmarks."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lab.materials import Material
from meshes.structured import solid_mesh, surface_mesh

if TYPE_CHECKING:
    from fea.case import Case

Elements = Literal["hexahedra", "shell"]


@dataclass(frozen=True)
class PinchedTube:
    """One eighth of a tube between two small stamps: a quarter of its circumference, half of its length.

    The axis is x, the crown lies on +z; the end x = ``length`` is free.  The stamp moves the outer nodes that
    lie closer than ``patch_angle`` (rad) and ``patch_length`` (m) to the middle of the crown, and leaves
    them free in the two other directions.

    Parameters
    ----------
    radius, length, wall
        Of the middle surface, of the half tube, and thickness; m.
    patch_angle, patch_length
        Half the extent of the stamp, rad and m.
    material
        Law and constants.
    """

    radius: float = 25e-3
    length: float = 50e-3
    wall: float = 1.5e-3
    patch_angle: float = np.pi / 24
    patch_length: float = 5e-3
    material: Material = Material(youngs_modulus=26e6, poisson_ratio=0.45)

    def place(self, around: np.ndarray, along: np.ndarray, through: np.ndarray) -> np.ndarray:
        """Positions (n, 3), m, of points of the unit cube."""
        angle = 0.5 * np.pi * around
        radius = self.radius + (through - 0.5) * self.wall
        return np.column_stack([self.length * along, radius * np.sin(angle), radius * np.cos(angle)])

    def case(self, elements: Elements, around: int, along: int, travel: float) -> "Case":
        """The stamp moves down by ``travel``, m; its force is the reaction at ``stamp`` along z."""
        from fea import Body, Case, Shell

        names = ("middle", "end", "crown", "side")
        if elements == "shell":
            mesh = surface_mesh((along, around), lambda a, b: self.place(b, a, np.full_like(a, 0.5)), names)
            part: Any = Shell(mesh, self.wall, self.material)
        else:
            mesh = solid_mesh((along, around, 1), lambda a, b, c: self.place(b, a, c), (*names, "inside", "outside"))
            part = Body(mesh, self.material)
        case = Case(part)
        case.symmetry("crown", "y").symmetry("side", "z").symmetry("middle", "x")
        case.fix(self.stamped, "z", to=-travel)
        return case.watch("stamp", self.stamped)

    def stamped(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, 3) lie under the stamp."""
        radius, angle = np.hypot(points[:, 1], points[:, 2]), np.arctan2(points[:, 1], points[:, 2])
        under = (angle < self.patch_angle * (1 + 1e-6)) & (points[:, 0] < self.patch_length * (1 + 1e-6))
        return under & (radius > self.radius + 0.25 * self.wall)


def prescribed(case: "Case") -> dict[int, float]:
    """Held unknowns ``3 node + axis`` and their displacements at the end, m."""
    return {int(unknown): value(1.0) for unknowns, value, _ in case._prescribed for unknown in unknowns}
