"""Contact: law, closest points, search, forces and their tangents, friction's memory."""

import numpy as np
import pytest

from fea.contact import CarriedPlane, ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.contact.facets import QUAD9, TRI6, normal_of, place, project, shapes
from fea.contact.law import pressure, traction
from fea.newton import NotConvergedError
from fea.surface import Surface, shape_functions

STIFF = 1e3


def sheet(counts, height, up, size=(1.0, 1.0), bump=0.1, corner=(0.0, 0.0)):
    """Nodes and nine-node facets of a sheet with the normal up or down."""
    n, m = counts
    x, y = np.meshgrid(np.linspace(0, 1, 2 * n + 1), np.linspace(0, 1, 2 * m + 1), indexing="ij")
    x, y = corner[0] + size[0] * x.ravel(), corner[1] + size[1] * y.ravel()
    points = np.stack([x, y, height + bump * (x**2 + x * y)], axis=1)
    steps = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)])
    steps = steps if up else steps[:, ::-1]
    first = 2 * np.stack(np.meshgrid(np.arange(n), np.arange(m), indexing="ij"), axis=-1).reshape(-1, 1, 2)
    return points, (first + steps) @ np.array([2 * m + 1, 1])


def triangles(facets):
    """Six-node triangles, two from each nine-node quadrilateral."""
    return np.concatenate([facets[:, [0, 1, 2, 4, 5, 8]], facets[:, [0, 2, 3, 8, 6, 7]]])


def pair(lower=(3, 2), upper=(2, 2), gap=0.0, bump=0.1, kinds=("quad9", "quad9")):
    """Two sheets face to face: points, lower surface, upper surface."""
    (below, low), (above, high) = (
        sheet(lower, 0.0, True, bump=bump),
        sheet(upper, gap, False, (0.8, 0.9), bump, (0.07, 0.04)),
    )
    facets = [triangles(f) if kind == "tri6" else f for f, kind in zip((low, high + len(below)), kinds, strict=True)]
    return np.concatenate([below, above]), Surface(facets[0], kinds[0]), Surface(facets[1], kinds[1])


def assembled(term, x, t=0.0):
    matrix = np.zeros((x.size, x.size))
    for nodes, values in zip(term.cells, term.tangent(x, t), strict=True):
        rows = (3 * nodes[:, None] + np.arange(3)).ravel()
        np.add.at(matrix, (rows[:, None], rows[None, :]), values)
    return matrix


def slope(function, x, step=1e-7):
    """Central differences of ``function`` by all displacements."""
    result = []
    for row in range(x.size):
        ends = []
        for sense in (step, -step):
            moved = x.reshape(-1).copy()
            moved[row] += sense
            ends.append(np.ravel(function(moved.reshape(-1, 3))))
        result.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(result, axis=1)


def assert_derivatives(term, x, t=0.0):
    """Force is the slope of the energy, tangent that of the force, and symmetric."""
    force, matrix = term.force(x, t), assembled(term, x, t)
    assert np.abs(force).max() > 0
    exact = slope(lambda y: term.force(y, t), x)
    np.testing.assert_allclose(matrix, exact, atol=1e-6 * np.abs(exact).max())
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * np.abs(exact).max())
    work = slope(lambda y: term.energy(y, t), x)[0]
    np.testing.assert_allclose(work, force.reshape(-1), atol=1e-6 * np.abs(force).max())


def assert_balanced(force, positions):
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12 * np.abs(force).max())
    moment = np.cross(positions, force).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-12 * np.abs(force).max())


# -- law and facets ------------------------------------------------------------------------------------


