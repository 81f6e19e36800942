"""The 18-node solid shell: geometry, forces, tangent, mass."""

import numba
import numpy as np
import pytest
from skfem import MeshQuad, MeshQuad2

from fea import shell_kernels
from fea.linear import make_solver
from fea.rotations import rotation
from fea.shell import Shell
from fea.shell_geometry import tables
from lab.materials import Material
from meshes.node_order import VTK_CELL_TYPE

LAWS = ("saint-venant-kirchhoff", "neo-hookean", "yeoh", "mooney-rivlin")
EDGES = {
    "left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 1.0),
    "front": lambda x: np.isclose(x[1], 0.0), "back": lambda x: np.isclose(x[1], 1.0),
}  # fmt: skip


def unit_square(along=2, across=2, shaken=0.0):
    """Straight-sided elements; ``shaken`` moves the inner corners."""
    mesh = MeshQuad.init_tensor(np.linspace(0, 1, along + 1), np.linspace(0, 1, across + 1)).with_boundaries(EDGES)
    points = mesh.p.copy()
    inside = ((points > 1e-9) & (points < 1 - 1e-9)).all(axis=0)
    points[:, inside] += shaken * np.random.default_rng(0).uniform(-1, 1, (2, inside.sum()))
    return MeshQuad(points, mesh.t, _boundaries=mesh.boundaries)


def on_surface(mesh, place):
    """The quadratic mesh with its nodes moved to ``place(x, y)``; its elements run anticlockwise in x, y."""
    flat = MeshQuad2.from_mesh(mesh)
    # scikit-fem's tensor meshes run clockwise.
    return MeshQuad2(np.array(place(*flat.doflocs)), flat.t[[0, 3, 2, 1]], _boundaries=mesh.boundaries)


def folded(mesh, fold):
    """Unit square folded up by the angle ``fold`` at x = 1/2."""

    def place(x, y):
        beyond = np.maximum(x - 0.5, 0)
        return np.minimum(x, 0.5) + np.cos(fold) * beyond, y, np.sin(fold) * beyond

    return on_surface(mesh, place)


def cylinder(mesh, radius=0.8):
    return on_surface(mesh, lambda x, y: (radius * np.sin(y / radius), x, radius * np.cos(y / radius)))


def material(law="saint-venant-kirchhoff", **others):
    others = {"youngs_modulus": 1.0, "poisson_ratio": 0.3} | others
    return Material(law=law, **({"c20_ratio": 0.1} if law == "yeoh" else {}), **others)


@pytest.fixture(params=LAWS)
def shell(request):
    return Shell(cylinder(unit_square(shaken=0.08)), 0.1, material(request.param))


def random_field(shell, size, seed=1):
    return size * np.random.default_rng(seed).standard_normal((shell.nodes, 3))


# ---------------------------------------------------------------- mechanics


def test_force_is_derivative_of_energy(shell):
    u, w, h = random_field(shell, 0.005), random_field(shell, 1.0, 2), 1e-6
    slope = (shell.strain_energy(u + h * w).sum() - shell.strain_energy(u - h * w).sum()) / (2 * h)
    assert np.vdot(shell.internal_force(u), w) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("viscosity", [0.0, 2.0])
def test_tangent_is_derivative_of_force(shell, viscosity):
    u, w, h = random_field(shell, 0.005), random_field(shell, 1.0, 2), 1e-6
    past = -viscosity * shell.strains(random_field(shell, 0.005, 3))
    ahead, behind = (shell.internal_force(u + sense * w, viscosity, past) for sense in (h, -h))
    force, data = shell.tangent(u, viscosity, past)
    np.testing.assert_allclose(force, shell.internal_force(u, viscosity, past), atol=1e-14)
    product = shell.pattern.times(data, w.ravel())
    np.testing.assert_allclose(product, ((ahead - behind) / (2 * h)).ravel(), atol=1e-7 * np.abs(product).max())


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "neo-hookean"])
def test_tangent_after_a_step_drops_its_second_order_stress(law):
    shell = Shell(cylinder(unit_square()), 0.1, material(law))
    u, step = random_field(shell, 0.005), random_field(shell, 0.003, 2)
    # With no earlier displacement the linearised stress is that of sym(grad step): at step = u it is of first order.
    _, exact = shell.tangent(1e-4 * u)
    _, better = shell.tangent(1e-4 * u, step=1e-4 * u)
    _, at_rest = shell.tangent(np.zeros_like(u))
    assert np.abs(better - exact).max() < 1e-5 * np.abs(exact).max()
    _, other = shell.tangent(u, step=step)
    _, plain = shell.tangent(u)
    assert np.abs(other - plain).max() > 1e-4 * np.abs(at_rest).max()


