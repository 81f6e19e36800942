"""Slender parts in large rotation, shells and hexahedra, against exact elasticas and published twisted beams."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from fea import Body, Case, Shell, Steer, static
from lab.materials import Material
from meshes.structured import solid_mesh, surface_mesh, thickened


def part(kind, place, counts, thickness, material):
    """Shell, or hexahedra two through the thickness, over the same surface; edges root, tip at a = 0, 1."""
    if kind == "shell":
        return Shell(surface_mesh(counts, place, ("root", "tip", "low", "high")), thickness, material)
    names = ("root", "tip", "low", "high", "under", "over")
    return Body(solid_mesh((*counts, 2), thickened(place, thickness), names), material)


def twisted(length, width, turn=np.pi / 2):
    """A strip along x, its width along y at the root, turned by ``turn`` about x at the tip."""
    return lambda a, b: np.column_stack(
        [length * a, width * (b - 0.5) * np.cos(turn * a), width * (b - 0.5) * np.sin(turn * a)]
    )


def elastica(load):
    """Shortening and deflection over L of a cantilever, P L^2 / EI = ``load``, in elliptic integrals."""

    def residual(turn):
        m = 0.5 * (1 + np.sin(turn))
        return ellipk(m) - ellipkinc(np.arcsin(1 / np.sqrt(2 * m)), m) - np.sqrt(load)

    turn = brentq(residual, 1e-12, np.pi / 2 - 1e-12, xtol=1e-15)
    m = 0.5 * (1 + np.sin(turn))
    arc = ellipe(m) - ellipeinc(np.arcsin(1 / np.sqrt(2 * m)), m)
    return 1 - np.sqrt(2 * np.sin(turn) / load), 1 - 2 / np.sqrt(load) * arc


@pytest.mark.parametrize("kind", ["shell", "solid"])
def test_cantilever_is_an_elastica(compare, kind):
    """To P L^2 / EI = 10; stretch and shear at h/L = 0.01, which the elastica has not, are of the order of 1e-4."""
    loads = np.array([1.0, 2.0, 4.0, 7.0, 10.0])
    strip = part(
        kind,
        lambda a, b: np.column_stack([10 * a, b, 0 * a]),
        (16 if kind == "shell" else 40, 1),
        0.1,
        Material(youngs_modulus=1.2e6, poisson_ratio=0.0),
    )
    case = Case(strip).fix("root").force("tip", (0, 0, 10.0)).watch("A", "tip")
    run = static(case, loads / 10)
    assert run.completed, run.reason
    ours = run.displacement("A")[1:, [0, 2]] * [-0.1, 0.1]
    exact = np.array([elastica(load) for load in loads])
    assert (compare(["-u/L", "w/L"], loads, exact, ours, run) < (1e-3 if kind == "shell" else 0.01)).all()


@pytest.mark.parametrize("elements", [6, 24])
def test_pinched_ring(reference, compare, elements):
    """Two opposite point forces until they meet; R/t = 100, so that stretch and shear are of the order of 1e-4."""
    radius, wall, width, modulus = 1.0, 0.01, 0.05, 1e9

    def place(a, b):
        angle = a * np.pi / 2
        return np.column_stack([radius * np.sin(angle), width * b, radius * np.cos(angle)])

    rows = reference("pinched_ring")
    mesh = surface_mesh((elements, 1), place, ("crown", "side", "", ""))
    case = Case(Shell(mesh, wall, Material(youngs_modulus=modulus, poisson_ratio=0.0)))
    case.symmetry("crown", "x").symmetry("side", "z").fix((0, 0, radius), "y", layer="middle")

    bending = modulus * width * wall**3 / 12
    case.force("crown", (0, 0, -0.5 * bending / radius**2)).watch("A", "crown").watch("B", "side")
    run = static(case, rows[:, 0] / 2, Steer("A", "z", -radius))
    assert run.completed, run.reason
    ours = np.column_stack([run.t[1:], 2 * run.displacement("B")[1:, 0]])
    errors = compare(["P R^2/EI", "widening"], rows[:, 0], rows[:, 1:], ours, run)
    assert (errors < (0.01 if elements == 6 else 2e-3)).all()


@pytest.mark.parametrize("kind", ["shell", "solid"])
def test_twisted_beam_in_large_rotation(reference, compare, kind):
    """BeamDyn's beam, 10 x 0.5 x 0.25, twisted by 90 degrees; tip force 4000 kN against the wide side of the root.

    Reference: refined solids; beam elements scatter by 0.3 % around them.  Shells of t/w = 1/2 are none any more, but
    a solid shell still answers.
    """
    expected = np.abs(reference("beamdyn_twisted_beam")[0])
    material = Material(youngs_modulus=200e9, poisson_ratio=200 / (2 * 79.3) - 1)
    beam = part(kind, twisted(10.0, 0.5), (20, 2), 0.25, material)
    run = static(Case(beam).fix("root").force("tip", (0, -4e6, 0)).watch("A", "tip"))
    assert run.completed, run.reason
    moved = np.abs(run.displacement("A")[-1])[[0, 2, 1]]
    assert (compare(["u1", "u2", "u3"], [1.0], expected, moved, run) < 0.01).all()


# MacNeal and Harder (1985) as refined by Zupan and Saje (2004); thin: what four elements of Abaqus converge to, in
# github PetrKryslUCSD/FinEtoolsFlexStructures.jl, twisted_beam_examples.jl and twisted_extrap_thin.jl.
MACNEAL_HARDER = {(0.32, 1): 1.753248e-3, (0.32, 2): 5.424535e-3, (0.0032, 1): 1.29513e-3, (0.0032, 2): 5.24987e-3}


@pytest.mark.parametrize(("thickness", "axis"), MACNEAL_HARDER)
def test_macneal_harder_twisted_beam_as_shell(compare, thickness, axis):
    """Loads so small, 1 and 1e-6, that the answer is linear; 12 x 2."""
    beam = part("shell", twisted(12.0, 1.1), (12, 2), thickness, Material(youngs_modulus=29e6, poisson_ratio=0.22))
    load = 1.0 if thickness == 0.32 else 1e-6
    case = Case(beam).fix("root").force("tip", load * np.eye(3)[axis]).watch("A", "tip")
    run = static(case)
    assert run.completed, run.reason
    ours = run.displacement("A")[-1, axis] / load * (1.0 if thickness == 0.32 else 1e-6)
    assert compare([f"u{axis + 1}"], [1.0], [MACNEAL_HARDER[thickness, axis]], [ours], run)[0] < 0.01