@pytest.mark.parametrize("gap", [0.02, 0.003, -0.004, -0.05])
@pytest.mark.parametrize("shift", [0.0, 0.006])
def test_pressure_is_smooth_and_derives_from_its_energy(gap, shift):
    step, penalty, width = 1e-7, 50.0, 0.01
    value, fall, _ = pressure(penalty, width, shift, gap)
    right, left = (pressure(penalty, width, shift, gap + h) for h in (step, -step))
    assert (left[0] - right[0]) / (2 * step) == pytest.approx(fall, abs=1e-3)
    assert (left[2] - right[2]) / (2 * step) == pytest.approx(value, abs=1e-6)
    assert pressure(penalty, width, shift, 0.0)[2] == 0.0


@pytest.mark.parametrize("slip", [1e-4, 2e-3, 0.0399999, 0.0400001, 0.3])
def test_friction_is_smooth_bounded_and_derives_from_its_energy(slip):
    step, stiffness, limit = 1e-7, 50.0, 1.0
    secant, slide, _ = traction(stiffness, limit, slip)
    right, left = (traction(stiffness, limit, slip + h) for h in (step, -step))
    assert secant * slip <= limit * (1 + 1e-12)
    assert (right[0] * (slip + step) - left[0] * (slip - step)) / (2 * step) == pytest.approx(slide, abs=1e-4)
    assert (right[2] - left[2]) / (2 * step) == pytest.approx(secant * slip, rel=1e-5)
    assert traction(stiffness, 0.0, slip) == (0.0, 0.0, 0.0)


def test_penalties_of_walls_and_solids():
    sizes = np.array([0.05, 0.6])
    wall, solid = ContactLaw(STIFF, 0.1).on(sizes), ContactLaw(STIFF).on(sizes)
    assert wall.penalty[0] == pytest.approx(STIFF / 0.1)
    # Decay length of a wall on this foundation: half a facet.
    assert (STIFF * 0.1**3 / (3 * wall.penalty[1])) ** 0.25 == pytest.approx(0.3)
    np.testing.assert_allclose(solid.penalty, 10 * STIFF / sizes)
    np.testing.assert_allclose(wall.allowed, 0.001)
    np.testing.assert_allclose(solid.allowed, 0.001 * sizes)


@pytest.mark.parametrize("bad", [{"modulus": 0.0}, {"thickness": -1.0}, {"friction": -0.1}, {"blend": np.nan}])
def test_a_law_that_cannot_be_is_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        ContactLaw(**({"modulus": STIFF} | bad))


@pytest.mark.parametrize(("kind", "name", "nodes"), [(QUAD9, "quad9", 9), (TRI6, "tri6", 6)])
def test_shape_functions_agree_with_those_of_surfaces(kind, name, nodes):
    at, step = np.array([[0.2, 0.5, 0.1], [0.3, 0.4, 0.7]]), 1e-6
    values, slopes = shape_functions(name, at)
    table, right, left = (np.empty((6, nodes)) for _ in range(3))
    for point, (r, s) in enumerate(at.T):
        shapes(kind, r, s, table)
        np.testing.assert_allclose(table[0], values[point], atol=1e-14)
        np.testing.assert_allclose(table[1:3], slopes[point], atol=1e-13)
        for axis, second in ((0, [3, 4]), (1, [4, 5])):
            shapes(kind, r + step * (axis == 0), s + step * (axis == 1), right)
            shapes(kind, r - step * (axis == 0), s - step * (axis == 1), left)
            np.testing.assert_allclose((right - left)[1:3] / (2 * step), table[second], atol=1e-8)


@pytest.mark.parametrize("height", [0.3, 0.0, -0.1])
def test_the_foot_of_a_point_over_a_curved_facet_is_found(height):
    points, facets = sheet((1, 1), 0.0, True, bump=0.3)
    table, frame, normal = np.empty((6, 9)), np.empty((6, 3)), np.empty(3)
    shapes(QUAD9, 0.3, 0.8, table)
    place(table, points[facets[0]], frame)
    normal_of(frame, normal)
    at = np.array([0.5, 0.5])
    assert project(QUAD9, points[facets[0]], frame[0] + height * normal, at, table, frame)
    np.testing.assert_allclose(at, [0.3, 0.8], atol=1e-12)


