"""Finite elements against published and exact values."""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from fea.body import Body
from fea.case import Case
from fea.dynamics import Dynamics
from fea.static_stiffness import tip_stiffness
from fea.statics import static
from lab.materials import Material
from lab.specimens import TwistedBeam
from meshes.block import beam_mesh
from meshes.options import MeshOptions


# MacNeal & Harder, Finite Elem. Anal. Des. 1 (1985) 3-20, twisted beam, thickness 0.32; refined values of
# Zupan & Saje (2004) 5.424535e-3 out of plane and 1.753248e-3 in plane (FinEtoolsFlexStructures.jl).
@pytest.mark.parametrize(("axis", "expected"), [(1, 1.753248e-3), (2, 5.424535e-3)])
def test_macneal_harder_twisted_beam(axis, expected):
    material = Material(youngs_modulus=29e6, poisson_ratio=0.22)
    specimen = TwistedBeam(length=12.0, width=1.1, thickness=0.32, twist=np.pi / 2, material=material)
    options = MeshOptions(along=40, across=4, through=2, grading_along=0.5)
    body = Body(beam_mesh(specimen, options), specimen.material)
    # The table is linear: a small force.
    run = static(Case(body).fix("root").force("tip", 1e-3 * np.eye(3)[axis]))
    assert run.displacement("tip")[-1, axis] * 1e3 == pytest.approx(expected, rel=5e-3)


# Exact elastica (elliptic integrals), P L^2/EI: (shortening, deflection)/L.  At h/L = 0.01 shear and
# stretch are below 1e-4 of it.
ELASTICA = {1.0: (0.056433236, 0.301720774), 4.0: (0.328941242, 0.669964181)}


def test_cantilever_follows_the_elastica():
    specimen = TwistedBeam(
        length=10.0, width=1.0, thickness=0.1, twist=0.0, material=Material(youngs_modulus=1.2e6, poisson_ratio=0.0)
    )
    body = Body(beam_mesh(specimen, MeshOptions(along=40, across=1, through=1, grading_along=0.0)), specimen.material)
    bending = 1.2e6 * 0.1**3 / 12
    case = Case(body).fix("root").force("tip", (0.0, 0.0, 4.0 * bending / 100.0))
    run = static(case, [factor / 4.0 for factor in ELASTICA])
    tips = run.displacement("tip")[1:] / 10.0
    for tip, (shortening, deflection) in zip(tips, ELASTICA.values(), strict=True):
        assert tip[2] == pytest.approx(deflection, rel=5e-3)
        assert -tip[0] == pytest.approx(shortening, rel=1e-2)


# Exact Timoshenko transfer matrix of the pretwisted beam 50 x 20 x 3 mm, E 26 MPa, rho 1210: f1, f2 in Hz.
# The solid is a few per cent stiffer: the clamp forbids Poisson's contraction (nu 0.45, L/w = 2.5), and
# a strip bends with E/(1 - nu^2) near it.
@pytest.mark.parametrize(("degrees", "expected"), [(0, (28.32725, 168.122)), (90, (28.76266, 90.77603))])
def test_first_modes_of_the_pretwisted_beam(degrees, expected):
    specimen = TwistedBeam(twist=np.deg2rad(degrees))
    body = Body(beam_mesh(specimen, MeshOptions()), specimen.material)
    system = Dynamics(body)
    pattern, taken = body.pattern.restrict(system.free)
    stiffness = pattern.full(body.tangent(np.zeros((body.nodes, 3)))[1][taken])
    squares = eigsh(stiffness.tocsc(), 4, system.mass.tocsc(), sigma=0.0, return_eigenvectors=False)
    frequencies = np.sort(np.sqrt(squares) / (2 * np.pi))
    # Torsion (table: 121.5 and 169.1 Hz) comes between the two bending modes at no twist.
    for value in expected:
        nearest = frequencies[np.argmin(np.abs(frequencies - value))]
        assert 0.98 < nearest / value < 1.08


def test_guided_end_against_timoshenko():
    # k = 1 / (L^3 / 12 EI + L / kappa G A), kappa = 5/6; nu = 0 takes the clamps' constraint away.
    # The rigid ends also forbid shear warping, which stiffens the short strong direction a little.
    specimen = TwistedBeam(twist=0.0, length=0.1, material=Material(poisson_ratio=0.0))
    body = Body(beam_mesh(specimen, MeshOptions(along=32, across=2, through=1)), specimen.material)
    stiffness = tip_stiffness(body)
    modulus, length, area = 26e6, 0.1, 0.02 * 0.003
    assert stiffness[0, 0] == pytest.approx(modulus * area / length, rel=1e-9)
    for axis, depth, tolerance in ((1, 0.02, 0.02), (2, 0.003, 0.005)):
        bending = modulus * area * depth**2 / 12
        expected = 1 / (length**3 / (12 * bending) + length / (5 / 6 * modulus / 2 * area))
        assert stiffness[axis, axis] == pytest.approx(expected, rel=tolerance)
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-9 * stiffness.max())
