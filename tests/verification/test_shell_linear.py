"""The solid shell on the linear cases by which shell elements are judged; prints reference, ours and error."""

import numpy as np
import pytest
from skfem import MeshQuad, MeshQuad2

from fea.linear import make_solver
from fea.shell import Shell
from lab.materials import Material


def surface(place, r, s):
    """Quadratic mesh of ``place(r, s)`` on the given lines, with the edges r0, r1, s0, s1."""
    flat = MeshQuad.init_tensor(np.asarray(r, float), np.asarray(s, float)).with_boundaries({
        "r0": lambda x: np.isclose(x[0], r[0]), "r1": lambda x: np.isclose(x[0], r[-1]),
        "s0": lambda x: np.isclose(x[1], s[0]), "s1": lambda x: np.isclose(x[1], s[-1]),
    })  # fmt: skip
    fine = MeshQuad2.from_mesh(flat)
    return MeshQuad2(np.array(place(*fine.doflocs)), fine.t, _boundaries=flat.boundaries)


def held(shell, edge, *axes):
    return (3 * shell.boundary(edge)[:, None] + np.array(axes)).ravel()


def respond(shell, fixed, load):
    """Displacement (nodes, 3) of the linear problem.

    The matrix of a very thin shell holds its bending only to few digits, the forces hold all: the solution is
    improved with the forces at a small multiple of itself.
    """
    free = np.setdiff1d(np.arange(3 * shell.nodes), np.concatenate(fixed))
    pattern, taken = shell.pattern.restrict(free)
    solver = make_solver("auto", pattern)
    solver.factorise(shell.tangent(np.zeros((shell.nodes, 3)))[1][taken])
    u = np.zeros(3 * shell.nodes)
    u[free] = solver.solve(load.ravel()[free])
    for _ in range(2):
        small = 1e-8 / np.abs(u).max() * shell.points.max()
        u[free] += solver.solve(
            load.ravel()[free] - shell.internal_force(small * u.reshape(-1, 3)).ravel()[free] / small
        )
    return u.reshape(-1, 3)


def at(shell, place):
    """Nodes at the bottom and the top of the surface node at ``place``."""
    node = int(np.argmin(np.linalg.norm(shell.mid - np.asarray(place), axis=1)))
    return [2 * node, 2 * node + 1]


def tell(case, reference, ours):
    print(f"{case}: reference {reference:.6g}, ours {ours:.6g}, error {100 * (ours / reference - 1):+.2f} %")
    return ours / reference - 1


# MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20.  Thick: Zupan & Saje (2004).  Thin: what Abaqus S4, S4R5,
# S3 and STRI3 converge to (FinEtoolsFlexStructures.jl, twisted_extrap_thin.jl), 1.2951e-3 and 5.2499e-3; the
# customary 1.294e-3 and 5.256e-3 have no traceable source.
@pytest.mark.parametrize(
    ("thickness", "force", "axis", "reference", "within"),
    [
        (0.32, 1.0, 1, 1.753248e-3, 5e-3), (0.32, 1.0, 2, 5.424535e-3, 5e-3),
        (0.0032, 1e-6, 1, 1.2951e-3, 3e-3), (0.0032, 1e-6, 2, 5.2499e-3, 3e-3),
    ],
)  # fmt: skip
def test_twisted_beam(thickness, force, axis, reference, within):
    def place(x, y):
        turn = np.pi / 2 * x / 12
        return x, y * np.cos(turn), y * np.sin(turn)

    mesh = surface(place, np.linspace(0, 12, 13), np.linspace(-0.55, 0.55, 3))
    shell = Shell(mesh, thickness, Material(youngs_modulus=29e6, poisson_ratio=0.22))
    share = shell.shares("r1") / shell.shares("r1").sum()
    u = respond(shell, [held(shell, "r0", 0, 1, 2)], force * np.outer(share, np.eye(3)[axis]))
    assert abs(tell(f"twisted beam {thickness}, axis {axis}", reference, share @ u[:, axis])) < within


# Krysl & Chen: 0.30202, converged and shear-deformable; Belytschko's customary 0.3024 is of a coarse age.
# Thin-shell theory without shear gives 0.3006.
def test_scordelis_lo_roof():
    radius, edge = 25.0, np.deg2rad(40.0)
    mesh = surface(lambda x, a: (x, radius * np.sin(a), radius * np.cos(a)), np.linspace(0, 25, 9),
                   edge * (1 - (1 - np.linspace(0, 1, 9)) ** 1.5))  # fmt: skip
    shell = Shell(mesh, 0.25, Material(youngs_modulus=4.32e8, poisson_ratio=0.0), density=90.0 / 0.25)
    weight = shell.pattern.times(shell.mass(), np.tile([0.0, 0.0, -1.0], shell.nodes)).reshape(-1, 3)
    fixed = [held(shell, "r0", 1, 2), held(shell, "r1", 0), held(shell, "s0", 1)]
    u = respond(shell, fixed, weight)
    corner = at(shell, [25.0, radius * np.sin(edge), radius * np.cos(edge)])
    assert abs(tell("Scordelis-Lo roof", 0.30202, -u[corner, 2].mean())) < 1e-2