def test_two_forms_of_saint_venant_kirchhoff_agree():
    """Point by point with enhanced strains found by Newton's method, and by the constant matrix."""
    shell = Shell(cylinder(unit_square(shaken=0.08)), 0.1, material(poisson_ratio=0.45))
    law, parameters = shell._law
    elements, fixed = shell._elements, tables()
    strains, stress, stiffness = np.empty((18, 6)), np.empty(53), np.empty((53, 53))
    for number, e in enumerate(shell.strains(random_field(shell, 0.01))):
        shell_kernels._elastic(law, parameters, elements, fixed, number, e, strains, stress)
        expected = elements.stiffness[number] @ e
        np.testing.assert_allclose(stress, expected, atol=1e-13 * np.abs(expected).max())
        shell_kernels._stiffness_now(law, parameters, elements, fixed, number, 0.0, strains, stiffness)
        np.testing.assert_allclose(stiffness, elements.stiffness[number], atol=1e-12 * stiffness.max())


def test_viscous_stress_is_that_of_the_rate():
    """With dE/dt = (E - E0)/dt the dissipated power is never negative and vanishes in rigid motion."""
    shell = Shell(cylinder(unit_square()), 0.1, material("neo-hookean"))
    u = random_field(shell, 0.005)
    turn = rotation(np.array([0.3, 0.2, -0.5]))
    turned = (shell.points + u) @ turn.T - shell.points
    viscous = shell.internal_force(turned, 3.0, -3.0 * shell.strains(u)) - shell.internal_force(turned)
    np.testing.assert_allclose(viscous, 0.0, atol=1e-12)
    faster = shell.internal_force(u, 3.0, -3.0 * shell.strains(np.zeros_like(u))) - shell.internal_force(u)
    assert np.vdot(faster, u) > 0
    linear = Shell(shell.mesh, 0.1, material())
    force = linear.internal_force(u, 3.0, np.zeros((4, 53)))
    np.testing.assert_allclose(force, 4.0 * linear.internal_force(u), rtol=1e-12)


def test_one_element_has_six_rigid_modes_and_no_other(shell):
    one = Shell(cylinder(unit_square(1, 1)), 0.1, shell.material)
    _, data = one.tangent(np.zeros((one.nodes, 3)))
    values = np.linalg.eigvalsh(one.pattern.full(data).toarray())
    assert (np.abs(values) < 1e-10 * values[-1]).sum() == 6
    assert (values > 1e-6 * values[-1]).sum() == 48


def test_rigid_motion_costs_nothing_and_turns_forces(shell):
    turn = rotation(np.array([0.4, -2.1, 1.7]))
    rigid = shell.points @ (turn - np.eye(3)).T + np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(shell.internal_force(rigid), 0.0, atol=1e-14)
    u = random_field(shell, 0.005)
    both = rigid + u @ turn.T
    np.testing.assert_allclose(shell.strains(both), shell.strains(u), atol=1e-13)
    np.testing.assert_allclose(shell.internal_force(both), shell.internal_force(u) @ turn.T, atol=1e-13)
    np.testing.assert_allclose(shell.strain_energy(both), shell.strain_energy(u), atol=1e-15)
    stress, turned = (_matrix(shell.stresses(v)) for v in (u, both))
    np.testing.assert_allclose(turned, turn @ stress @ turn.T, atol=1e-12)


def _matrix(voigt):
    return voigt[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "neo-hookean"])
def test_any_number_of_threads_gives_the_same_digits(law):
    shell = Shell(cylinder(unit_square(16, 16)), 0.02, material(law))
    u, before = random_field(shell, 1e-4), numba.get_num_threads()
    results = []
    try:
        for threads in range(1, numba.config.NUMBA_NUM_THREADS + 1):
            numba.set_num_threads(threads)
            results.append((shell.internal_force(u), *shell.tangent(u)))
    finally:
        numba.set_num_threads(before)
    reference = (np.zeros_like(u), *shell.tangent(u))
    # Colour by colour, whatever the number of threads; one thread alone adds in the same order.
    for result in results:
        for value, expected in zip(result[1:], reference[1:], strict=True):
            np.testing.assert_array_equal(value, expected)
        np.testing.assert_allclose(result[0], reference[1], atol=1e-15)


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "neo-hookean", "yeoh"])
def test_an_impossible_state_is_not_a_number(law):
    shell = Shell(unit_square(), 0.1, material(law))
    u = np.zeros((shell.nodes, 3))
    # The top far below the bottom.
    u[shell.top, 2] = -0.3
    assert np.isnan(shell.internal_force(u)).any()
    force, data = shell.tangent(u)
    assert np.isnan(force).any()
    assert np.isnan(data).any()


