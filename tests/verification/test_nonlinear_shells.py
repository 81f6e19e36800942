"""Large rotations of thin shells against the tables of Sze, Liu and Lo (2004) and what is exact.

Their tables come from four-node shells of Abaqus (S4R).  Errors are deviations over the largest value of the
table's column.  Nine-node elements have the nodes of twice as many four-node ones in either direction: a 24 x 24
mesh here is as fine as 48 x 48 there.
"""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from fea import Case, Shell, Steer, static, trace
from lab.materials import Material
from meshes.structured import surface_mesh


def elastic(modulus, ratio=0.0):
    return Material(youngs_modulus=modulus, poisson_ratio=ratio)


def strip(length, width, elements):
    return surface_mesh(
        (elements, 1), lambda a, b: np.column_stack([length * a, width * b, 0 * a]), ("root", "tip", "", "")
    )


def quarter_cylinder(radius, length, counts):
    """Crown on the z axis, b along y; edges: crown (x = 0), side (z = 0), middle (y = 0) and end."""

    def place(a, b):
        angle = a * np.pi / 2
        return np.column_stack([radius * np.sin(angle), length * b, radius * np.cos(angle)])

    return surface_mesh(counts, place, ("crown", "side", "middle", "end"))


def needed(name, meshes):
    """Meshes of a case: the first in the normal run, others slow."""
    first, *others = meshes
    return pytest.mark.parametrize(name, [first, *(pytest.param(m, marks=pytest.mark.slow) for m in others)])


def test_cantilever_under_end_shear(reference, compare):
    """Section 3.1, 8 x 1.  The table is 0.03 to 0.1 % soft against the exact elastica (test_nonlinear_beams)."""
    rows = reference("sze31_end_shear")[1:]
    case = Case(Shell(strip(10.0, 1.0, 8), 0.1, elastic(1.2e6))).fix("root").force("tip", (0, 0, 4.0)).watch("A", "tip")
    run = static(case, rows[:, 0])
    assert run.completed, run.reason
    moved = run.displacement("A")[1:]
    assert (compare(["-U", "W"], rows[:, 0], rows[:, 1:], moved[:, [0, 2]] * [-1, 1], run) < 2e-3).all()


def test_cantilever_rolled_up_by_an_end_moment(compare):
    """Section 3.2, 16 x 1, against the exact circle; h/R grows to 0.05, of which the circle knows nothing."""
    factors = np.linspace(0.05, 1, 20)
    case = Case(Shell(strip(12.0, 1.0, 16), 0.1, elastic(1.2e6))).fix("root")
    case.rigid("end", "tip").moment((0, -50 * np.pi / 3, 0))
    run = static(case, factors)
    assert run.completed, run.reason
    angle = 2 * np.pi * factors
    exact = 12 * np.column_stack([1 - np.sin(angle) / angle, (1 - np.cos(angle)) / angle])
    moved = run.displacement("end")[1:]
    assert (compare(["-U", "W"], factors, exact, moved[:, [0, 2]] * [-1, 1], run) < 3e-3).all()


@needed("counts", [(30, 4), (40, 5)])
def test_slit_annular_plate(reference, compare, counts):
    """Section 3.3.

    The table (10 x 80) is soft: isogeometric Kirchhoff-Love shells (PENGoLINS) give 13.835 and 17.473 at
    the full load, 0.40 and 0.31 % below it, and so do we.
    """
    rows = reference("sze33_slit_annular_plate")
    rows = rows[2::4] if counts == (30, 4) else rows[1:]

    def place(a, b):
        radius, angle = 6 + 4 * b, 2 * np.pi * a
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * a])

    plate = Shell(surface_mesh(counts, place, ("lifted", "clamped", "", "")), 0.03, elastic(21e6))
    case = Case(plate).fix("clamped").force("lifted", (0, 0, 0.8 * 4.0))
    run = static(case.watch("A", (6.0, 0, 0)).watch("B", (10.0, 0, 0)), rows[:, 0])
    assert run.completed, run.reason
    ours = np.column_stack([run.displacement(name)[1:, 2] for name in "AB"])
    assert (compare(["W_A", "W_B"], rows[:, 0], rows[:, 1:], ours, run) < 0.01).all()
    if counts == (40, 5):
        np.testing.assert_allclose(ours[-1], [13.835, 17.473], rtol=2e-3)


