"""Links, loads and terms put together: tangents are derivatives, constraints hold, contradictions are named."""

import numpy as np
import pytest
from skfem import MeshHex, MeshQuad

from fea.body import Body
from fea.case import Case, constant, stages
from fea.links import Builder, ConstraintError
from fea.rigid_part import RigidPart, mass_points
from fea.rotations import rotation
from fea.shell import Shell
from fea.statics import static
from fea.support import require_support
from lab.materials import Material
from meshes.block import block_mesh, moved
from meshes.options import MeshOptions

MATERIAL = Material(youngs_modulus=1.0, poisson_ratio=0.3)


def block(lengths=(2.0, 1.0, 1.0), along=2, across=1, through=1, shift=(0.0, 0.0, 0.0)):
    mesh = block_mesh(lengths, MeshOptions(along=along, across=across, through=through))
    return Body(moved(mesh, mesh.doflocs.T + np.array(shift)), MATERIAL)


def everything(pressure=True):
    """Two blocks glued end to face, a rigid end with moment and springs, pressure, a held root."""
    first, second = block(), block((1.0, 0.5, 0.5), 1, shift=(2.0, 0.25, 0.25))
    case = Case(first, second)
    case.fix("root", part=first).tie("root", "tip", part=second, to=first)
    case.spring("tip", (0.1, 0.2, 0.3), part=first)
    if pressure:
        case.pressure("sides", 0.02, part=first)
    end = case.rigid("end", "tip", part=second)
    end.moment((0.01, 0.02, -0.01)).spring((0.1, 0.1, 0.1, 0.01, 0.01, 0.01), (0.1, 0, 0, 0, 0, 0.2))
    case.force("end", (0.0, 0.01, 0.02))
    return case


def state_of(problem, size=1e-3):
    y = size * np.random.default_rng(1).standard_normal(problem.links.unknowns)
    y[-3:] = [0.3, -0.2, 0.4]
    return y


def test_solution_with_the_tangent_inverts_the_derivative_of_the_residual():
    problem = everything().problem()
    y, t, h = state_of(problem), 0.7, 1e-6
    way = np.random.default_rng(2).standard_normal(len(y))
    slope = (problem.residual(y + h * way, t)[0] - problem.residual(y - h * way, t)[0]) / (2 * h)
    problem.linearise(y, t)
    # Symmetrised pressure is the one thing that the tangent leaves out: see ``fea.pressure``.
    np.testing.assert_allclose(problem.solve(slope), way, atol=0.05 * np.abs(way).max())
    problem = everything(pressure=False).problem()
    slope = (problem.residual(y + h * way, t)[0] - problem.residual(y - h * way, t)[0]) / (2 * h)
    problem.linearise(y, t)
    np.testing.assert_allclose(problem.solve(slope), way, atol=2e-6 * np.abs(way).max())


def test_residual_is_the_derivative_of_the_energy():
    case = everything(pressure=False)
    for rigid in case.rigids.values():
        rigid._moments.clear()
    problem = case.problem()
    y, t, h = state_of(problem), 0.7, 1e-6
    way = np.random.default_rng(3).standard_normal(len(y))

    def potential(z):
        return problem.energy(z, t) - np.vdot(problem.external(t), problem.displacement(z, t))

    slope = (potential(y + h * way) - potential(y - h * way)) / (2 * h)
    assert problem.residual(y, t)[0] @ way == pytest.approx(slope, rel=1e-6)


def test_tied_blocks_stretch_as_one():
    """Same section, glued face to face with meshes that do not match: the bar's own stiffness."""
    first, second = block(across=2), block((1.0, 1.0, 1.0), 1, 3, 1, shift=(2.0, 0.0, 0.0))
    free = Material(youngs_modulus=1.0, poisson_ratio=0.0)
    first, second = Body(first.mesh, free), Body(second.mesh, free)
    case = Case(first, second).fix("root", part=first).tie("root", "tip", part=second, to=first)
    case.force("tip", (1e-4, 0, 0), part=second).watch("end", case.select("tip", second))
    run = static(case)
    assert run.displacement("end")[-1, 0] == pytest.approx(3e-4, rel=1e-3)
    assert run.reaction(case.select("root", first))[-1, 0] == pytest.approx(-1e-4, rel=1e-7)


