"""Contact against closed forms: patch, Hertz, Coulomb, rings between plates, pinched and collapsed onto themselves."""

import numpy as np
import pytest

from fea.body import Body
from fea.case import Case, stages
from fea.contact import ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.shell import Shell
from fea.statics import static
from lab.materials import Material
from meshes.structured import solid_mesh, surface_mesh

MODULUS = 1e6


def show(what, reference, ours):
    print(f"{what}: reference {reference:.6g}, ours {ours:.6g}, error {100 * (ours / reference - 1):+.3f} %")


def report(run, name, increment=-1):
    return run.reports[increment][name]


def block(counts, lengths, corner=(0.0, 0.0, 0.0), poisson_ratio=0.3):
    mesh = solid_mesh(counts, lambda *abc: np.stack(abc, axis=1) * lengths + np.array(corner))
    return Body(mesh, Material(youngs_modulus=MODULUS, poisson_ratio=poisson_ratio))


def uniaxial(stretch):
    """Nominal stress of a Saint Venant-Kirchhoff bar that is free to widen."""
    return MODULUS * stretch * (stretch**2 - 1) / 2


def test_a_block_on_a_plane_feels_one_pressure():
    law = ContactLaw(MODULUS, tolerance=1e-5)
    case = Case(block((3, 2, 2), (0.3, 0.2, 0.1)))
    case.symmetry("a0", "x").symmetry("b0", "y").fix("top", "z", to=-0.004)
    surface, contact = case.surface("bottom"), []
    case.add(
        lambda points: (
            contact.append(PlaneContact(surface, points, Plane(np.zeros(3), np.array([0, 0, 1.0])), law)) or contact[-1]
        )
    )
    run = static(case)
    assert run.completed, run.reason
    exact = -uniaxial(1 - 0.004 / 0.1) * 0.06
    show("force, N", exact, report(run, "normal force [N], term 0"))
    assert report(run, "normal force [N], term 0") == pytest.approx(exact, rel=3e-4)
    pressure = contact[-1].fields(run.field())["contact pressure [Pa]"][surface.nodes]
    np.testing.assert_allclose(pressure, pressure.mean(), rtol=1e-8)


def test_blocks_whose_meshes_do_not_fit_pass_one_pressure_on():
    case = Case(block((3, 2, 2), (0.3, 0.3, 0.1)), block((2, 5, 2), (0.3, 0.3, 0.1), (0, 0, 0.1)))
    case.symmetry("a0", "x").symmetry("b0", "y").fix("bottom", "z", part=case.parts[0])
    case.fix("top", "z", to=-0.004, part=case.parts[1])
    low, high = case.surface("top", case.parts[0]), case.surface("bottom", case.parts[1])
    law = ContactLaw(MODULUS, tolerance=1e-4)
    case.add(lambda points: SurfaceContact(high, low, points, law))
    run = static(case)
    assert run.completed, run.reason
    exact = -uniaxial(1 - 0.004 / 0.2) * 0.09
    show("force, N", exact, report(run, "normal force [N], term 0"))
    assert report(run, "normal force [N], term 0") == pytest.approx(exact, rel=1e-3)
    places = zip(case.parts, case.offsets, strict=False)
    across = [part.stresses(run.field()[start : start + part.nodes])[..., 2].ravel() for part, start in places]
    largest = np.abs(np.concatenate(across) / np.concatenate(across).mean() - 1).max()
    show("largest stress over the mean", 1.0, 1 + largest)
    # Points of a quadrature rule on one side do not integrate exactly across the edges of the other.
    assert largest < 0.05


