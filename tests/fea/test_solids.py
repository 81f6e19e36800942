"""Hexahedra and tetrahedra under every law: patch test, objectivity, consistency, rank, surfaces, refusals."""

from math import factorial

import numba
import numpy as np
import pytest
from skfem import ElementTetP2, MeshHex, MeshHex2, MeshQuad, MeshTet, MeshTet2

from fea import kernels
from fea.body import Body
from fea.elements import TETRAHEDRON
from fea.materials import LAWS
from fea.rotations import rotation
from fea.viscosity import ViscousHistory
from lab.materials import Material, PronyBranch
from meshes.block import block_mesh, moved
from meshes.options import MeshOptions

SHAPES = {"mooney-rivlin": {"c01_share": 0.3}, "yeoh": {"c20_ratio": -0.2, "c30_ratio": 0.1}}
KINDS = ("hexahedra", "tetrahedra")


def material(law, poisson_ratio=0.3):
    return Material(law=law, youngs_modulus=1.0, poisson_ratio=poisson_ratio, **SHAPES.get(law, {}))


def mesh_of(kind, cells=2, shake=0.04, seed=0):
    """Unit cube, its nodes shaken where they lie inside, or all of a single element's."""
    if kind == "hexahedra":
        mesh = block_mesh((1.0, 1.0, 1.0), MeshOptions(along=cells, across=cells, through=cells))
    else:
        grid = np.linspace(0, 1, cells + 1)
        mesh = MeshTet2.from_mesh(MeshTet.init_tensor(grid, grid, grid))
        mesh = mesh.with_boundaries({"root": lambda x: x[0] < 1e-9, "tip": lambda x: x[0] > 1 - 1e-9})
    return shaken(mesh, shake, seed)


def shaken(mesh, size, seed=0, everywhere=False):
    points = mesh.doflocs.T.copy()
    inside = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=1) | everywhere
    points[inside] += np.random.default_rng(seed).uniform(-size, size, (inside.sum(), 3))
    return type(mesh)(np.ascontiguousarray(points.T), mesh.t, _boundaries=mesh.boundaries)


def single(kind, law="saint-venant-kirchhoff", poisson_ratio=0.3, size=0.06):
    """One element with curved edges."""
    mesh = MeshHex2() if kind == "hexahedra" else MeshTet2.from_mesh(MeshTet.init_refdom())
    return Body(shaken(mesh, size, 3, everywhere=True), material(law, poisson_ratio))


def random_field(body, size, seed=1):
    return size * np.random.default_rng(seed).standard_normal((body.nodes, 3))


def inner(body):
    return np.setdiff1d(np.arange(body.nodes), body.boundary("all"))


AFFINE = np.array([[0.1, 0.2, 0.0], [-0.1, 0.15, 0.1], [0.05, 0.2, -0.1]])


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


@pytest.fixture(params=LAWS)
def law(request):
    return request.param


def test_patch_of_distorted_elements_finds_the_uniform_strain(kind, law):
    body = Body(mesh_of(kind), material(law))
    exact, free = body.points @ AFFINE.T, inner(body)
    u = exact.copy()
    u[free] = 0.3 * exact[free]
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    for _ in range(8):
        force, data = body.tangent(u)
        stiffness = body.pattern.full(data).toarray()[np.ix_(unknowns, unknowns)]
        u[free] -= np.linalg.solve(stiffness, force[free].ravel()).reshape(-1, 3)
    np.testing.assert_allclose(u, exact, atol=1e-13)
    assert len(free) > 5
    stresses = body.stresses(u).reshape(-1, 6)
    np.testing.assert_allclose(stresses, np.broadcast_to(stresses[0], stresses.shape), atol=1e-12)
    assert np.abs(stresses[0]).max() > 0.05
    assert body.volumes.sum() == pytest.approx(1.0, rel=1e-9)