@needed("elements", [8, 16])
def test_pinched_hemisphere(compare, elements):
    """Section 3.4, hole of 18 degrees, P = 400: 4.067 outward and 8.178 inward.

    The two numbers are UNCONFIRMED: quoted as the paper's last row without a readable copy of the table at hand.
    Displacement under the inward load converges slowly here (its 16 x 16 four-node mesh: 8.178, 16 x 16 nine-node
    elements: 8.13); 8 x 8 are too few for 1 % and only tell that nothing locks.
    """

    def place(a, b):
        along, up = a * np.pi / 2, b * np.deg2rad(72)
        return 10 * np.column_stack([np.cos(up) * np.cos(along), np.cos(up) * np.sin(along), np.sin(up)])

    shell = Shell(surface_mesh((elements, elements), place, ("xz", "yz", "", "")), 0.04, elastic(6.825e7, 0.3))
    case = Case(shell).symmetry("xz", "y").symmetry("yz", "x").fix((10.0, 0, 0), "z", layer="middle")
    case.force((10.0, 0, 0), (200.0, 0, 0)).force((0, 10.0, 0), (0, -200.0, 0))
    run = static(case.watch("A", (10.0, 0, 0)).watch("B", (0, 10.0, 0)), [1.0])
    assert run.completed, run.reason
    ours = np.array([[run.displacement("A")[-1, 0], -run.displacement("B")[-1, 1]]])
    errors = compare(["U_A", "-V_B"], [1.0], [[4.067, 8.178]], ours, run)
    assert (errors < (0.03 if elements == 8 else 0.01)).all()