# 164.24 P/(E t), double Fourier series of thin-shell theory; shear adds to it below the point force.
def test_pinched_cylinder_with_diaphragms():
    radius = 300.0
    mesh = surface(lambda x, a: (x, radius * np.sin(a), radius * np.cos(a)), np.linspace(0, 300, 11),
                   np.linspace(0, np.pi / 2, 11))  # fmt: skip
    shell = Shell(mesh, 3.0, Material(youngs_modulus=3e6, poisson_ratio=0.3))
    below, load = at(shell, [300.0, 0.0, radius]), np.zeros((shell.nodes, 3))
    load[below, 2] = -0.125
    fixed = [held(shell, "r0", 1, 2), held(shell, "r1", 0), held(shell, "s0", 1), held(shell, "s1", 2)]
    u = respond(shell, fixed, load)
    assert abs(tell("pinched cylinder, diaphragms", 1.82488e-5, -u[below, 2].mean())) < 1e-2


# u = c P R / (E t^3), R and t in the same unit (inch in the source); FinEtoolsFlexStructures.jl, flat triangles.
# R/t = 100: their one mesh of 25 x 35; ours gives 1.9664, 1.9696, 1.9704, 1.9705 on 4 x 6 to 26 x 36 elements.
# Inextensional bending, no shear: c = 1.907.  The source's 1.912 is for R/t = 1e4: there the stored matrix of a
# solid shell has lost its bending to rounding, at 3e3 not yet, and c should lie between 1.907 and some 1.92.
@pytest.mark.parametrize(("ratio", "reference", "fine", "within"), [(1e2, 1.997, 1, 1.5e-2), (3e3, 1.912, 2, 5e-3)])
def test_pinched_cylinder_with_free_ends(ratio, reference, fine, within):
    radius, length = 4.953, 10.35
    mesh = surface(lambda x, a: (x, radius * np.sin(a), radius * np.cos(a)), np.linspace(0, length / 2, 8 * fine + 1),
                   np.linspace(0, np.pi / 2, 12 * fine + 1))  # fmt: skip
    shell = Shell(mesh, radius / ratio, Material(youngs_modulus=10.5e6, poisson_ratio=0.3125))
    below, load = at(shell, [0.0, 0.0, radius]), np.zeros((shell.nodes, 3))
    load[below, 2] = -100.0 / 8
    fixed = [held(shell, "r0", 0), held(shell, "s0", 1), held(shell, "s1", 2)]
    u = respond(shell, fixed, load)
    c = -u[below, 2].mean() * 10.5e6 * (radius / ratio) ** 3 / (100.0 * radius)
    assert abs(tell(f"pinched cylinder, free ends, R/t {ratio:g}", reference, c)) < within


# 0.093 FinEtools; 0.0924 Kratos wiki; 0.0940 MacNeal & Harder.  Ours goes to 0.0936 (32 x 32), shear included.
def test_pinched_hemisphere_with_a_hole():
    def place(a, b):
        return 10 * np.cos(a) * np.sin(b), 10 * np.cos(a) * np.cos(b), 10 * np.sin(a)

    mesh = surface(place, np.linspace(0, np.deg2rad(72), 11), np.linspace(0, np.pi / 2, 11))
    shell = Shell(mesh, 0.04, Material(youngs_modulus=6.825e7, poisson_ratio=0.3))
    pulled, pushed, load = at(shell, [10, 0, 0]), at(shell, [0, 10, 0]), np.zeros((shell.nodes, 3))
    load[pulled, 0], load[pushed, 1] = 0.5, -0.5
    u = respond(shell, [held(shell, "s0", 0), held(shell, "s1", 1), np.array([3 * pulled[0] + 2])], load)
    assert u[pulled, 0].mean() == pytest.approx(-u[pushed, 1].mean(), rel=1e-3)
    assert abs(tell("pinched hemisphere", 0.093, u[pulled, 0].mean())) < 1e-2


# Knight (1997); 5.022 by refined 20-node solids (FinEtoolsFlexStructures.jl), 5.02 Abaqus.  Twisting of a strip whose
# free edges have a layer as wide as the thickness: lines are graded towards them.
def test_raasch_hook():
    first, second = np.deg2rad(60.0), np.deg2rad(150.0)
    end = np.array([14 * np.sin(first), 14 * np.cos(first) - 14])
    normal = np.array([np.sin(first), np.cos(first)])
    centre, start = end + 46 * normal, np.arctan2(-normal[1], -normal[0])

    def place(a, y):
        inner, outer = np.minimum(a, 1) * first, start + np.maximum(a - 1, 0) * second
        x = np.where(a <= 1, 14 * np.sin(inner), centre[0] + 46 * np.cos(outer))
        z = np.where(a <= 1, 14 * np.cos(inner) - 14, centre[1] + 46 * np.sin(outer))
        return x, y, z

    along = np.concatenate([np.linspace(0, 1, 5), np.linspace(1, 2, 15)[1:]])
    mesh = surface(place, along, 10 - 10 * np.cos(np.linspace(0, np.pi, 7)))
    shell = Shell(mesh, 2.0, Material(youngs_modulus=3300.0, poisson_ratio=0.35))
    share = shell.shares("r1") / shell.shares("r1").sum()
    u = respond(shell, [held(shell, "r0", 0, 1, 2)], np.outer(share, [0.0, 1.0, 0.0]))
    assert abs(tell("Raasch hook", 5.022, share @ u[:, 1])) < 1e-2
