"""Element forces, tangents and masses."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, LinearForm
from skfem.helpers import ddot, dot, eye, grad, mul, trace, transpose

from fea.body import Body
from fea.linear import SOLVERS, SingularMatrixError, make_solver
from fea.materials import LAWS
from fea.rotations import rotation
from lab.materials import Material
from meshes.block import block_mesh, moved
from meshes.options import MeshOptions


def block(along=1, across=1, through=1, lengths=(1.0, 1.0, 1.0)):
    return block_mesh(lengths, MeshOptions(along=along, across=across, through=through))


def distorted():
    """Unit cube whose inner nodes are shaken, so that edges are curved."""
    mesh = block(2, 2, 2)
    points = mesh.doflocs.T.copy()
    inside = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=1)
    points[inside] += np.random.default_rng(0).uniform(-0.04, 0.04, (inside.sum(), 3))
    return moved(mesh, points)


@pytest.fixture(params=LAWS)
def body(request):
    return Body(distorted(), Material(law=request.param, youngs_modulus=1.0, poisson_ratio=0.3))


def random_field(body, size, seed=1):
    return size * np.random.default_rng(seed).standard_normal((body.nodes, 3))


def test_force_is_derivative_of_energy(body):
    u, w, h = random_field(body, 0.005), random_field(body, 1.0, 2), 1e-6
    slope = (body.strain_energy(u + h * w).sum() - body.strain_energy(u - h * w).sum()) / (2 * h)
    assert np.vdot(body.internal_force(u), w) == pytest.approx(slope, rel=1e-7)


@pytest.mark.parametrize("viscosity", [0.0, 2.0])
def test_tangent_is_derivative_of_force(body, viscosity):
    u, w, h = random_field(body, 0.005), random_field(body, 1.0, 2), 1e-6
    past = -viscosity * body.strains(random_field(body, 0.005, 3))
    ahead, behind = (body.internal_force(u + sense * w, viscosity, past) for sense in (h, -h))
    slope = (ahead - behind) / (2 * h)
    force, data = body.tangent(u, viscosity, past)
    np.testing.assert_allclose(force, body.internal_force(u, viscosity, past), atol=1e-14)
    product = body.pattern.times(data, w.ravel())
    np.testing.assert_allclose(product, slope.ravel(), atol=1e-7 * np.abs(product).max())


def test_tangent_after_a_step_drops_its_second_order_stress():
    body = Body(distorted(), Material(youngs_modulus=1.0, poisson_ratio=0.3))
    u, step = random_field(body, 0.005), random_field(body, 0.003, 2)
    # For a linear law and no earlier displacement the linearised stress is that of sym(grad step).
    _, exact = body.tangent(np.zeros((body.nodes, 3)))
    _, small = body.tangent(1e-8 * u, step=1e-8 * step)
    np.testing.assert_allclose(small, exact, atol=1e-6)


def test_rigid_motion_costs_nothing_and_turns_forces(body):
    turn = rotation(np.array([0.4, -1.1, 0.7]))
    rigid = body.points @ (turn - np.eye(3)).T + np.array([1.0, 2.0, 3.0])
    assert body.strain_energy(rigid).sum() == pytest.approx(0.0, abs=1e-14)
    u = random_field(body, 0.005)
    both = rigid + u @ turn.T
    np.testing.assert_allclose(body.strains(both), body.strains(u), atol=1e-12)
    np.testing.assert_allclose(body.internal_force(both), body.internal_force(u) @ turn.T, atol=1e-12)


def test_patch_of_distorted_hexahedra_carries_uniform_strain():
    body = Body(distorted(), Material(youngs_modulus=1.0, poisson_ratio=0.3))
    h = np.array([[0.01, 0.02, 0.0], [-0.01, 0.03, 0.01], [0.0, 0.02, -0.02]])
    u = body.points @ h.T
    force = body.internal_force(u)
    inside = ((body.points > 1e-9) & (body.points < 1 - 1e-9)).all(axis=1)
    np.testing.assert_allclose(force[inside], 0.0, atol=1e-15)
    strains = body.strains(u).reshape(-1, 6)
    np.testing.assert_allclose(strains, np.broadcast_to(strains[0], strains.shape), atol=1e-13)
    assert body.weights.sum() == pytest.approx(1.0, rel=1e-9)


def test_scikit_fems_own_forms_agree():
    material = Material(youngs_modulus=1.0, poisson_ratio=0.3)
    body = Body(block(2, 1, 1), material)
    mu, lam = material.shear_modulus, material.lame_lambda
    basis = Basis(body.mesh, ElementVector(ElementHex2()), intorder=5)

    def parts(h):
        f = grad(h) + eye(1.0 + 0 * grad(h)[0, 0], 3)
        e = 0.5 * (mul(transpose(f), f) - eye(1.0 + 0 * f[0, 0], 3))
        return f, lam * eye(trace(e), 3) + 2 * mu * e

    @LinearForm
    def residual(v, w):
        f, s = parts(w["u"])
        return ddot(mul(f, s), grad(v))

    @BilinearForm
    def tangent(u, v, w):
        f, s = parts(w["u"])
        de = 0.5 * (mul(transpose(f), grad(u)) + mul(transpose(grad(u)), f))
        return ddot(mul(grad(u), s) + mul(f, lam * eye(trace(de), 3) + 2 * mu * de), grad(v))

    @BilinearForm
    def mass(u, v, w):
        return dot(u, v)

    # Unknown 3 node + axis of the body, in scikit-fem's own numbering.
    number = np.empty(3 * body.nodes, dtype=int)
    number[(3 * body.cells[:, :, None] + np.arange(3)).reshape(len(body.cells), -1).T] = basis.element_dofs
    u = random_field(body, 0.02)
    vector = np.empty(basis.N)
    vector[number] = u.ravel()
    field = basis.interpolate(vector)
    force, data = body.tangent(u)
    np.testing.assert_allclose(residual.assemble(basis, u=field)[number], force.ravel(), atol=1e-13)
    theirs = csr_matrix(tangent.assemble(basis, u=field))[number][:, number].toarray()
    np.testing.assert_allclose(body.pattern.full(data).toarray(), theirs, atol=1e-13)
    heavy = body.pattern.full(Body(body.mesh, material, 7.0).mass()).toarray()
    np.testing.assert_allclose(heavy, 7.0 * csr_matrix(mass.assemble(basis))[number][:, number].toarray(), atol=1e-14)


def test_mass_totals_and_face_mass():
    body = Body(block(2, 2, 1, (2.0, 1.0, 0.5)), Material(), density=3.0)
    ones = np.ones(3 * body.nodes)
    assert body.pattern.times(body.mass({"tip": 5.0}), ones).sum() == pytest.approx(3 * (3.0 * 1.0 + 5.0))
    assert body.shares("tip").sum() == pytest.approx(0.5)


def test_unknown_boundary_is_named():
    with pytest.raises(ValueError, match="no boundary 'top'"):
        Body(block(), Material()).boundary("top")


@pytest.fixture
def clamped():
    body = Body(block(3, 2, 1), Material(youngs_modulus=2.0, poisson_ratio=0.4))
    root = body.boundary("root")
    free = np.setdiff1d(np.arange(3 * body.nodes), (3 * root[:, None] + np.arange(3)).ravel())
    pattern, taken = body.pattern.restrict(free)
    return pattern, body.tangent(random_field(body, 0.01))[1][taken]


@pytest.mark.parametrize("kind", SOLVERS)
def test_solvers_solve(clamped, kind):
    pattern, data = clamped
    solver, right = make_solver(kind, pattern), np.random.default_rng(0).standard_normal((pattern.size, 2))
    for factor in (1.0, 2.0):
        solver.factorise(factor * data)
        expected = np.linalg.solve(factor * pattern.full(data).toarray(), right)
        np.testing.assert_allclose(solver.solve(right), expected, atol=1e-8 * np.abs(expected).max())
        np.testing.assert_allclose(solver.solve(right[:, 0]), expected[:, 0], atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("kind", SOLVERS)
def test_solvers_refuse_nan(clamped, kind):
    pattern, data = clamped
    with pytest.raises(SingularMatrixError, match="not finite"):
        make_solver(kind, pattern).factorise(np.nan * data)


def test_unknown_solver_is_named(clamped):
    with pytest.raises(ValueError, match="no linear solver 'lu'"):
        make_solver("lu", clamped[0])
