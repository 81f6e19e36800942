import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from lab.beam_theory import natural_modes, torsional_rigidity
from lab.materials import Material, PronyBranch
from lab.sections import torsion_constant
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame

FRAME = LoadFrame(width=0.05, height=0.03, corner="upper-left")


def frequencies(specimen, count, kind=None):
    return np.array([mode.frequency for mode in natural_modes(specimen, count) if kind in (None, mode.kind)])


def section_points(specimen, count=12):
    """Places (n, 2) and areas (n,) of quadrature points of the section at angle zero."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    y, z = np.meshgrid(nodes * specimen.width / 2, nodes * specimen.thickness / 2, indexing="ij")
    return np.stack([y.ravel(), z.ravel()], 1), np.outer(weights, weights).ravel() * specimen.area / 4


@pytest.mark.parametrize(
    ("degrees", "bending", "rigidity"),
    # "pretwisted_dissertation_beam_modes": exact transfer matrix of Timoshenko's equations in the turning axes;
    # torsional rigidity over length, N*m/rad, with the term of the pre-twist in a beam that may shorten freely.
    [
        (0, [28.32725, 168.122, 174.32669, 474.8063], 0.02922459),
        (30, [28.36694, 136.23116, 213.54791, 455.73432], 0.03226743),
        (45, [28.42002, 122.05026, 236.0139, 437.56789], 0.03607098),
        (90, [28.76266, 90.77603, 293.15845, 389.90222], 0.05661015),
        (135, [29.47307, 71.78798, 284.94641, 406.16887], 0.0908421),
        (180, [30.56377, 60.22784, 247.73747, 431.85809], 0.13876683),
    ],
)
def test_transfer_matrix_of_the_pretwisted_beam(degrees, bending, rigidity):
    beam = TwistedBeam(twist=np.deg2rad(degrees))
    np.testing.assert_allclose(frequencies(beam, 8, "bending")[:4], bending, rtol=1e-6)
    assert torsional_rigidity(beam) / beam.length == pytest.approx(rigidity, rel=1e-6)


@pytest.mark.parametrize("degrees", [0, 60, 180])
def test_torsion_with_stretch_is_two_waves(degrees):
    """Both fields obey one wave equation with constant matrices: (2 n - 1) / (4 L) times the speeds of its waves."""
    beam = TwistedBeam(length=0.2, twist=np.deg2rad(degrees), root_angle=0.3)
    e, g, rho = beam.material.youngs_modulus, beam.material.shear_modulus, beam.material.density
    places, areas = section_points(beam)
    fibres = np.stack([np.ones(len(areas)), beam.twist / beam.length * np.sum(places**2, 1)])
    stiffness = e * (fibres * areas) @ fibres.T + np.diag([0, g * torsion_constant(beam.width, beam.thickness)])
    mass = rho * np.diag([areas.sum(), areas @ np.sum(places**2, 1)])
    speeds = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
    expected = np.sort([(2 * n - 1) / (4 * beam.length) * speed for n in range(1, 12) for speed in speeds])[:4]
    modes = natural_modes(beam, 24)
    along = [mode.frequency for mode in modes if mode.kind != "bending"]
    np.testing.assert_allclose(along[:4], expected, rtol=1e-8)


def test_torsion_is_slower_than_with_free_shortening():
    """The tabulated frequency at 90 deg, 169.107 Hz, has no inertia along the axis (see the source above)."""
    torsion = frequencies(TwistedBeam(twist=np.pi / 2), 4, "torsion")[0]
    assert 0.975 < torsion / 169.10748 < 0.99
    assert frequencies(TwistedBeam(twist=0.0), 4, "torsion")[0] == pytest.approx(121.5038, rel=1e-6)


def test_slender_beam_is_euler_and_bernoulli_s():
    beam = TwistedBeam(length=2.0, width=0.01, thickness=0.004, twist=0.0, material=Material(poisson_ratio=0.0))
    roots = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    speed = np.sqrt(beam.material.youngs_modulus / beam.material.density)
    planes = [roots**2 / (2 * np.pi * beam.length**2) * speed * side / np.sqrt(12) for side in (0.004, 0.01)]
    np.testing.assert_allclose(frequencies(beam, 5), np.sort(np.concatenate(planes))[:5], rtol=3e-4)


def test_stretch_of_the_untwisted_beam():
    beam = TwistedBeam(twist=0.0)
    assert frequencies(beam, 12, "stretch")[0] == pytest.approx(np.sqrt(26e6 / 1210) / (4 * 0.05), rel=1e-9)


@pytest.mark.parametrize("share", [0.5, 3.0])
def test_tip_mass_on_a_slender_beam(share):
    """1 + cos b cosh b + share b (cos b sinh b - sin b cosh b) = 0 for a point of that share of the beam's mass."""
    bare = TwistedBeam(length=2.0, width=0.01, thickness=0.01, twist=0.0, material=Material(poisson_ratio=0.0))
    beam = bare.model_copy(update={"tip_mass": share * bare.beam_mass})

    def condition(b):
        return 1 + np.cos(b) * np.cosh(b) + share * b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b))

    speed = np.sqrt(bare.material.youngs_modulus / bare.material.density) * 0.01 / np.sqrt(12)
    expected = [brentq(condition, low, high) ** 2 / (2 * np.pi * 4.0) * speed for low, high in ((0.5, 1.9), (3.9, 4.7))]
    np.testing.assert_allclose(frequencies(beam, 4), np.repeat(expected, 2), rtol=1e-3)


def test_mass_wins_over_density():
    light, heavy = TwistedBeam(), TwistedBeam(mass=4 * TwistedBeam().beam_mass)
    np.testing.assert_allclose(frequencies(heavy, 6), frequencies(light, 6) / 2, rtol=1e-9)


