"""Natural frequencies and buckling loads of shells against exact and published values."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from fea.linear import make_solver
from fea.modes import buckling, natural_modes
from fea.shell import Shell
from lab.materials import Material
from meshes.structured import surface_mesh

STEEL = Material(youngs_modulus=2e11, poisson_ratio=0.3, density=8000.0)


def modes_of(shell, held, count):
    pattern, taken = shell.pattern.restrict(np.setdiff1d(np.arange(3 * shell.nodes), held))
    stiffness = shell.tangent(np.zeros((shell.nodes, 3)))[1]
    found = natural_modes(pattern, stiffness[taken], shell.mass()[taken], count)
    assert not found.missed
    return found


def clamped(shell, name="root"):
    return (3 * shell.boundary(name)[:, None] + np.arange(3)).ravel()


def compare(name, expected, ours, within):
    errors = np.asarray(ours) / np.asarray(expected) - 1
    print(f"{name}: reference {np.round(expected, 4)}, ours {np.round(ours, 4)}, error {np.round(100 * errors, 2)} %")
    assert np.abs(errors).max() < within


def square(thickness, counts):
    return Shell(
        surface_mesh(counts, lambda a, b: np.stack([10 * a, 10 * b, 0 * a], axis=1), ("x", "x", "y", "y")),
        thickness, STEEL,
    )  # fmt: skip


def test_nafems_fv12_free_plate():
    expected = [1.622, 2.360, 2.922, 4.190, 4.190, 7.356, 7.356, 7.668]
    frequencies = modes_of(square(0.05, (8, 8)), [], 14).frequencies
    np.testing.assert_array_equal(frequencies[:6], 0.0)
    compare("FV12", expected, frequencies[6:], 0.005)


def test_nafems_fv52_thick_plate():
    # The table is Mindlin's theory with hard supports: w and the turn along the edge are held.  Held on its lower
    # edges alone, a solid is softer (44.1 Hz), and the softer the finer the mesh: a line support is a singularity.
    shell = square(1.0, (8, 8))
    x, y = shell.boundary("x"), shell.boundary("y")
    held = np.unique(np.concatenate([3 * x + 2, 3 * y + 2, 3 * x + 1, 3 * y]))
    found = modes_of(shell, held, 8)
    flat = np.zeros((8, 3 * shell.nodes))
    flat[:, np.setdiff1d(np.arange(3 * shell.nodes), held)] = found.shapes
    bending = [abs(s[2::3]).max() > abs(s[0::3]).max() + abs(s[1::3]).max() for s in flat]
    compare("FV52", [45.897, 109.44, 109.44, 167.89], found.frequencies[bending][:4], 0.005)


def test_sze31_cantilever():
    material = Material(youngs_modulus=1.2e6, poisson_ratio=0.0, density=3.1314e-4)
    mesh = surface_mesh((8, 1), lambda a, b: np.stack([10 * a, b, 0 * a], axis=1), ("root", "tip", "", ""))
    shell = Shell(mesh, 0.1, material)
    compare("sze31", [10.0], modes_of(shell, clamped(shell), 1).frequencies, 0.002)


def turned(length, width, thickness, twist, material, counts):
    def place(a, b):
        y, angle = width * (b - 0.5), twist * a
        return np.stack([length * a, y * np.cos(angle), y * np.sin(angle)], axis=1)

    return Shell(surface_mesh(counts, place, ("root", "tip", "", "")), thickness, material)


def timoshenko(length, width, thickness, twist, material, count):
    """Lowest bending frequencies (Hz) of a pre-twisted cantilever, exact Timoshenko theory with shear factor 5/6.

    In the turning axes of the section the equations have constant coefficients: y' = A y with the deflections,
    turns, moments and shear forces along both axes.
    """
    e, g, rho = material.youngs_modulus, material.shear_modulus, material.density
    area, weak, strong = width * thickness, width * thickness**3 / 12, thickness * width**3 / 12
    rate, spin = twist / length, np.array([[0.0, -1.0], [1.0, 0.0]])
    # First axis along the width: deflection there bends about the strong axis.
    inertia, one, none = np.diag([strong, weak]), np.eye(2), np.zeros((2, 2))

    def determinant(frequency):
        w2 = (2 * np.pi * frequency) ** 2
        rows = np.block(
            [
                [none, one, none, one / (5 / 6 * g * area)],
                [none, none, np.linalg.inv(e * inertia), none],
                [none, -rho * w2 * inertia, none, -one],
                [-rho * area * w2 * one, none, none, none],
            ]
        )
        moved = expm(length * (rows - rate * np.kron(np.eye(4), spin)))
        corner = moved[4:, 4:]
        return np.linalg.det(corner / np.abs(corner).max())

    scan = np.geomspace(1.0, 200.0, 1500) / 2 / np.pi * np.sqrt(e * weak / (rho * area)) / length**2
    values = [determinant(f) for f in scan]
    ends = [(a, b) for a, b, u, v in zip(scan, scan[1:], values, values[1:], strict=False) if u * v < 0]
    return np.array([brentq(determinant, a, b) for a, b in ends[:count]])


@pytest.mark.parametrize("degrees", [0, 45, 90, 180])
def test_slender_pretwisted_cantilever(degrees):
    # Slender, so that the clamp's and the twist's effects outside beam theory stay below 1 %.
    material = Material(youngs_modulus=26e6, poisson_ratio=0.0, density=1210.0)
    sizes = (0.5, 0.02, 0.01, np.deg2rad(degrees))
    expected = timoshenko(*sizes, material, 4)
    shell = turned(*sizes, material, (24, 2))
    found = modes_of(shell, clamped(shell), 4)
    compare(f"pre-twisted {degrees} deg", expected, found.frequencies, 0.01)


def test_exact_theory_repeats_the_beams_without_twist():
    material = Material(youngs_modulus=26e6, poisson_ratio=0.45, density=1210.0)
    flat = timoshenko(0.05, 0.02, 0.003, 0.0, material, 4)
    np.testing.assert_allclose(flat, [28.32725, 168.122, 174.32669, 474.8063], rtol=1e-4)
    right = timoshenko(0.05, 0.02, 0.003, np.pi / 2, material, 4)
    np.testing.assert_allclose(right, [28.76266, 90.77603, 293.15845, 389.90222], rtol=1e-4)


def test_euler_column():
    length, width, height, young = 1.0, 0.05, 0.01, 1e9
    material = Material(youngs_modulus=young, poisson_ratio=0.0, density=1.0)
    shell = turned(length, width, height, 0.0, material, (8, 1))
    pattern, taken = shell.pattern.restrict(np.setdiff1d(np.arange(3 * shell.nodes), clamped(shell)))
    free = np.setdiff1d(np.arange(3 * shell.nodes), clamped(shell))
    at_rest = shell.tangent(np.zeros((shell.nodes, 3)))[1][taken]
    push = np.zeros((shell.nodes, 3))
    push[:, 0] = -shell.shares("tip") / shell.shares("tip").sum()
    solver = make_solver("auto", pattern)
    solver.factorise(at_rest)
    share, pressed = 1e-3, np.zeros(3 * shell.nodes)
    pressed[free] = share * solver.solve(push.reshape(-1)[free])
    geometric = (shell.tangent(pressed.reshape(-1, 3))[1][taken] - at_rest) / share
    found = buckling(pattern, at_rest, geometric, 4)
    euler = np.pi**2 * young * width * height**3 / 12 / (4 * length**2)
    wide = np.pi**2 * young * height * width**3 / 12 / (4 * length**2)
    assert not found.missed
    compare("Euler column", sorted([euler, 9 * euler, 25 * euler, wide]), found.factors, 0.005)
