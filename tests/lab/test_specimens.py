"""The beam's load frame and mirror image."""

import numpy as np
import pytest
from pydantic import ValidationError

from lab.fields import changed, shown
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame
from lab.units import WRITTEN_BY_HAND


def test_moments_of_the_frame_are_those_of_points_along_its_sides():
    frame = LoadFrame(width=0.05, height=0.03, mass=0.012, load=0.02, corner="upper-right")
    share = (np.arange(4000) + 0.5) / 4000 - 0.5
    sides = [
        *((length * share, np.full(4000, place), length) for length, place in ((0.03, 0.025), (0.03, -0.025))),
        *((np.full(4000, place), length * share, length) for length, place in ((0.05, 0.015), (0.05, -0.015))),
    ]
    total = np.zeros((3, 3))
    for y, z, length in sides:
        points = np.stack([np.ones(4000), y, z])
        total += frame.mass * length / 0.16 * (points @ points.T) / 4000
    corner = np.array([1.0, 0.015, -0.025])
    assert frame.moments() == pytest.approx(total + 0.02 * np.outer(corner, corner), rel=1e-6, abs=1e-12)
    assert frame.total_mass == pytest.approx(0.032)


@pytest.mark.parametrize(
    ("corner", "y", "z"),
    [("lower-left", -1, 1), ("lower-right", -1, -1), ("upper-left", 1, 1), ("upper-right", 1, -1)],
)
def test_corners_as_seen_from_the_tip(corner, y, z):
    """Seen against x with y up, what is left is +z: (viewer's right) x (up) points to the viewer."""
    assert LoadFrame(corner=corner).load_place == pytest.approx((0.0, 0.02 * y, 0.02 * z))
    assert np.cross([0, 0, -1], [0, 1, 0]) == pytest.approx([1, 0, 0])


def test_the_mirror_image_has_the_opposite_chirality():
    beam = TwistedBeam(twist=1.2, root_angle=0.3, load_frame=LoadFrame(corner="upper-left"))
    mirrored = beam.mirrored()
    x = np.linspace(0.0, beam.length, 7)
    assert mirrored.section_angle(x) == pytest.approx(-beam.section_angle(x))
    y, z = beam.load_frame.load_place[1:]
    assert mirrored.load_frame.load_place == pytest.approx((0.0, y, -z))
    assert mirrored.mirrored() == beam


def test_the_frame_can_be_swept():
    beam = TwistedBeam(load_frame=LoadFrame())
    heavy = changed(changed(beam, "load_frame.load", "40 g"), "load_frame.corner", "upper-right")
    assert (heavy.load_frame.load, heavy.load_frame.corner) == (pytest.approx(0.04), "upper-right")
    assert (shown(heavy, "load_frame.load"), shown(heavy, "load_frame.corner")) == ("40g", "upper-right")
    with pytest.raises(ValueError, match="corner: Input should be 'lower-left'"):
        changed(beam, "load_frame.corner", "middle")
    with pytest.raises(ValueError, match="load_frame.*no parameter"):
        changed(TwistedBeam(), "load_frame.load", "40 g")


def test_a_frame_without_sides_is_refused():
    with pytest.raises(ValidationError, match="width"):
        TwistedBeam.model_validate({"load_frame": {"width": "0 mm"}}, context=WRITTEN_BY_HAND)