def test_hertz_cylinder_on_a_plane():
    radius, width, depth, angle, push = 1.0, 0.01, 0.35, 0.5, 1e-3

    def place(a, b, c):
        around, inward = angle * (0.1 * a + 0.9 * a**3), depth * (0.1 * c + 0.9 * c**3)
        return np.stack([(radius - inward) * np.sin(around), b * width, -(radius - inward) * np.cos(around)], axis=1)

    body = Body(solid_mesh((24, 1, 12), place), Material(youngs_modulus=MODULUS, poisson_ratio=0.3))
    case = Case(body).symmetry("a0", "x").fix(lambda x: np.full(len(x), True), "y")
    case.fix("top", "z", to=-push).fix("a1", "z", to=-push)
    law = ContactLaw(MODULUS)
    surface, contact = case.surface("bottom"), []
    plane = Plane(np.array([0, 0, -radius]), np.array([0, 0, 1.0]))
    case.add(lambda points: contact.append(PlaneContact(surface, points, plane, law)) or contact[-1])
    run = static(case)
    assert run.completed, run.reason
    line = 2 * report(run, "normal force [N], term 0") / width
    stiff = MODULUS / (1 - 0.3**2)
    half_width, largest = np.sqrt(4 * line * radius / (np.pi * stiff)), np.sqrt(line * stiff / (np.pi * radius))
    touch = contact[-1].touch(run.field(), 1.0)
    places = np.einsum("qk,fkc->fqc", surface.shapes().values, (case.points + run.field())[surface.facets])
    x = places[..., 0].ravel()
    # Hertz: p = p0 sqrt(1 - x^2/a^2), whose mean of x^2 is a^2/4.
    weights = touch.pressure * contact[-1].areas
    ours = 2 * np.sqrt(weights @ x**2 / weights.sum())
    profile = np.sqrt(np.maximum(1 - (x / half_width) ** 2, 0))
    top = (contact[-1].areas * profile) @ touch.pressure / ((contact[-1].areas * profile) @ profile)
    show("largest pressure, Pa", largest, top)
    show("half-width, m", half_width, ours)
    assert half_width / radius == pytest.approx(0.025, abs=0.005)
    assert top == pytest.approx(largest, rel=0.015)
    assert ours == pytest.approx(half_width, rel=0.015)


def test_a_block_sticks_then_slides_with_the_coefficient_of_friction():
    friction, press, drag = 0.3, 0.001, 0.01
    case = Case(block((3, 2, 1), (0.3, 0.2, 0.1), poisson_ratio=0.0))
    case.fix("top", "z", to=-press, ramp=stages((0, 0), (1, 1)))
    case.fix("top", "x", to=drag, ramp=stages((1, 0), (2, 1), (3, 0.0))).fix("top", "y")
    surface = case.surface("bottom")
    plane = Plane(np.zeros(3), np.array([0, 0, 1.0]))
    law = ContactLaw(MODULUS, friction=friction)
    case.add(lambda points: PlaneContact(surface, points, plane, law))
    at = np.round(np.concatenate([np.arange(0.5, 1.04, 0.5), np.arange(1.02, 3.001, 0.02)]), 6)
    run = static(case, at)
    assert run.completed, run.reason
    normal = np.array([r.get("normal force [N], term 0", 0.0) for r in run.reports])
    drive = run.reaction("top")[:, 0]
    there, back = np.searchsorted(run.t, [2.0, 3.0])
    show("sliding force over normal force", friction, drive[there] / normal[there])
    assert drive[there] == pytest.approx(friction * normal[there], rel=0.01)
    assert drive[back] == pytest.approx(-friction * normal[back], rel=0.01)
    # While it sticks, the block is sheared: less than G A / h, as its feet are free to turn and slip in part.
    early = np.searchsorted(run.t, 1.04)
    sheared = MODULUS / 2 * 0.06 / 0.1 * drag * 0.04
    assert 0.5 * sheared < drive[early] < sheared
    work = float(np.trapezoid(drive, run.displacement("top")[:, 0]))
    loss = report(run, "friction loss [J], term 0")
    show("energy lost, J", work, loss)
    assert loss == pytest.approx(work, rel=0.05)


RADIUS, WIDTH = 1.0, 0.1


def ring(elements, thickness, begin, end, law="saint-venant-kirchhoff", oval=0.0):
    """Arc between two angles in the x-y plane; ``top`` is its outside."""

    def place(a, b):
        angle = end + (begin - end) * (1 - a)
        r = RADIUS + oval * np.cos(2 * angle)
        return np.stack([r * np.cos(angle), r * np.sin(angle), b * WIDTH], axis=1)

    mesh = surface_mesh((elements, 1), place, ("begin", "end", "sides", "sides"))
    material = Material(youngs_modulus=MODULUS, poisson_ratio=0.0, law=law)
    return Shell(mesh, thickness, material)