def test_rigid_end_turns_as_told_and_reports_its_wrench():
    body = block((4.0, 0.5, 0.5), 4, 2, 2)
    case = Case(body).fix("root")
    case.rigid("end", "tip").hold("x", "y", "z", "ry", "rz").move(rx=0.3)
    run = static(case)
    tip = body.boundary("tip")
    arms = body.points[tip] - body.points[tip].mean(axis=0)
    moved_tip = run.field()[tip] + arms
    np.testing.assert_allclose(moved_tip, arms @ rotation(np.array([0.3, 0, 0])).T, atol=1e-12)
    # Saint-Venant: 0.1406 b^4 G angle/length; the held ends stiffen it a little.
    exact = 0.1406 * 0.5**4 * MATERIAL.shear_modulus * 0.3 / 4.0
    assert 1.0 < run.wrench("end")[-1, 3] / exact < 1.1
    np.testing.assert_allclose(run.wrench("end")[-1, [1, 2, 4, 5]], 0.0, atol=1e-9 * exact)


def test_rig_in_series_shares_the_travel():
    body = block()
    case = Case(body).fix("root")
    stiff = 0.5
    case.rigid("robot", "tip").hold("y", "z", "rx", "ry", "rz").spring((stiff, 0, 0, 0, 0, 0), (1e-3, 0, 0, 0, 0, 0))
    run = static(case)
    pulled = run.displacement("robot")[-1, 0]
    assert run.reaction("root")[-1, 0] == pytest.approx(-stiff * (1e-3 - pulled), rel=1e-6)


def test_moment_beyond_a_half_turn():
    """Pure bending to an arc of 270 degrees: rotations are rebased on the way."""
    strip = MeshQuad.init_tensor(np.linspace(0, 10, 13), np.linspace(0, 1, 2))
    strip = strip.with_boundaries({"root": lambda x: x[0] < 1e-9, "tip": lambda x: x[0] > 10 - 1e-9})
    body = Shell(strip, 0.1, Material(youngs_modulus=1.2e6, poisson_ratio=0.0))
    angle = 1.5 * np.pi
    case = Case(body).fix("root")
    case.rigid("end", "tip").moment((0, -1.2e6 * 0.1**3 / 12 * angle / 10, 0))
    run = static(case, np.linspace(0.1, 1, 10))
    assert run.completed
    radius = 10 / angle
    exact = radius * np.sin(angle) - 10, radius * (1 - np.cos(angle))
    np.testing.assert_allclose(run.displacement("end")[-1, [0, 2]], exact, atol=0.02)


def test_mass_points_have_the_inertia_of_the_part():
    turn = rotation(np.array([0.3, 0.8, -0.2]))
    inertia = turn @ np.diag([2.0, 3.0, 4.0]) @ turn.T
    arms, masses = mass_points(1.7, inertia)
    again = np.einsum(
        "n,nij->ij", masses, (arms**2).sum(axis=1)[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None]
    )
    np.testing.assert_allclose(again, inertia, atol=1e-12)
    assert masses.sum() == pytest.approx(1.7)
    with pytest.raises(ValueError, match="no rigid part has"):
        mass_points(1.0, np.diag([1.0, 1.0, 3.0]))


def test_chains_of_ties_end_and_loops_are_refused():
    builder = Builder(4)
    builder.tie(3, np.array([6]), np.array([2.0]), "a")
    builder.tie(0, np.array([3]), np.array([0.5]), "b")
    links = builder.make()
    y = np.zeros(links.unknowns)
    y[np.flatnonzero(links.free == 6)] = 0.1
    assert links.displacement(y, 0.0)[0, 0] == pytest.approx(0.1)
    builder = Builder(3)
    builder.tie(0, np.array([3]), np.array([1.0]), "a")
    builder.tie(3, np.array([0]), np.array([1.0]), "b")
    with pytest.raises(ConstraintError, match="lead back"):
        builder.make()


def contradictions():
    body = block()
    yield Case(body).fix("root").fix("root", "x", to=1e-3), "prescribed by fix.*and differently"
    fixed_and_rigid = Case(body).fix("tip", "y")
    fixed_and_rigid.rigid("end", "tip")
    yield fixed_and_rigid, "carried by the rigid part end"
    twice = Case(body)
    twice.rigid("a", "tip")
    twice.rigid("b", "tip")
    yield twice, "carried by a and by b"


