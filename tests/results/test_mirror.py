import math

import numpy as np
import pytest

from lab.experiments import BaseShake
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from results.mirror import HALF_TURN, MIRROR, later, mirror_table, pairs


def beam(degrees, **more):
    return TwistedBeam(twist=math.radians(degrees), **more)


def swing(coupling, *, frequency=15.0, amplitude=0.002, mass=(0.005, 0.005), eccentricity=(0.0, 0.0), samples=64):
    """Path of a damped mass on springs over a shaken clamp, as seen from it: three coupled equations, solved.

    ``coupling`` of y and z has the sign of the twist; ``eccentricity`` couples y and z with the turn about the axis.
    """
    omega = 2 * np.pi * frequency
    (ey, ez), inertia = eccentricity, 1e-6
    stiffness = np.array([[120.0, coupling, 0.0], [coupling, 60.0, 0.0], [0.0, 0.0, 0.02]])
    # A mass at (ey, ez) moves by -ez turn along y and +ey turn along z.
    masses = np.array([[mass[0], 0, -mass[0] * ez], [0, mass[1], mass[1] * ey], [0, 0, 0]])
    masses[2] = masses[:, 2]
    masses[2, 2] = inertia + mass[0] * ez**2 + mass[1] * ey**2
    dynamic = stiffness * (1 + 1j * omega * 1e-3) - omega**2 * masses
    response = np.linalg.solve(dynamic, omega**2 * masses[:, 1] * amplitude)
    turn = np.exp(1j * omega * np.arange(samples + 1) / samples / frequency)
    return (response[None, :2] * turn[:, None]).imag


def test_half_a_period_later_is_exact_for_any_number_of_samples():
    for samples in (9, 64):
        time = np.arange(samples + 1) / samples
        path = np.stack(
            [np.sin(2 * np.pi * time) + 0.3 * np.cos(6 * np.pi * time + 1), 2 + np.cos(4 * np.pi * time)], 1
        )
        after = time + 0.5
        wanted = np.stack(
            [np.sin(2 * np.pi * after) + 0.3 * np.cos(6 * np.pi * after + 1), 2 + np.cos(4 * np.pi * after)], 1
        )
        np.testing.assert_allclose(later(path), wanted, atol=1e-12)


@pytest.mark.parametrize("seen_from", ["clamp", "room"])
def test_opposite_couplings_mirror_each_other(orbit, seen_from):
    shake = {"seen_from": seen_from}
    found = pairs(
        [
            orbit(specimen=beam(60), path=swing(20.0), **shake),
            orbit(specimen=beam(20), path=swing(9.0), **shake),
            orbit(specimen=beam(-60), path=swing(-20.0), **shake),
        ],
        MIRROR,
    )
    (pair,) = found
    assert (pair.one.slug, pair.other.slug) == ("twist=60deg_frequency=15Hz", "twist=-60deg_frequency=15Hz")
    assert pair.deviation < 1e-12
    assert pair.senses_agree


def test_what_breaks_the_law_is_told(orbit):
    right = orbit(specimen=beam(60), path=swing(20.0))
    (same,) = pairs([right, orbit(specimen=beam(-60), path=swing(20.0))], MIRROR)
    assert same.deviation > 0.1
    assert not same.senses_agree
    (soon,) = pairs([right, orbit(specimen=beam(-60), path=later(swing(-20.0)))], MIRROR)
    assert soon.deviation > 0.5
    assert soon.senses_agree  # only the phase is wrong
    (larger,) = pairs([right, orbit(specimen=beam(-60), path=1.01 * swing(-20.0))], MIRROR)
    assert 0.002 < larger.deviation < 0.0051  # 1 % of the largest displacement, over the major axis


def test_a_turned_clamp_is_the_same_after_half_a_turn(orbit):
    one = orbit(specimen=beam(60, root_angle=math.pi / 2), path=swing(20.0))
    other = orbit(specimen=beam(-60, root_angle=math.pi / 2), path=swing(-20.0))
    assert len(pairs([one, other], MIRROR)) == 1
    assert not pairs([one, orbit(specimen=beam(-60), path=swing(-20.0))], MIRROR)
    slanted = orbit(specimen=beam(60, root_angle=0.3), path=swing(20.0))
    assert not pairs([slanted, orbit(specimen=beam(-60, root_angle=0.3), path=swing(-20.0))], MIRROR)
    assert pairs([slanted, orbit(specimen=beam(-60, root_angle=-0.3), path=swing(-20.0))], MIRROR)


def test_an_untwisted_beam_is_its_own_mirror_image(orbit):
    (pair,) = pairs([orbit(specimen=beam(0), path=swing(0.0))], MIRROR)
    assert pair.one is pair.other
    assert pair.deviation < 1e-12
    assert pair.senses_agree
    (crooked,) = pairs([orbit(specimen=beam(0), path=swing(5.0))], MIRROR)
    assert not crooked.senses_agree


def test_gravity_and_markers_must_have_the_symmetry():
    up, across = BaseShake(own_weight=math.pi), BaseShake(own_weight=math.pi / 2)
    assert MIRROR.holds(BaseShake())
    assert MIRROR.holds(up)
    assert not MIRROR.holds(across)
    assert not HALF_TURN.holds(up)
    assert not MIRROR.holds(BaseShake(markers=((0.0, 0.0, 0.01),)))
    pair = BaseShake(markers=((0.0, 0.005, 0.01), (0.0, 0.005, -0.01)))
    assert MIRROR.holds(pair)
    assert not HALF_TURN.holds(pair)


def test_weights_at_the_corners(orbit):
    """Mirrored: left and right exchanged and the twist opposite; after half a turn: the opposite corner."""
    places = {"lower-left": (-1, 1), "lower-right": (-1, -1), "upper-left": (1, 1), "upper-right": (1, -1)}
    entries = [
        orbit(
            specimen=beam(phi, load_frame=LoadFrame(corner=corner)), slug=f"{phi} {corner}",
            path=swing(phi / 3, eccentricity=(0.01 * y, 0.01 * z)),
        )
        for phi in (60, -60)
        for corner, (y, z) in places.items()
    ]  # fmt: skip
    mirrored, turned = pairs(entries, MIRROR), pairs(entries, HALF_TURN)
    assert {(p.one.slug, p.other.slug) for p in mirrored} >= {("60 lower-left", "-60 lower-right")}
    assert {(p.one.slug, p.other.slug) for p in turned} >= {("60 lower-left", "60 upper-right")}
    assert len(mirrored) == len(turned) == 4
    assert all(p.senses_agree and p.deviation < 1e-12 for p in [*mirrored, *turned])
    table = mirror_table(entries)
    assert [line[2:4] for line in table.rows] == [("mirror", "4"), ("half turn", "4")]
    assert [line[-1] for line in table.rows] == ["4 of 4", "4 of 4"]


def test_pairs_keep_to_one_performer_campaign_and_experiment(orbit):
    right, left = {"specimen": beam(60), "path": swing(20.0)}, {"specimen": beam(-60), "path": swing(-20.0)}
    assert mirror_table([orbit(**right), orbit("chain", **left)]) is None
    assert mirror_table([orbit(**right), orbit(campaign="other", **left)]) is None
    assert not pairs([orbit(**right), orbit(frequency=16.0, **left)], MIRROR)
    assert not pairs([orbit(**right), orbit(status="diverged", **left)], MIRROR)
    assert mirror_table([orbit(**right), orbit(**left)]).rows[0][:4] == ("shake", "fea", "mirror", "1")