def bending(thickness):
    return MODULUS * WIDTH * thickness**3 / 12


def flattened(shortening):
    """P R^2 / EI of a ring between frictionless rigid plates once it lies flat on them, 0.5645 <= delta/R < 2.

    Its arc from the lift-off (angle and curvature zero) to the side (angle 90 degrees) carries P/2 across:
    EI k^2 / 2 = (P/2) sin(angle), so the half distance is the integral of sin(angle) / k.
    """
    from scipy.special import gamma

    half = np.sqrt(np.pi) * gamma(0.75) / (2 * gamma(1.25))
    return (2 * half / (2 - shortening)) ** 2


#: Point loads, P R^2/EI by delta/R: own solution of the elastica; holds under plates up to 0.5645.
POINT_LOADS = {0.2: 1.174331514, 0.4: 2.115300378, 0.55: 2.730055454}


def test_ring_between_plates_follows_the_exact_elastica():
    thickness, end = 0.02, 1.4
    shell = ring(32, thickness, 0.0, np.pi / 2)
    case = Case(shell).symmetry("begin", "y").symmetry("end", "x").fix("sides", "z")
    law = ContactLaw(MODULUS, thickness)
    surface = case.surface("top")
    plane = Plane(
        np.array([0, RADIUS + thickness / 2, 0]), np.array([0, -1.0, 0]), stages((0, 0), (end, end / 2 * RADIUS))
    )
    case.add(lambda points: PlaneContact(surface, points, plane, law))
    at = np.round(np.arange(0.025, end + 1e-9, 0.025), 6)
    run = static(case, at)
    assert run.completed, run.reason
    expected = POINT_LOADS | {d: flattened(d) for d in (0.6, 0.8, 1.0, 1.2, 1.4)}
    for shortening, exact in expected.items():
        increment = int(np.argmin(np.abs(run.t - shortening)))
        ours = 2 * report(run, "normal force [N], term 0", increment) * RADIUS**2 / bending(thickness)
        show(f"P R^2/EI at delta/R {shortening}", exact, ours)
        assert ours == pytest.approx(exact, rel=0.01)
        assert report(run, "largest penetration [m], term 0", increment) <= 0.01 * thickness
    assert flattened(2 - 2 * 1.1981402347355922 / np.sqrt(2.786407859371)) == pytest.approx(2.786407859371)
    tangents = [i["tangents"] for i in run.history["per_increment"]]
    print(f"tangents per increment of 2.5 % of R: {tangents}")
    assert np.mean(tangents) < 6


def pinch(elements, thickness, law, last, plates=None, tolerance=None):
    """Half a ring, pinched by lines until the outer lines are ``last`` apart, then flattened between plates."""
    shell = ring(elements, thickness, -np.pi / 2, np.pi / 2, law)
    case = Case(shell).symmetry("begin", "x").symmetry("end", "x").fix("sides", "z")
    travel = RADIUS + thickness / 2 - last / 2
    to_touch = stages((0, 0), (1, 1))
    outside = RADIUS + thickness / 2
    for name, sign in (("end", 1.0), ("begin", -1.0)):
        line = lambda x, sign=sign: (np.abs(x[:, 0]) < 1e-3) & (np.abs(x[:, 1] - sign * outside) < 1e-3)  # noqa: E731
        case.fix(line, "y", to=-sign * travel, ramp=to_touch).watch(name, line)
    surface, outer, figures = (
        case.surface("bottom"),
        case.surface("top"),
        ContactLaw(MODULUS, thickness, tolerance=tolerance),
    )
    case.add(lambda points: SurfaceContact(surface, surface, points, figures))
    if plates is not None:
        down = stages((1, 0), (2, outside - plates))
        for sign in (1.0, -1.0):
            plane = Plane(np.array([0, sign * outside, 0]), np.array([0, -sign, 0]), down)
            case.add(lambda points, plane=plane: PlaneContact(outer, points, plane, figures))
    return case