def test_uniform_stress_is_the_tractions_on_the_outside(kind, law):
    body = Body(mesh_of(kind), material(law))
    u = body.points @ AFFINE.T
    # A cube's face of normal x carries sigma dA, by Nanson's formula.
    area = np.linalg.det(np.eye(3) + AFFINE) * np.linalg.inv(np.eye(3) + AFFINE).T[:, 0]
    xx, yy, zz, xy, xz, yz = body.stresses(u)[0, 0]
    traction = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ area
    tip = body.boundary("tip")
    rim = np.isin(tip, np.flatnonzero((body.points[:, 1:] < 1e-9).any(1) | (body.points[:, 1:] > 1 - 1e-9).any(1)))
    share = body.shares("tip")[tip]
    np.testing.assert_allclose(body.internal_force(u)[tip[~rim]], np.outer(share[~rim], traction), atol=1e-12)


def test_rigid_motion_turns_forces_and_costs_nothing(kind, law):
    body = single(kind, law)
    turn = rotation(np.array([0.4, -1.1, 0.7]))
    rigid = body.points @ (turn - np.eye(3)).T + np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(body.strain_energy(rigid), 0.0, atol=1e-14)
    np.testing.assert_allclose(body.internal_force(rigid), 0.0, atol=1e-14)
    u = random_field(body, 0.02)
    both = rigid + u @ turn.T
    np.testing.assert_allclose(body.internal_force(both), body.internal_force(u) @ turn.T, atol=1e-13)
    np.testing.assert_allclose(body.strain_energy(both), body.strain_energy(u), atol=1e-14)


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.499])
def test_force_and_tangent_are_derivatives_of_the_energy(kind, law, poisson_ratio):
    body = single(kind, law, poisson_ratio)
    u, h = random_field(body, 0.02), 1e-6
    force, data = body.tangent(u)
    full = body.pattern.full(data).toarray()
    np.testing.assert_array_equal(full, full.T)
    np.testing.assert_allclose(force, body.internal_force(u), atol=1e-14)
    for n in range(3 * body.nodes):
        step = np.zeros(3 * body.nodes)
        step[n] = h
        ahead, behind = u + step.reshape(-1, 3), u - step.reshape(-1, 3)
        slope = (body.strain_energy(ahead) - body.strain_energy(behind)).sum() / (2 * h)
        assert slope == pytest.approx(force.ravel()[n], abs=1e-7 * np.abs(force).max() + 1e-9)
        column = (body.internal_force(ahead) - body.internal_force(behind)).ravel() / (2 * h)
        np.testing.assert_allclose(full[:, n], column, atol=1e-7 * np.abs(full).max())


def test_viscous_tangent_is_derivative_of_viscous_force(kind, law):
    body = single(kind, law)
    branched = body.material.model_copy(update={"prony": (PronyBranch(ratio=0.5, time=0.3),), "viscous_time": 0.02})
    history = ViscousHistory.begin(branched, body.strains(random_field(body, 0.02, 5)))
    viscosity, past = history.coefficients(0.1)
    u, w, h = random_field(body, 0.02), random_field(body, 1.0, 2), 1e-6
    force, data = body.tangent(u, viscosity, past)
    slope = (body.internal_force(u + h * w, viscosity, past) - body.internal_force(u - h * w, viscosity, past)) / (
        2 * h
    )
    product = body.pattern.times(data, w.ravel())
    np.testing.assert_allclose(product, slope.ravel(), atol=1e-7 * np.abs(product).max())
    assert np.abs(force - body.internal_force(u)).max() > 0.01 * np.abs(force).max()