# ---------------------------------------------------------------- patches


def solve(shell, fixed, value):
    """Displacement under no load where the unknowns ``fixed`` have the ``value``."""
    free = np.setdiff1d(np.arange(3 * shell.nodes), fixed)
    pattern, taken = shell.pattern.restrict(free)
    _, data = shell.tangent(np.zeros((shell.nodes, 3)))
    known = np.zeros(3 * shell.nodes)
    known[fixed] = value.ravel()[fixed]
    solver = make_solver("auto", pattern)
    solver.factorise(data[taken])
    known[free] = solver.solve(-shell.pattern.times(data, known)[free])
    return known.reshape(-1, 3)


def rim(shell, axes=(0, 1, 2)):
    nodes = np.unique(np.concatenate([shell.boundary(name) for name in EDGES]))
    return (3 * nodes[:, None] + np.array(axes)).ravel()


@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_membrane_patch(nu):
    shell = Shell(unit_square(3, 3, 0.09), 0.05, material(poisson_ratio=nu))
    size = 1e-9
    strain = size * np.array([[1.0, 0.3, 0.0], [0.3, -0.4, 0.0], [0.0, 0.0, 0.0]])
    # Plane stress.
    strain[2, 2] = -nu / (1 - nu) * (strain[0, 0] + strain[1, 1])
    exact = shell.points @ strain
    # The thickness changes freely.
    u = solve(shell, np.append(rim(shell, (0, 1)), 2), exact)
    u[:, 2] -= u[0, 2] - exact[0, 2]
    np.testing.assert_allclose(u, exact, atol=1e-8 * size)
    stress = shell.stresses(u).reshape(-1, 6)
    factor = 1.0 / (1 - nu**2)
    expected = size * np.array([factor * (1 - nu * 0.4), factor * (-0.4 + nu), 0, 0.3 / (1 + nu), 0, 0])
    # Bulk over shear modulus times strain is what is left of second order.
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), atol=1e-5 * size)


@pytest.mark.parametrize(
    "curvature", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)], ids=["along", "across", "twist"]
)
@pytest.mark.parametrize(("thickness", "nu"), [(0.05, 0.3), (0.05, 0.4999), (1e-3, 0.3)])
def test_bending_patch(curvature, thickness, nu):
    """Constant curvature on distorted elements: exact displacement and energy of the thin plate."""
    shell = Shell(unit_square(3, 3, 0.09), thickness, material(poisson_ratio=nu))
    xx, yy, xy = 1e-4 * np.array(curvature)
    x, y, z = shell.points.T
    slope = np.stack([xx * x + xy * y, yy * y + xy * x])
    exact = np.stack([-z * slope[0], -z * slope[1], 0.5 * (xx * x**2 + yy * y**2) + xy * x * y], axis=1)
    u = solve(shell, rim(shell), exact)
    # The matrix loses (length/thickness)^4 of the digits.
    digits = 1e-8 if thickness > 0.01 else 1e-5
    np.testing.assert_allclose(u, exact, atol=digits * np.abs(exact).max())
    plate = thickness**3 / 12 / (1 - nu**2)
    energy = 0.5 * plate * (xx**2 + yy**2 + 2 * nu * xx * yy + 2 * (1 - nu) * xy**2)
    assert shell.strain_energy(u).sum() == pytest.approx(energy, rel=1e-3)