# -- derivatives and balance ---------------------------------------------------------------------------


@pytest.mark.parametrize("two_passes", [False, True])
@pytest.mark.parametrize("kinds", [("quad9", "quad9"), ("tri6", "quad9"), ("tri6", "tri6")])
def test_forces_between_surfaces_balance_and_their_tangent_is_exact(kinds, two_passes):
    points, low, high = pair((2, 1), (1, 1), kinds=kinds)
    x = 0.004 * np.random.default_rng(3).normal(size=points.shape)
    x[high.nodes, 2] -= 0.03
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 0.1, blend=0.3), two_passes, reach=0.2)
    term.prepare(x)
    assert_derivatives(term, x)
    assert_balanced(term.force(x, 0.0), points + x)
    report = term.report(x)
    assert report["force z [N]"] > 0
    np.testing.assert_allclose(-report["force z [N]"], term.force(x, 0.0)[high.nodes, 2].sum())


def test_multipliers_leave_the_tangent_exact():
    points, low, high = pair((2, 1), (1, 1))
    x = 0.004 * np.random.default_rng(4).normal(size=points.shape)
    x[high.nodes, 2] -= 0.03
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 0.1, blend=0.1), reach=0.2)
    term.prepare(x)
    before = term.report(x)["normal force [N]"]
    assert term.augment(x)
    assert term.report(x)["normal force [N]"] > before
    assert_derivatives(term, x)
    term.reject()
    assert term.report(x)["normal force [N]"] == pytest.approx(before)


def test_a_moving_plane_pushes_along_its_normal():
    points, facets = sheet((2, 2), 0.0, True)
    x = 0.01 * np.random.default_rng(5).normal(size=points.shape)
    plane = Plane(np.array([0, 0, 0.3]), np.array([0.1, 0.2, -1.0]), lambda t: 0.4 * t)
    term = PlaneContact(Surface(facets), points, plane, ContactLaw(STIFF, 0.1, blend=0.3))
    assert term.report(x)["active points"] == 0
    assert_derivatives(term, x, 1.0)
    total = -term.force(x, 1.0).sum(axis=0)
    np.testing.assert_allclose(np.cross(total, plane.normal), 0.0, atol=1e-12 * np.abs(total).max())
    assert total[2] < 0
    assert term.report(x)["force z [N]"] == pytest.approx(total[2])


def test_a_plane_without_a_direction_is_refused():
    with pytest.raises(ValueError, match="finite length"):
        Plane(np.zeros(3), np.zeros(3)).corners(0.0)


def test_a_carried_plane_takes_the_force_and_its_moment():
    points, facets = sheet((2, 2), 0.0, True)
    points = np.concatenate([points, [[0, 0, 0.05], [0, 1, 0.06], [1, 0, 0.04]]])
    x = 0.01 * np.random.default_rng(6).normal(size=points.shape)
    last = len(points) - 1
    term = PlaneContact(
        Surface(facets), points, CarriedPlane((last - 2, last - 1, last)), ContactLaw(STIFF, 0.1, blend=0.3)
    )
    assert_derivatives(term, x)
    assert_balanced(term.force(x, 0.0), points + x)
    with pytest.raises(ValueError, match="in one line"):
        PlaneContact(Surface(facets), points, CarriedPlane((0, 1, 2)), ContactLaw(STIFF, 0.1))


def test_nodes_that_a_case_has_got_since_stay_without_force():
    points, facets = sheet((1, 1), 0.0, True)
    plane = Plane(np.array([0, 0, 0.02]), np.array([0, 0, -1.0]))
    term = PlaneContact(Surface(facets), points, plane, ContactLaw(STIFF, 0.1))
    force = term.force(np.zeros((len(points) + 4, 3)), 0.0)
    assert force.shape == (len(points) + 4, 3)
    np.testing.assert_array_equal(force[: len(points)], term.force(np.zeros_like(points), 0.0))