def test_a_prony_body_relaxes_to_its_long_term_stress():
    branch = PronyBranch(ratio=2.0, time=0.5)
    body = Body(MeshHex2(), Material(youngs_modulus=1.0, poisson_ratio=0.3, viscous_time=0.0, prony=(branch,)))
    rest, u = np.zeros((27, 3)), body.points @ np.diag([1e-3, 0.0, 0.0])
    history = ViscousHistory.begin(body.material, body.strains(rest)).accept(body.strains(u), 1e-9)
    elastic = body.internal_force(u)
    for step in (0.2, 0.7, 30.0):
        after = body.internal_force(u, *history.coefficients(step))
        history = history.accept(body.strains(u), step)
        factor = 1 + 2.0 * np.exp(-{0.2: 0.2, 0.7: 0.9, 30.0: 30.9}[step] / 0.5)
        np.testing.assert_allclose(after, factor * elastic, atol=1e-6 * np.abs(elastic).max())


def test_a_turning_step_does_not_stiffen_the_next_turn(kind, law):
    # A linear step along a rotation stretches in second order; the tangent must not see that.
    body = single(kind, law, 0.499)
    spin = np.cross(np.array([0.1, -0.05, 0.08]), body.points)
    turn = np.cross(np.array([0.2, 0.3, -0.1]), body.points + spin).ravel()
    spoilt, mended = (body.pattern.times(body.tangent(spin, step=s)[1], turn) for s in (None, spin))
    assert np.linalg.norm(mended) < 0.05 * np.linalg.norm(spoilt)


def test_only_rigid_motions_are_without_stiffness(kind, law):
    for body in (single(kind, law, 0.3, 0.0), single(kind, law, 0.49)):
        values = np.linalg.eigvalsh(body.pattern.full(body.tangent(np.zeros((body.nodes, 3)))[1]).toarray())
        assert np.abs(values[:6]).max() < 1e-12 * values[-1]
        assert values[6] > 1e-5 * values[-1]


def test_projection_replaces_pressure_by_a_polynomial(kind):
    body = single(kind, "yeoh", 0.4999)
    pointwise = Body(body.mesh, body.material, project_volume=False)
    u = random_field(body, 0.01)
    assert body.strain_energy(u).sum() < pointwise.strain_energy(u).sum()
    pressure, rough = (part.stresses(u)[0, :, :3].mean(axis=1) for part in (body, pointwise))
    columns = np.ones((len(pressure), 1))
    if kind == "hexahedra":
        assert body.solid.pointwise == 0
        columns = np.hstack([columns, body.basis.global_coordinates().value[:, 0].T])
    else:
        assert body.solid.pointwise == pytest.approx(2.9 / 0.3 / (2.9998 / 0.0006), rel=1e-4)

    def roughness(values):
        return np.abs(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]).max()

    assert roughness(pressure - body.solid.pointwise * rough) < 1e-12 * np.abs(rough).max()
    assert roughness(rough) > 0.1 * np.abs(rough).max()


def test_an_element_turned_inside_out_gives_nan_and_no_other(kind, law):
    body = Body(mesh_of(kind), material(law))
    u = np.zeros((body.nodes, 3))
    node = body.cells[0, np.argmin(np.abs(body.points[body.cells[0]]).sum(axis=1))]
    u[node] = 1.5 * (body.points[body.cells[0]].mean(axis=0) - body.points[node]) / 0.25
    force, data = body.tangent(u)
    far = np.setdiff1d(np.arange(body.nodes), body.cells[(body.cells == node).any(axis=1)])
    assert np.isnan(force[node]).all()
    assert np.isnan(data).any()
    assert np.isfinite(force[far]).all()
    np.testing.assert_array_equal(np.isnan(force), np.isnan(body.internal_force(u)))


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "yeoh"])
def test_any_number_of_threads_gives_the_same_bits(kind, law, monkeypatch):
    body = Body(mesh_of(kind, 3), material(law))
    u, before = random_field(body, 0.005), numba.get_num_threads()
    monkeypatch.setattr(kernels, "WORTH_SHARING", 0)
    results = []
    try:
        for threads in (1, before):
            numba.set_num_threads(threads)
            results.append((*body.tangent(u, step=0.1 * u), body.internal_force(u)))
    finally:
        numba.set_num_threads(before)
    for one, many in zip(*results, strict=True):
        np.testing.assert_array_equal(one, many)
    if before == 1:
        pytest.skip("one thread only: nothing to compare")