def test_uniform_strain_of_all_components():
    """A displacement with a constant gradient: constant stress, and inner nodes in balance."""
    shell = Shell(unit_square(3, 3, 0.09), 0.2, material("neo-hookean"), shear_factor=1.0)
    gradient = np.array([[0.1, 0.05, 0.02], [-0.1, 0.03, 0.06], [0.04, 0.02, -0.2]])
    u = shell.points @ gradient.T
    stress = shell.stresses(u).reshape(-1, 6)
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0], stress.shape), atol=1e-12)
    deformed, volume = np.eye(3) + gradient, np.linalg.det(np.eye(3) + gradient)
    mu, lam = shell.material.shear_modulus, shell.material.lame_lambda
    expected = (mu * (deformed @ deformed.T - np.eye(3)) + lam * np.log(volume) * np.eye(3)) / volume
    np.testing.assert_allclose(_matrix(stress[0]), expected, atol=1e-12)
    inner = np.setdiff1d(np.arange(shell.nodes), rim(shell)[::3] // 3)
    both = shell.internal_force(u).reshape(-1, 2, 3).sum(axis=1)
    np.testing.assert_allclose(both[inner[::2] // 2], 0.0, atol=1e-13)


def test_parabola_of_shear_softens():
    """Uniform transverse shear: 5/6 of the stiffness, the rest is untouched."""
    full, reduced = (Shell(unit_square(), 0.1, material(), shear_factor=k) for k in (1.0, 5 / 6))
    u = full.points @ np.array([[0, 0, 1e-6], [0, 0, 0], [0, 0, 0.0]]).T
    assert reduced.strain_energy(u).sum() == pytest.approx(5 / 6 * full.strain_energy(u).sum(), rel=1e-5)
    u = full.points @ np.array([[1e-6, 0, 0], [0, 0, 0], [0, 0, 0.0]]).T
    assert reduced.strain_energy(u).sum() == pytest.approx(full.strain_energy(u).sum(), rel=1e-9)


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "nearly-incompressible-neo-hookean"])
def test_nearly_incompressible_bending_does_not_lock(law):
    """A distorted cantilever under an end moment: as soft as beam theory between free and held width says."""
    tips = []
    for nu in (0.4, 0.4999):
        shell = Shell(on_surface(unit_square(4, 2, 0.06), lambda x, y: (10 * x, y, 0 * x)), 0.1,
                      material(law, poisson_ratio=nu))  # fmt: skip
        moment = shell.shares("right")[:, None] * np.sign(shell.points[:, 2:]) * np.array([[1.0, 0, 0]])
        moment /= np.abs(moment).sum() * 0.05
        root = (3 * shell.boundary("left")[:, None] + np.arange(3)).ravel()
        free = np.setdiff1d(np.arange(3 * shell.nodes), root)
        pattern, taken = shell.pattern.restrict(free)
        solver = make_solver("auto", pattern)
        solver.factorise(shell.tangent(np.zeros((shell.nodes, 3)))[1][taken])
        deflection = np.abs(solver.solve(moment.ravel()[free])).max()
        tips.append(deflection / (100.0 / 2 / (0.1**3 / 12)))
    # M L^2 / (2 E I); the clamp holds the width at the root.
    assert tips[0] == pytest.approx(0.98, abs=0.02)
    assert tips[1] == pytest.approx(0.97, abs=0.03)


# ---------------------------------------------------------------- geometry


def test_layers_surfaces_and_areas():
    radius, thickness = 0.8, 0.1
    shell = Shell(cylinder(unit_square(), radius), thickness, material(), density=3.0)
    inner, outer = (np.linalg.norm(shell.points[nodes][:, [0, 2]], axis=1) for nodes in (shell.bottom, shell.top))
    np.testing.assert_allclose(np.sort([inner.mean(), outer.mean()]), [0.75, 0.85], atol=1e-3)
    for name in ("top", "bottom"):
        surface = shell.surface(name)
        size = np.linalg.norm(shell.points[shell.boundary(name)][:, [0, 2]], axis=1).mean()
        assert shell.shares(name).sum() == pytest.approx(size / radius, rel=1e-3)
        corners = shell.points[surface.facets]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
        inwards = shell.points[shell.boundary({"top": "bottom", "bottom": "top"}[name])].mean(axis=0)
        assert (np.einsum("fi,fi->f", normals, corners.mean(axis=1) - inwards) > 0).sum() >= 2
        away = shell.points[surface.facets[:, 8]] - shell.mid[shell.surface_cells[:, 8]]
        assert (np.einsum("fi,fi->f", normals, away) > 0).all()
    assert shell.shares("left").sum() == pytest.approx(thickness, rel=1e-3)
    assert shell.shares("front").sum() == pytest.approx(thickness, rel=1e-3)
    assert set(shell.layer("left", "top")) == set(shell.boundary("left")) & set(shell.top)
    assert shell.volumes.sum() == pytest.approx(thickness, rel=1e-3)
    np.testing.assert_allclose(shell.points[shell.boundary("left")][:, 1], 0.0, atol=1e-12)


def test_mass_totals_and_edge_mass():
    shell = Shell(cylinder(unit_square()), 0.1, material(), density=3.0)
    ones = np.ones(3 * shell.nodes)
    plain = shell.pattern.times(shell.mass(), ones).sum() / 3
    assert plain == pytest.approx(3.0 * shell.volumes.sum())
    heavy = shell.pattern.times(shell.mass({"right": 5.0}), ones) - shell.pattern.times(shell.mass(), ones)
    assert heavy.sum() == pytest.approx(3 * 5.0)
    share = shell.shares("right")
    np.testing.assert_allclose(heavy[::3], 5.0 * share / share.sum(), atol=1e-12)
    spin = np.cross([0.2, -0.3, 0.5], shell.points)
    kinetic = np.vdot(spin, shell.pattern.times(shell.mass(), spin.ravel()).reshape(-1, 3))
    assert kinetic > 0


def test_thickness_may_vary():
    shell = Shell(unit_square(), 0.1 + 0.1 * MeshQuad2.from_mesh(unit_square()).doflocs[0], material())
    assert shell.volumes.sum() == pytest.approx(0.15)
    assert shell.shares("right").sum() == pytest.approx(0.2)


def test_given_directors_are_taken():
    mesh = MeshQuad2.from_mesh(unit_square())
    directors = np.tile([0.6, 0.0, 0.8], (mesh.doflocs.shape[1], 1))
    shell = Shell(mesh, 0.1, material(), directors=directors)
    np.testing.assert_allclose(shell.points[shell.top] - shell.points[shell.bottom], 0.1 * directors)


@pytest.mark.parametrize("degrees", [30, 90, 140])
def test_a_crease_is_mitred(degrees):
    fold = np.deg2rad(degrees)
    bent = folded(unit_square(4, 2), fold)
    shell = Shell(bent, 0.02, material())
    thick = shell.points[shell.top] - shell.points[shell.bottom]
    crease = np.isclose(shell.mid[:, 0], 0.5) & np.isclose(shell.mid[:, 2], 0.0)
    for normal in ([0, 0, 1], [-np.sin(fold), 0, np.cos(fold)]):
        np.testing.assert_allclose(thick[crease] @ normal, 0.02, rtol=1e-9)
    assert shell.volumes.sum() == pytest.approx(0.02, rel=1e-9)


def test_a_box_corner_keeps_all_three_thicknesses():
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    # Three faces of a cube around the corner 0, normals inwards.
    faces = np.array([[0, 1, 3, 2], [0, 4, 5, 1], [0, 2, 6, 4]])
    flat = MeshQuad(np.zeros((2, 8)), faces.T)
    middle = flat.p[0]
    assert len(middle) == 8
    promoted = MeshQuad2(np.zeros((2, MeshQuad2.from_mesh(flat).doflocs.shape[1])), faces.T)
    nodes = promoted.dofs.element_dofs.T
    placed = np.zeros((3, nodes.max() + 1))
    weights = [[1, 1, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1], [1, 0, 0, 1], [1, 1, 1, 1]]
    for element, face in zip(nodes, faces, strict=True):
        placed[:, element[:4]] = points[face].T
        for node, weight in zip(element[4:], weights, strict=True):
            placed[:, node] = np.average(points[face], axis=0, weights=weight)
    shell = Shell(MeshQuad2(placed, faces.T), 0.1, material())
    corner = np.flatnonzero((shell.mid == 0).all(axis=1))[0]
    np.testing.assert_allclose(shell.points[2 * corner + 1] - shell.points[2 * corner], 0.1)


def strip(turns, cells):
    """Closed strip of ``cells`` elements with so many half turns."""
    m = len(cells)
    angle = np.linspace(0, 2 * np.pi, 2 * m, endpoint=False)
    mesh = MeshQuad(np.zeros((2, 2 * m)), np.array(cells).T)
    promoted = MeshQuad2.from_mesh(mesh)
    placed = np.zeros((3, promoted.doflocs.shape[1]))

    def at(k, side):
        a, twist = angle[k % (2 * m)], turns * np.pi * k / (2 * m)
        r = 3 + side * np.cos(twist)
        return r * np.cos(a), r * np.sin(a), side * np.sin(twist)

    for e, nodes in enumerate(promoted.dofs.element_dofs.T):
        order = [(0, -1), (2, -1), (2, 1), (0, 1), (1, -1), (2, 0), (1, 1), (0, 0), (1, 0)]
        for node, (k, side) in zip(nodes, order, strict=True):
            placed[:, node] = at(2 * e + k, side)
    return MeshQuad2(placed, mesh.t)


def test_a_moebius_strip_is_refused():
    m = 12
    cells = [[2 * e, 2 * e + 2, 2 * e + 3, 2 * e + 1] for e in range(m - 1)]
    band = [*cells, [2 * m - 2, 0, 1, 2 * m - 1]]
    assert Shell(strip(2, band), 0.05, material()).volumes.sum() > 0
    with pytest.raises(ValueError, match=r"elements 0 and 11 are neighbours of opposite orientation.*Moebius"):
        Shell(strip(1, [*cells, [2 * m - 2, 1, 0, 2 * m - 1]]), 0.05, material())


def test_opposite_neighbours_are_named():
    mesh = on_surface(unit_square(2, 1), lambda x, y: (x, y, x**2))
    cells = mesh.t.copy()
    cells[:, 1] = cells[[0, 3, 2, 1], 1]
    with pytest.raises(ValueError, match="elements 0 and 1 are neighbours of opposite orientation"):
        Shell(MeshQuad2(mesh.doflocs, cells), 0.1, material())
    plane = unit_square(2, 1)
    cells = plane.t.copy()
    cells[:, 1] = cells[[0, 3, 2, 1], 1]
    shell = Shell(MeshQuad(plane.p, cells), 0.1, material())
    assert (shell.points[shell.top, 2] > 0).all()


def test_three_elements_at_an_edge_are_refused():
    points = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [-1, 0], [-1, 1], [0.5, 0], [0.5, 1]], dtype=float).T
    cells = np.array([[0, 2, 3, 1], [4, 0, 1, 5], [0, 6, 7, 1]]).T
    with pytest.raises(ValueError, match="share one edge"):
        Shell(MeshQuad(points, cells), 0.1, material())