@needed("elements", [8, 12])
def test_cylinder_pulled_out(reference, compare, elements):
    """Section 3.5, by load, which jumps at 0.51 where the side snaps through.

    The snap comes a little earlier in a converged mesh than in the table (24 x 36): the row at its foot, 0.525, is
    left out.  Finer meshes need a neo-Hookean law to reach the full load: under the point force a 24 x 16 mesh strains
    by 30 %, and the thickness of a Saint Venant-Kirchhoff solid shell gives way there at 0.986 Pmax.
    """
    rows = reference("sze35_cylinder_pull_out")[1:]
    rows = rows[rows[:, 0] != 0.525]
    rows = rows[3::4] if elements == 8 else rows
    mesh = quarter_cylinder(4.953, 5.175, (elements * 3 // 2, elements))
    case = Case(Shell(mesh, 0.094, elastic(10.5e6, 0.3125)))
    case.symmetry("crown", "x").symmetry("side", "z").symmetry("middle", "y")
    case.force((0, 0, 4.953), (0, 0, 1e4)).watch("A", (0, 0, 4.953))
    case.watch("B", (4.953, 0, 0)).watch("C", (4.953, 5.175, 0))
    run = static(case, rows[:, 0])
    assert run.completed, run.reason
    ours = np.column_stack([run.displacement("A")[1:, 2], *(-run.displacement(n)[1:, 0] for n in "BC")])
    errors = compare(["W_A", "-U_B", "-U_C"], rows[:, 0], rows[:, 1:], ours, run)
    assert (errors < (0.015 if elements == 8 else 0.01)).all()


def pinched_cylinder(elements):
    case = Case(Shell(quarter_cylinder(100.0, 100.0, (elements, elements)), 1.0, elastic(3e4, 0.3)))
    case.symmetry("crown", "x").symmetry("side", "z").symmetry("middle", "y").fix("end", "xz")
    return case.force((0, 0, 100.0), (0, 0, -3000.0)).watch("A", (0, 0, 100.0)).watch("B", (100.0, 0, 0))


@needed("elements", [16, 32])
def test_pinched_cylinder_with_diaphragms(reference, compare, elements):
    """Section 3.6, first rows.

    Beyond 0.15 several elements leave the table by 20 to 30 %.  W at 0.15 lies at the foot of the snap, where it grows
    three times as fast as before: a mesh-converged W (33.0, 35.0, 35.3 with 16, 24, 32 elements) is 2.3 % below the
    table's 36.2, of which load there is only 0.4 % of the largest.  So the errors are those of the load at the
    displacement of the table, over Pmax, and of W over the whole table's 83.1.
    """
    rows = reference("sze36_pinched_cylinder")[1:]
    rows = rows[:3] if elements == 16 else rows
    run = static(pinched_cylinder(elements), rows[:, 0])
    assert run.completed, run.reason
    fallen = -run.displacement("A")[:, 2]
    errors = compare(["-W_A"], rows[:, 0], rows[:, 1], fallen[1:], run)
    load = CubicSpline(fallen, run.t)(np.minimum(rows[:, 1], fallen[-1]))
    slope = np.gradient(run.t, fallen)[-1]
    load += slope * np.maximum(rows[:, 1] - fallen[-1], 0.0)
    compare(["P/Pmax"], rows[:, 1], rows[:, 0], load)
    assert np.abs(load - rows[:, 0]).max() < 0.005
    assert errors.max() * np.abs(rows[:, 1]).max() < 0.012 * 83.102


@needed("elements", [12, 16])
def test_clamped_semicylinder(reference, compare, elements):
    """Section 3.7, isotropic.

    On the steep part (0.3 to 0.35, where W grows by 600 Pmax) our finer meshes stay 1.1 % of the largest W above the
    table (40 x 40): 0.3 % of Pmax in load.  Hence loads at the displacements of the table.
    """
    rows = reference("sze37_clamped_semicylinder")[1:]

    def place(a, b):
        angle = a * np.pi / 2
        return np.column_stack([101.6 * np.sin(angle), 304.8 * b, 101.6 * np.cos(angle)])

    shell = Shell(
        surface_mesh((elements, elements), place, ("crown", "side", "clamped", "")), 3.0, elastic(2068.5, 0.3)
    )
    crown = (0, 304.8, 101.6)
    case = Case(shell).symmetry("crown", "x").symmetry("side", "z").fix("clamped")
    case.force(crown, (0, 0, -1000.0)).watch("A", crown)
    furthest, increments = (100.0, 16) if elements == 12 else (172.0, 35)
    run = static(case, np.linspace(0.02, 1, increments), Steer("A", "z", -furthest))
    assert run.completed, run.reason
    rows = rows[rows[:, 1] <= furthest]
    load = CubicSpline(-run.displacement("A")[:, 2], run.t)(rows[:, 1])
    assert compare(["P/Pmax"], rows[:, 1], rows[:, 0], load, run).max() * rows[-1, 0] < 0.01


def roof(thickness, elements=4):
    """Quarter of the roof, R 2540, half angle 0.1, length 508; its hinge at mid-thickness."""

    def place(a, b):
        return np.column_stack([2540 * np.sin(0.1 * a), 254 * b, 2540 * np.cos(0.1 * a)])

    mesh = surface_mesh((elements, elements), place, ("crown", "hinge", "middle", ""))
    case = Case(Shell(mesh, thickness, elastic(3102.75, 0.3)))
    case.symmetry("crown", "x").symmetry("middle", "y").fix("hinge", layer="middle")
    return case.force((0, 0, 2540.0), (0, 0, -750.0)).watch("C", (0, 0, 2540.0))


def along(run, rows):
    """Points of a traced path nearest to the rows of a table, both coordinates over their largest in the table."""
    size = np.abs(rows).max(axis=0)
    path = np.column_stack([run.t, -run.displacement("C")[:, 2]]) / size
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    fine = CubicSpline(length, path)(np.linspace(0, length[-1], 20000))
    nearest = [np.argmin(np.linalg.norm(fine - row, axis=1)) for row in rows / size]
    return fine[nearest] * size


@pytest.mark.parametrize(
    ("thickness", "name"), [(12.7, "sze38_hinged_roof"), (6.35, "sze38_thin_hinged_roof")], ids=["thick", "thin"]
)
def test_hinged_roof_snaps_through_and_back(reference, compare, thickness, name):
    """Section 3.8: arc length through limit points of the load, for h = 6.35 of the displacement too."""
    rows = reference(name)[1:-1]
    run = trace(roof(thickness), until=1.1, first=0.02, largest=0.4)
    assert run.completed, run.reason
    ours = along(run, rows)
    falls = np.flatnonzero(np.diff(np.sign(np.diff(run.t))))
    assert len(falls) == 2  # one largest and one smallest load
    errors = compare(["P/Pmax", "-W"], np.arange(len(rows)), rows, ours, run)
    assert errors.max() < 0.01
    if thickness == 6.35:
        assert (np.diff(-run.displacement("C")[:, 2]) < 0).any()


def test_load_control_jumps_over_the_snap_of_the_roof(reference):
    """A load that the roof cannot bear is found on the far side, as a machine would."""
    rows = reference("sze38_hinged_roof")
    run = static(roof(12.7), [0.5, 0.9])
    assert run.completed, run.reason
    fallen = -run.displacement("C")[1:, 2]
    far = rows[-8:]
    expected = [np.interp(0.5, rows[:6, 0], rows[:6, 1]), np.interp(0.9, far[:, 0], far[:, 1])]
    np.testing.assert_allclose(fallen, expected, rtol=0.01)


@pytest.mark.slow
def test_long_tube_in_bending_reaches_braziers_moment(compare):
    """Maximum moment of a long tube, mean radius R: first-order theory 0.3143 pi E R t^2 / sqrt(1 - nu^2).

    A quarter of the tube, its end turned as a rigid section: 30 R leave the middle free to flatten.  Brazier dropped
    terms of the order of the flattening (0.22), so that a few per cent are all that can be asked.
    """
    radius, length, thickness, modulus, ratio = 1.0, 30.0, 0.05, 1e7, 0.3

    def place(a, b):
        angle = np.pi * a
        return np.column_stack([length / 2 * b, radius * np.sin(angle), radius * np.cos(angle)])

    mesh = surface_mesh((8, 20), place, ("top line", "low line", "middle", "end"))
    case = Case(Shell(mesh, thickness, elastic(modulus, ratio)))
    # The rigid section has the last nodes of the two lines, so that the symmetry must not.
    lines = np.concatenate([case.select("top line"), case.select("low line")])
    case.fix(np.setdiff1d(lines, case.select("end")), "y")
    case.symmetry("middle", "x").fix((0, radius, 0), "z", layer="middle")
    critical = np.sqrt(2) * thickness / (3 * radius**2 * np.sqrt(1 - ratio**2))
    case.rigid("turned end", "end", at=(length / 2, 0, 0)).hold("y", "rx", "rz").move(ry=1.1 * critical * length / 2)
    run = static(case, np.linspace(0.1, 1, 10))
    moment = 2 * np.abs(run.wrench("turned end")[:, 4])
    expected = 2 * np.sqrt(2) * np.pi * modulus * radius * thickness**2 / (9 * np.sqrt(1 - ratio**2))
    assert moment.argmax() < len(moment) - 1, run.reason
    assert compare(["largest moment"], [0.0], [expected], [moment.max()], run)[0] < 0.08