def test_warming_up_compiles_what_large_meshes_use(monkeypatch):
    kernels.warm_up()
    body = Body(mesh_of("tetrahedra", 1), material("neo-hookean"))
    monkeypatch.setattr(kernels, "WORTH_SHARING", 0)
    before = [len(f.signatures) for f in (kernels._forces_shared, kernels._tangents_shared)]
    body.tangent(random_field(body, 0.01))
    assert [len(f.signatures) for f in (kernels._forces_shared, kernels._tangents_shared)] == before


def test_elements_of_one_colour_share_no_node(kind):
    body = Body(mesh_of(kind, 3), material("yeoh"))
    scatter = body._scatter
    assert sorted(scatter.order) == list(range(len(body.cells)))
    for elements in np.split(scatter.order, scatter.ends[:-1]):
        assert len(np.unique(body.cells[elements])) == body.cells[elements].size


@pytest.mark.parametrize("name", ["all", "tip"])
def test_surfaces_look_outward(kind, name):
    body = Body(mesh_of(kind), material("yeoh"))
    surface = body.surface(name)
    shapes = surface.shapes()
    places = np.einsum("qk,fkc->fqc", shapes.values, body.points[surface.facets])
    tangents = np.einsum("qjk,fkc->fqjc", shapes.slopes, body.points[surface.facets])
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * shapes.weights[:, None]
    if name == "all":
        assert np.sum(places * normals) / 3 == pytest.approx(1.0, rel=1e-9)
        np.testing.assert_allclose(normals.sum(axis=(0, 1)), 0.0, atol=1e-12)
    else:
        np.testing.assert_allclose(normals.sum(axis=(0, 1)), [1.0, 0.0, 0.0], atol=1e-12)
    assert body.shares(name).sum() == pytest.approx(6.0 if name == "all" else 1.0)
    np.testing.assert_array_equal(body.boundary("tip"), np.flatnonzero(body.points[:, 0] > 1 - 1e-9))


def left_handed():
    grid = np.linspace(0, 1, 3)
    return MeshHex.init_tensor(grid, grid, grid)


@pytest.mark.parametrize("mesh", [left_handed(), MeshTet.init_tensor(*[np.linspace(0, 1, 3)] * 3)])
def test_linear_meshes_of_either_hand_get_quadratic_nodes_and_keep_boundaries(mesh):
    mesh = mesh.with_boundaries({"tip": lambda x: x[0] > 1 - 1e-9})
    body = Body(mesh, material("neo-hookean"))
    assert body.nodes == 125
    assert len(body.boundary("tip")) == 25
    surface = body.surface("all")
    shapes = surface.shapes()
    places = np.einsum("qk,fkc->fqc", shapes.values, body.points[surface.facets])
    tangents = np.einsum("qjk,fkc->fqjc", shapes.slopes, body.points[surface.facets])
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1]) * shapes.weights[:, None]
    assert np.sum(places * normals) / 3 == pytest.approx(1.0)
    points, cells, vtk_type, carry = body.picture()
    corner, *others = (points[cells[:, n]] for n in ((0, 1, 3, 4) if vtk_type == 29 else (0, 1, 2, 3)))
    edges = np.stack([other - corner for other in others], axis=1)
    assert (np.linalg.det(edges) > 0).all()
    assert carry(points) is points


def test_picture_is_what_vtk_understands(kind):
    pyvista = pytest.importorskip("pyvista")
    body = Body(mesh_of(kind, shake=0.0), material("yeoh"))
    points, cells, vtk_type, _ = body.picture()
    grid = pyvista.UnstructuredGrid({vtk_type: cells}, points)
    assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(1.0, rel=1e-6)
    np.testing.assert_allclose(grid.bounds, [0, 1, 0, 1, 0, 1])