def test_two_passes_do_not_mind_which_surface_comes_first():
    points, low, high = pair()
    x = np.zeros_like(points)
    x[high.nodes, 2] -= 0.02
    law, forces = ContactLaw(STIFF, 1.0, blend=0.002), []
    for slave, master in ((low, high), (high, low)):
        term = SurfaceContact(slave, master, points, law, two_passes=True, reach=0.2, depth=0.05)
        term.prepare(x)
        forces.append(term.force(x, 0.0))
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-12)
    both = Surface(np.concatenate([low.facets, high.facets]))
    itself = SurfaceContact(both, both, points, law, reach=0.2, depth=0.05)
    itself.prepare(x)
    np.testing.assert_allclose(itself.force(x, 0.0), forces[0], atol=1e-12)
    with pytest.raises(ValueError, match="two passes"):
        SurfaceContact(both, both, points, law, two_passes=False)


# -- search --------------------------------------------------------------------------------------------


def test_a_thin_wall_does_not_touch_itself_through_its_thickness():
    points, low, high = pair((3, 3), (3, 3), gap=-0.1, bump=0.0)
    wall = Surface(np.concatenate([low.facets, high.facets]))
    term = SurfaceContact(wall, wall, points, ContactLaw(STIFF, 0.1), reach=0.3)
    assert len(term.cells) == 0
    assert not term.force(np.zeros_like(points), 0.0).any()
    assert term.tangent(np.zeros_like(points), 0.0).shape == (0, 54, 54)


def test_surfaces_that_look_the_same_way_and_neighbours_do_not_touch():
    below, low = sheet((2, 2), 0.0, True)
    above, high = sheet((2, 2), 0.01, True)
    points = np.concatenate([below, above])
    term = SurfaceContact(Surface(high + len(below)), Surface(low), points, ContactLaw(STIFF, 0.1))
    assert len(term.cells) == 0
    one = Surface(low)
    assert len(SurfaceContact(one, one, below, ContactLaw(STIFF, 0.5), facing=-1.1).cells) == 0


def test_pairs_stay_while_the_motion_is_small_and_change_when_it_is_not():
    points, low, high = pair(gap=0.05, bump=0.0)
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 0.1))
    x = np.zeros_like(points)
    assert not term.prepare(x)
    x[high.nodes, 2] -= 0.02
    assert not term.prepare(x)
    x[high.nodes, 2] += 3.0
    term.prepare(x)
    assert term.report(x)["active points"] == 0
    x[high.nodes] += [0.3, 0, -3.0]
    assert term.prepare(x)
    assert not term.prepare(x)


def test_contact_that_was_not_looked_for_gives_the_increment_up():
    points, low, high = pair(gap=0.5, bump=0.0)
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 0.1))
    x = np.zeros_like(points)
    assert len(term.cells) == 0
    x[high.nodes, 2] -= 0.51
    with pytest.raises(NotConvergedError, match="met where none was looked for"):
        term.augment(x)
    term.reject()
    halfway = x / 2
    term.prepare(halfway)
    assert len(term.cells) > 0
    term.force(x, 0.0)
    term.augment(x)


def test_force_stays_while_points_slide_from_facet_to_facet():
    points, low, high = pair((5, 5), (2, 2), bump=0.0)
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 0.1), two_passes=False)
    x = np.zeros_like(points)
    x[high.nodes, 2] -= 0.01
    forces = []
    for slide in np.linspace(0, 0.12, 25):
        x[high.nodes, 0] = slide
        term.prepare(x)
        forces.append(term.force(x, 0.0)[high.nodes].sum(axis=0))
    np.testing.assert_allclose(forces, np.broadcast_to(forces[0], (25, 3)), atol=1e-10)


# -- friction ------------------------------------------------------------------------------------------