def test_pinched_ring_touches_itself_as_it_touches_its_plane_of_symmetry():
    thickness, last = 0.04, 2 * 0.04 * 0.98
    case = pinch(48, thickness, "saint-venant-kirchhoff", last, tolerance=1e-3)
    at = np.round(np.arange(0.025, 1.0001, 0.025), 6)
    run = static(case, at)
    assert run.completed, run.reason
    assert 0 < report(run, "largest penetration [m], term 0") <= 1e-3 * thickness
    print("tangents per increment of 5 % of R:", [i["tangents"] for i in run.history["per_increment"]])
    quarter = Case(ring(24, thickness, 0.0, np.pi / 2)).symmetry("begin", "y").symmetry("end", "x").fix("sides", "z")
    top = lambda x: (np.abs(x[:, 0]) < 1e-3) & (np.abs(x[:, 1] - RADIUS - thickness / 2) < 1e-3)  # noqa: E731
    quarter.fix(top, "y", to=last / 2 - RADIUS - thickness / 2)
    surface, law = quarter.surface("bottom"), ContactLaw(MODULUS, thickness, tolerance=1e-3)
    plane = Plane(np.zeros(3), np.array([0, 1.0, 0]))
    quarter.add(lambda points: PlaneContact(surface, points, plane, law))
    half = static(quarter, at)
    assert half.completed, half.reason
    show(
        "force between the walls, N",
        report(half, "normal force [N], term 0"),
        report(run, "normal force [N], term 0"),
    )
    assert report(run, "normal force [N], term 0") == pytest.approx(report(half, "normal force [N], term 0"), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "neo-hookean"])
def test_pinched_ring_is_flattened_onto_itself(law):
    thickness = 0.04
    plates = (2.5 if law == "neo-hookean" else 4.0) * thickness
    case = pinch(64, thickness, law, 2 * thickness * 0.995, plates)
    run = static(case, np.round(np.arange(0.02, 2.0001, 0.02), 6))
    assert run.completed, run.reason
    depths = np.array([r.get("largest penetration [m], term 0", 0.0) for r in run.reports]) / thickness
    show("largest penetration over the wall", 0.01, depths.max())
    assert depths.max() <= 0.01
    height = np.ptp((case.points + run.field())[:, 1])
    assert height == pytest.approx(2 * plates, rel=0.01)
    touching = run.reports[-1]["active points, term 0"]
    assert touching >= 2 * run.reports[int(np.argmin(np.abs(run.t - 1.0)))]["active points, term 0"]
    print("tangents per increment", [i["tangents"] for i in run.history["per_increment"]])


@pytest.mark.slow
def test_ring_collapses_under_pressure_until_its_sides_touch():
    """Flaherty, Keller & Rubinow, SIAM J. Appl. Math. 23 (1972) 446: p R^3/EI = 3 at buckling, 5.247 at touch."""
    thickness = 0.02
    shell = ring(32, thickness, 0.0, np.pi / 2, oval=1e-3)
    case = Case(shell).symmetry("begin", "y").symmetry("end", "x").fix("sides", "z")
    # The pressure on the outside, at R + t/2, as one on the middle line; per unit of p R^3/EI.
    unit = bending(thickness) / WIDTH / RADIUS**3 / (1 + thickness / 2)
    case.pressure("top", unit, ramp=lambda t: t)
    low = lambda x: (np.abs(x[:, 0]) < 1e-3) & (x[:, 1] > 0)  # noqa: E731
    case.watch("crown", low)
    surface, law = case.surface("bottom"), ContactLaw(MODULUS, thickness)
    plane = Plane(np.zeros(3), np.array([0, 1.0, 0]))
    case.add(lambda points: PlaneContact(surface, points, plane, law))
    at = np.concatenate([np.arange(1.0, 2.9, 0.5), np.arange(2.9, 20.0, 0.1)])
    run = static(case, at)
    assert run.completed, run.reason
    middle = RADIUS + run.displacement("crown")[:, 1]
    before = middle > 0.1 * RADIUS
    falling = middle[before] < 0.9
    touch = np.polyval(np.polyfit(middle[before][falling], run.t[before][falling], 4), 0.0)
    show("p R^3/EI where the middle lines would touch", 5.247, touch)
    assert touch == pytest.approx(5.247, rel=0.01)
    depths = [r.get("largest penetration [m], term 1", 0.0) for r in run.reports]
    assert max(depths) <= 0.01 * thickness
    assert run.reports[-1]["active points, term 1"] > 9