def test_mass_of_tetrahedra_carries_linear_fields_exactly():
    body = Body(mesh_of("tetrahedra", shake=0.03), material("yeoh"), density=3.0)
    data = body.mass({"tip": 5.0})
    x = body.points[:, 0]
    motion = np.stack([x, 0 * x, 0 * x], axis=1).ravel()
    assert motion @ body.pattern.times(data, motion) == pytest.approx(3.0 / 3 + 5.0)
    values = np.linalg.eigvalsh(body.pattern.full(data).toarray())
    assert values[0] > 0


def test_scikit_fems_basis_is_at_hand(kind):
    body = Body(mesh_of(kind), material("yeoh"))
    np.testing.assert_allclose(body.basis.dx, body.weights, rtol=1e-12)
    np.testing.assert_allclose(body.basis.doflocs.T, body.points, atol=1e-14)
    np.testing.assert_array_equal(body.basis.element_dofs.T, body.cells)


def test_inverted_elements_are_named():
    mesh = block_mesh((1.0, 1.0, 1.0), MeshOptions(along=3, across=3, through=3))
    body = Body(mesh, material("yeoh"))
    points = body.points.copy()
    points[body.cells[7]] = points[body.cells[7]][:, [0, 1, 2]] * np.array([1.0, 1.0, -1.0])
    with pytest.raises(ValueError, match=r"inverted \(or without volume\): elements 4, 6, 8, 16 of 27"):
        Body(moved(mesh, points), material("yeoh"))


def test_coordinates_that_are_not_finite_are_named():
    mesh = mesh_of("tetrahedra")
    points = mesh.doflocs.copy()
    bad = Body(mesh, material("yeoh")).cells[5, 9]
    points[1, bad] = np.nan
    with pytest.raises(ValueError, match=r"node coordinates are not finite in elements .*5.* of 48"):
        Body(MeshTet2(points, mesh.t), material("yeoh"))


def test_nodes_without_element_are_named():
    mesh = MeshTet.init_tensor(*[np.linspace(0, 1, 2)] * 3)
    with pytest.raises(ValueError, match="no element uses the nodes 8 of 9"):
        Body(MeshTet(np.hstack([mesh.p, [[5.0], [5.0], [5.0]]]), mesh.t), material("yeoh"))


def test_quadrature_of_curved_tetrahedra_is_of_degree_three():
    (x, y, z), weights = TETRAHEDRON.rule(3)
    assert (weights > 0).all()
    assert min(x.min(), y.min(), z.min(), (1 - x - y - z).min()) > 0
    for i, j, k in np.ndindex(4, 4, 4):
        if i + j + k <= 3:
            exact = factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3)
            assert weights @ (x**i * y**j * z**k) == pytest.approx(exact, rel=1e-13)


def test_only_curved_tetrahedra_take_more_points():
    assert Body(mesh_of("tetrahedra", shake=0.0), material("yeoh")).weights.shape[1] == 4
    assert Body(mesh_of("tetrahedra"), material("yeoh")).weights.shape[1] == 8


def test_other_meshes_are_refused():
    with pytest.raises(TypeError, match="hexahedra or tetrahedra, not MeshQuad1"):
        Body(MeshQuad(), material("yeoh"))


def test_tetrahedra_of_a_file_with_ten_nodes():
    # As meshio gives them: all ten nodes in one connectivity, in VTK's order.
    made = mesh_of("tetrahedra", 1, 0.0)
    body = Body(made, material("yeoh"))
    points, cells, _, _ = body.picture()
    again = Body(MeshTet2(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T)), body.material)
    assert again.volumes.sum() == pytest.approx(1.0)
    assert ElementTetP2.doflocs.shape == (10, 3)
    u = random_field(body, 0.01)
    order = [int(np.argmin(np.abs(body.points - p).sum(axis=1))) for p in again.points]
    np.testing.assert_allclose(again.internal_force(u[order]), body.internal_force(u)[order], atol=1e-14)
