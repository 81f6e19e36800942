"""A soft ring squeezed between two rigid plates until its inner walls touch: force against travel.

By symmetry a quarter is enough.  The mesh is made here, node by node; any scikit-fem mesh will do.
"""

from pathlib import Path

import numpy as np

from fea import Case, Shell, record, static
from lab.materials import Material
from meshes.structured import surface_mesh
from results.store import write_record

RADIUS, WIDTH, WALL = 0.025, 0.010, 0.0015  # m


def place(a, b):
    """Mid-surface (n, 3), m, from the crown (a = 0) to the side (a = 1)."""
    angle = 0.5 * np.pi * a
    return np.stack([RADIUS * np.sin(angle), WIDTH * (b - 0.5), RADIUS * np.cos(angle)], axis=1)


mesh = surface_mesh((16, 1), place, edges=("crown", "side", "", ""))
ring = Shell(mesh, WALL, Material(law="neo-hookean", youngs_modulus=26e6, poisson_ratio=0.45))

case = Case(ring)
case.symmetry("crown", "x").symmetry("side", "z").fix([0.0, 0.0, RADIUS], "y")
outside = "top" if ring.points[ring.top].max() > RADIUS else "bottom"
inside = "bottom" if outside == "top" else "top"
plate = case.rigid("plate", at=(0.0, 0.0, RADIUS + WALL / 2)).hold("x", "y", "rx", "ry", "rz")
plate.move(z=-0.9 * RADIUS)
case.plate(outside, plate, "-z")
case.ground(inside, point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))  # the other half, by symmetry
case.watch("side", [RADIUS, 0.0, 0.0])

run = static(case, np.linspace(0.05, 1.0, 20))
travel = -2e3 * run.displacement("plate")[:, 2]  # mm between the plates
force = -2 * run.wrench("plate")[:, 2]  # N
widening = 2e3 * run.displacement("side")[:, 0]  # mm
penetration = max(report["largest penetration [m], term 1"] for report in run.reports) / WALL


if __name__ == "__main__":
    print(f"{run.status}; {run.history['tangents']} tangents, {run.wall_time:.1f} s")
    for row in zip(travel, force, widening, strict=True):
        print("travel {:6.2f} mm   force {:7.3f} N   widening {:6.2f} mm".format(*row))
    print(f"deepest penetration at the fold {100 * penetration:.2f} % of the wall")
    write_record(Path("runs/examples/ring.vtkhdf"), record(run, "ring between plates"), {})