@pytest.mark.parametrize(("case", "message"), contradictions())
def test_contradictory_constraints_name_the_place(case, message):
    with pytest.raises(ConstraintError, match=message):
        case.problem()


def test_symmetry_through_a_rigid_part_that_keeps_it_is_no_contradiction():
    body = block()
    case = Case(body).fix("root").symmetry(lambda x: x[:, 1] < 1e-9, "y")
    case.rigid("end", "tip", at=(2.0, 0.0, 0.5)).hold("y", "rx", "rz")
    case.force("end", (0.0, 0.0, 1e-4))
    run = static(case)
    assert run.completed
    assert np.abs(run.field()[case.select(lambda x: x[:, 1] < 1e-9)][:, 1]).max() < 1e-15


def free_motions():
    body = block()
    yield Case(body).fix("root", "xy"), "can move along z"
    yield Case(body).fix([0.0, 0.0, 0.0]), "can turn about"
    loose = Case(body).fix("root")
    loose.rigid("plate", at=(0, 0, 0))
    yield loose, "rigid part 'plate' can"
    yield Case(body, block(shift=(5.0, 0, 0))).fix(lambda x: x[:, 0] < 1e-9), "part 2 .*can"


@pytest.mark.parametrize(("case", "message"), free_motions())
def test_what_can_move_freely_is_named(case, message):
    with pytest.raises(ConstraintError, match=message):
        static(case)


def test_disconnected_pieces_of_one_mesh_are_found():
    apart = Body(MeshHex() + MeshHex().translated((5.0, 0.0, 0.0)), MATERIAL)
    case = Case(apart).fix(lambda x: x[:, 0] < 1e-9)
    with pytest.raises(ConstraintError, match=r"piece of \d+ nodes around \(5.5"):
        require_support(case, case.problem())


def test_springs_and_supports_together_suffice():
    case = Case(block()).fix("root", "x").spring("tip", (0.0, 1.0, 1.0)).spring("root", (0.0, 1.0, 1.0))
    require_support(case, case.problem())


def test_places_are_found_or_refused():
    case = Case(block())
    assert len(case.select([2.0, 1.0, 1.0])) == 1
    for where, message in (
        ("nowhere", "no boundary 'nowhere'; there are root, sides, tip"),
        (lambda x: x[:, 0] > 9, "no node lies"),
        (np.array([10**6]), "node numbers must lie"),
        ([1.0, 2.0], "a point of three numbers"),
    ):
        with pytest.raises(ConstraintError, match=message):
            case.select(where)
    with pytest.raises(ConstraintError, match="axes must be some of"):
        case.fix("root", "q")
    with pytest.raises(ValueError, match="three finite numbers"):
        case.force("tip", (0, 0, np.nan))


def test_ramps():
    ramp = stages((0, 0), (1, 2), (2, 0))
    assert [ramp(t) for t in (-1, 0.5, 1, 1.5, 3)] == [0, 1, 2, 1, 0]
    assert constant(0.3) == 1.0
    with pytest.raises(ValueError, match="growing t"):
        stages((0, 0), (0, 1))


def test_rigid_part_jacobian_and_geometric_term():
    part = RigidPart(
        np.arange(4), np.random.default_rng(0).standard_normal((4, 3)), rotation(np.array([1.0, 0.2, 0.0]))
    )
    pose, h = np.array([0.1, 0.2, 0.3, 0.5, -0.4, 0.9]), 1e-6
    forces = np.random.default_rng(1).standard_normal((4, 3))
    for k in range(6):
        ends = [pose + sense * h * np.eye(6)[k] for sense in (1, -1)]
        slope = (part.displacement(ends[0]) - part.displacement(ends[1])) / (2 * h)
        np.testing.assert_allclose(part.jacobian(pose)[:, :, k], slope, atol=1e-8)
        work = [np.einsum("nkj,nk->j", part.jacobian(end), forces) for end in ends]
        np.testing.assert_allclose(part.geometric(pose, forces)[:, k], (work[0] - work[1]) / (2 * h), atol=1e-7)