def points_of_frame(frame, corner, steps=1000):
    """Places (n, 2) and masses (n,) of points along the four sides, and of the load."""
    part = (np.arange(steps) + 0.5) / steps - 0.5
    upright = [np.stack([part * frame.height, np.full(steps, end * frame.width / 2)], 1) for end in (-1, 1)]
    level = [np.stack([np.full(steps, end * frame.height / 2), part * frame.width], 1) for end in (-1, 1)]
    lengths = np.repeat([frame.height, frame.height, frame.width, frame.width], steps)
    places = np.concatenate([*upright, *level, [corner]])
    return places, np.append(frame.mass * lengths / lengths.sum(), frame.load)


def rigid_mass(places, masses):
    """Mass matrix (6, 6) of points (y, z) for the motion u, v, w and the turns about x, y, z of their origin."""
    total = np.zeros((6, 6))
    for (y, z), mass in zip(places, masses, strict=True):
        motion = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, 0], [y, 0, 0]]])
        total += mass * motion.T @ motion
    return total


def tip_compliance(beam, steps=2000):
    """Motion of the tip (6,) over forces and moments there: what the sections yield, summed along the axis."""
    material, total = beam.material, np.zeros((6, 6))
    places, areas = section_points(beam)
    for x in (np.arange(steps) + 0.5) / steps * beam.length:
        angle = beam.section_angle(x)
        y, z = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ places.T
        none, winding = np.zeros_like(y), beam.twist / beam.length * (y**2 + z**2)
        fibres = np.stack([none + 1, none, none, winding, z, -y])
        shear = 5 / 6 * material.shear_modulus * beam.area
        rigidity = material.shear_modulus * torsion_constant(beam.width, beam.thickness)
        stiffness = material.youngs_modulus * (fibres * areas) @ fibres.T
        stiffness += np.diag([0, shear, shear, rigidity, 0, 0])
        load = np.eye(6)
        load[4, 2], load[5, 1] = -(beam.length - x), beam.length - x
        total += load.T @ np.linalg.solve(stiffness, load) * beam.length / steps
    return total


@pytest.mark.parametrize("twist", [0.0, np.pi / 2])
def test_rigid_frame_on_a_beam_without_mass(twist):
    """Six rigid motions on a spring: compliance by summing up sections, inertia by points."""
    beam = TwistedBeam(twist=twist, root_angle=0.2, mass=1e-10, tip_mass=0.004, load_frame=FRAME)
    face, areas = section_points(beam)
    angle = beam.section_angle(beam.length)
    turned = face @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    mass = rigid_mass(*points_of_frame(FRAME, [0.015, 0.025])) + rigid_mass(turned, 0.004 * areas / beam.area)
    squares = eigh(np.linalg.inv(tip_compliance(beam)), mass, eigvals_only=True)
    np.testing.assert_allclose(frequencies(beam, 6), np.sqrt(squares) / (2 * np.pi), rtol=1e-5)


def test_load_at_a_corner_mixes_the_kinds():
    frame = LoadFrame()
    even, uneven = (
        {mode.kind for mode in natural_modes(TwistedBeam(twist=np.pi / 2, load_frame=one), 4)}
        for one in (frame.model_copy(update={"load": 0.0}), frame)
    )
    assert "mixed" not in even
    assert "mixed" in uneven


@pytest.mark.parametrize("corner", ["lower-left", "upper-right"])
def test_mirrored_beam_sounds_alike(corner):
    beam = TwistedBeam(twist=1.2, root_angle=0.4, tip_mass=0.002, load_frame=LoadFrame(corner=corner))
    np.testing.assert_allclose(frequencies(beam.mirrored(), 8), frequencies(beam, 8), rtol=1e-9)
    # Only the load in its corner gives the beam a hand: the twist alone must not do for a mirror.
    turned_back = beam.model_copy(update={"twist": -beam.twist, "root_angle": -beam.root_angle})
    assert np.abs(frequencies(turned_back, 8) / frequencies(beam, 8) - 1).max() > 1e-3


def test_clamp_may_be_turned():
    """Nothing but the load tells the directions of the room apart."""
    bare = TwistedBeam(twist=1.0)
    turned = bare.model_copy(update={"root_angle": 0.7})
    np.testing.assert_allclose(frequencies(turned, 10), frequencies(bare, 10), rtol=1e-9)


@pytest.mark.parametrize("frame", [None, FRAME])
def test_more_polynomials_change_nothing(frame):
    """The number of modes asked for sets the number of polynomials."""
    beam = TwistedBeam(length=0.5, twist=2 * np.pi, load_frame=frame)
    many = frequencies(beam, 24)
    assert (np.diff(many) >= 0).all()
    np.testing.assert_allclose(frequencies(beam, 3), many[:3], rtol=1e-6)
    np.testing.assert_allclose(frequencies(beam, 12), many[:12], rtol=1e-6)


def test_relaxing_branch_stiffens_modes_above_its_rate():
    def with_branch(time):
        return frequencies(TwistedBeam(material=Material(prony=(PronyBranch(ratio=0.44, time=time),))), 4)

    slow = frequencies(TwistedBeam(), 4)
    np.testing.assert_allclose(with_branch(1e-9), slow, rtol=1e-6)
    np.testing.assert_allclose(with_branch(1e3), 1.2 * slow, rtol=1e-6)
    found = with_branch(2e-3)
    square = (2 * np.pi * found * 2e-3) ** 2
    np.testing.assert_allclose(found, slow * np.sqrt(1 + 0.44 * square / (1 + square)), rtol=1e-9)


def test_no_mode_is_asked_for():
    with pytest.raises(ValueError, match="count 0 must be at least 1"):
        natural_modes(TwistedBeam(), 0)