def pressed_and_dragged(slide, friction=0.4):
    """A flat sheet pressed on a plane and dragged by ``slide``, m."""
    points, facets = sheet((1, 2), 0.0, False, bump=0.0)
    law = ContactLaw(STIFF, 0.1, friction=friction, blend=0.01)
    term = PlaneContact(Surface(facets), points, Plane(np.zeros(3), np.array([0, 0, 1.0])), law)
    x = np.zeros_like(points)
    x[:, 2] = -0.0005
    term.force(x, 0.0)
    assert term.augment(x)
    assert not term.augment(x)
    term.accept(x)
    return term, x + np.array([slide, 0.5 * slide, 0.0])


@pytest.mark.parametrize("slide", [1e-4, 2e-3])
def test_friction_has_an_exact_tangent_at_its_limit(slide):
    term, x = pressed_and_dragged(slide)
    assert_derivatives(term, x + 1e-5 * np.random.default_rng(7).normal(size=x.shape))


def test_friction_sticks_then_slides_and_comes_back():
    term, x = pressed_and_dragged(0.01)
    normal, direction = term.report(x)["normal force [N]"], np.array([2.0, 1.0]) / np.sqrt(5)

    def drag(at):
        report = term.report(at)
        return -np.array([report["force x [N]"], report["force y [N]"]]) @ direction

    assert drag(x) == pytest.approx(0.4 * normal, rel=0.01)
    term.augment(x)
    term.accept(x)
    # Coulomb's force times the way beyond the elastic slip 2 mu p / k.
    way = np.hypot(0.01, 0.005) - 2 * 0.4 * 0.0005
    assert term.report(x)["friction loss [J]"] == pytest.approx(0.4 * normal * way, rel=0.03)
    assert drag(x) == pytest.approx(0.4 * normal, rel=0.02)
    back = x - np.array([0.01, 0.005, 0.0])
    assert drag(back) == pytest.approx(-0.4 * normal, rel=0.02)
    lifted = x + np.array([0, 0, 0.1])
    assert drag(lifted) == 0.0
    term.accept(lifted)
    assert drag(x) == pytest.approx(0.0, abs=1e-9)


def test_friction_between_surfaces_balances_across_facets():
    points, low, high = pair((4, 4), (2, 2), bump=0.0)
    x = np.zeros_like(points)
    x[high.nodes, 2] -= 0.005
    term = SurfaceContact(high, low, points, ContactLaw(STIFF, 1.0, friction=0.5), reach=0.2, depth=0.05)
    term.prepare(x)
    term.force(x, 0.0)
    assert term.augment(x)
    assert not term.augment(x)
    term.accept(x)
    x[high.nodes, 1] += 0.06
    term.prepare(x)
    force = term.force(x, 0.0)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12 * np.abs(force).max())
    report = term.report(x)
    assert -report["force y [N]"] == pytest.approx(0.5 * report["normal force [N]"], rel=0.1)


# -- what a reader sees --------------------------------------------------------------------------------


def test_fields_hold_pressure_and_gap_at_the_nodes():
    points, low, high = pair((3, 3), (2, 2), bump=0.0)
    law = ContactLaw(STIFF, 0.1)
    term = SurfaceContact(high, low, points, law, two_passes=False)
    x = np.zeros_like(points)
    x[high.nodes, 2] -= 0.01
    term.prepare(x)
    fields = term.fields(x)
    scales = law.on(np.full(4, np.sqrt(0.8 * 0.9 / 4)))
    expected = scales.penalty[0] * (0.01 - scales.width[0] / 2)
    np.testing.assert_allclose(fields["contact pressure [Pa]"][high.nodes], expected)
    np.testing.assert_allclose(fields["gap [m]"][high.nodes], -0.01)
    assert np.isnan(fields["gap [m]"][low.nodes]).all()
    report = term.report(x)
    assert report["largest pressure [Pa]"] == pytest.approx(expected)
    assert report["normal force [N]"] == pytest.approx(0.8 * 0.9 * expected)
    assert report["largest penetration [m]"] == pytest.approx(0.01)
    assert report["active points"] == 36