def test_a_sharp_fold_is_refused():
    bent = folded(unit_square(2, 1), np.deg2rad(170.0))
    with pytest.raises(ValueError, match="folds by 170 degrees between elements 0 and 1"):
        Shell(bent, 0.01, material())


def test_too_thick_for_its_curvature_names_the_element():
    mesh = cylinder(unit_square(), 0.2)
    with pytest.raises(ValueError, match=r"element \d+ is inside out or too warped for its thickness"):
        Shell(mesh, 0.9, material())
    with pytest.raises(ValueError, match="element 0 is inside out"):
        Shell(unit_square(), 0.1, material(), directors=np.tile([0, 0, -1.0], (25, 1)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"thickness": np.ones(3)}, "one per surface node"),
        ({"thickness": -1.0}, "positive"),
        ({"thickness": np.nan}, "positive"),
        ({"directors": np.ones((25, 3))}, "unit vectors"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        Shell(**({"mesh": unit_square(), "thickness": 0.1, "material": material()} | change))


def test_unknown_names_are_named():
    shell = Shell(unit_square(), 0.1, material())
    with pytest.raises(ValueError, match="no edge 'nose'; it has"):
        shell.boundary("nose")
    with pytest.raises(ValueError, match="top and bottom, not 'left'"):
        shell.surface("left")
    with pytest.raises(ValueError, match="no side 'middle'"):
        shell.layer("left", "middle")
    named = unit_square().with_boundaries({"top": lambda x: np.isclose(x[1], 1.0)})
    with pytest.raises(ValueError, match=r"edges \['top'\] must have other names"):
        Shell(named, 0.1, material())


def test_picture_is_made_of_hexahedra():
    shell = Shell(cylinder(unit_square()), 0.1, material())
    points, cells, kind, carry = shell.picture()
    assert (kind, cells.shape) == (VTK_CELL_TYPE, (4, 27))
    np.testing.assert_allclose(carry(shell.points), points)
    corners = points[cells[:, :8]]
    sides = corners[:, [1, 3, 4]] - corners[:, [0]]
    assert (np.linalg.det(sides) > 0).all()
    np.testing.assert_allclose(points[cells[:, 26]], shell.mid[shell.surface_cells[:, 8]], atol=1e-12)
    # An edge node lies between its corners (order of VTK: node 8 between 0 and 1, 16 between 0 and 4).
    middle = 0.5 * (corners[:, 0] + corners[:, 4])
    np.testing.assert_allclose(points[cells[:, 16]], middle, atol=1e-12)
