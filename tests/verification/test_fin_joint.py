"""A fin that stands on a wall: the joint of both layers against beam theory, and against the device as a solid."""

import numpy as np
import pytest

from fea import Body, Case, FeaModel, Shell, static
from fea.finned_device import set_up
from lab.experiments import ShapePropagation
from lab.materials import Material
from lab.specimens import FinnedTube
from meshes import mesh_cad, read_mesh
from meshes.finned_tube import finned_surface
from meshes.options import MeshOptions
from meshes.structured import surface_mesh

#: Length of the wall, height of the fin, width of both, thickness of both, m.
L, H, B, T = 0.2, 0.1, 0.02, 0.002
STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.0)


def on_marks(share, *marks):
    """Places of a parameter 0..1 on even steps between marks."""
    return np.interp(share, np.linspace(0.0, 1.0, len(marks)), marks)


def test_a_fin_at_a_right_angle_carries_its_moment_into_the_wall():
    """Force F across the fin's tip; the wall is clamped at both ends.

    It gives way less than if the fin stood on a line, and more than if the wall were rigid under the fin.
    """
    half = T / 2
    marks = [*np.linspace(0, L / 2 - half, 9), *np.linspace(L / 2 + half, L, 9)]
    wall = surface_mesh((17, 2), lambda a, b: np.stack([on_marks(a, *marks), B * b, 0 * a], axis=1), ("l", "r", "", ""))
    # Its middle is in the plane x = L/2, its thickness along x.
    fin = surface_mesh(
        (2, 8), lambda a, b: np.stack([L / 2 + 0 * a, B * a, half + H * b], axis=1), ("", "", "root", "tip")
    )
    plate, rib = Shell(wall, T, STEEL), Shell(fin, T, STEEL)
    case = Case(plate, rib).fix("l").fix("r").tie("root", "top", part=rib, to=plate)
    force = 1e-3
    case.force("tip", (force, 0.0, 0.0)).watch("tip", "tip")
    moved = static(case).displacement("tip")[-1, 0]
    second = B * T**3 / 12 * STEEL.youngs_modulus
    arm = H + half

    def expected(rigid: float) -> float:
        # Each clamped wing of the wall gives 4 E I / l to a turn of its end, and 6 E I / l^2 as shear on the half-width
        # of what is rigid.
        wing = L / 2 - rigid
        turning = 2 * second * (4 / wing + 12 * rigid / wing**2 + 12 * rigid**2 / wing**3)
        shear = 6 / 5 * force * H / (STEEL.shear_modulus * B * T)
        return force * arm**2 / turning + force * H**3 / (3 * second) + shear

    stiff, soft = expected(half), expected(0.0)
    print(f"fin on a wall: beam theory {1e6 * stiff:.5g} to {1e6 * soft:.5g} um, ours {1e6 * moved:.5g} um")
    assert stiff <= moved <= 1.01 * soft
    assert soft < 1.03 * stiff


@pytest.mark.slow
@pytest.mark.parametrize("angle", [60.0, 35.0])
def test_the_shell_sweeps_its_fin_as_the_solid_does(angle, tmp_path):
    """Small pinch; 10-node tetrahedra of the CAD solid, whose crest line is moved alike."""
    tube = FinnedTube(attachment_angle=np.deg2rad(angle))
    # All along the crest, since edges of tetrahedra do not end where a shorter pinch does.
    experiment = ShapePropagation(travel=1e-4, increments=4, pinch_length=tube.length)
    model = FeaModel(element="shell")
    device = set_up(
        tube, experiment, model, finned_surface(tube, MeshOptions(along=16, across=10, grading_along=0.0), "quarter")
    )
    device.drive.goes(0.0, 1.0, experiment.travel)
    problem = device.problem
    problem.linearise(problem.rest, 0.0)
    y = problem.advance(problem.rest, 0.0, 1.0, renew=False)
    ours = device.middle(problem.displacement(y, 1.0), device.corner)[0]

    path = tmp_path / "solid.msh"
    mesh_cad(tube, path, 0.002, quarter=True)
    body = Body(read_mesh(path), tube.material)
    case = Case(body).symmetry("crest", "x").symmetry("side", "y")

    def line(points):
        return (np.abs(points[:, 0]) < 1e-6) & (points[:, 1] > tube.radius - 1e-5)

    case.fix(line, "y", to=-experiment.travel / 2)
    middle = case.select(line)
    middle = middle[[np.abs(body.points[middle, 2] - tube.length / 2).argmin()]]
    case.fix(middle, "z").watch("P", tube.tip_corner)
    solid = static(case).displacement("P")[-1]
    one, other = np.hypot(*ours[[0, 2]]), np.hypot(*solid[[0, 2]])
    error = 100 * (one / other - 1)
    print(f"theta {angle:g} deg: s over travel, solid {other / 1e-4:.4g}, shell {one / 1e-4:.4g}, {error:+.2f} %")
    # A shell's wall turns more easily under the fin than a solid, whose stress spreads from the sharp inner corner.
    assert 0.0 < error < 6.0
