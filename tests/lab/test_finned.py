"""The tube with fins, its experiments, and what refuses to be built or done."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from lab.experiments import Experiment, FinPush, PaddleThrust, ShapePropagation
from lab.experiments.fin_drive import FIN_STAGES
from lab.experiments.fin_push import first_peak
from lab.records import Channel, Record, channels
from lab.specimens import FinnedTube, Specimen
from lab.specimens.finned_tube import Chambers, LoadFin
from lab.units import WRITTEN_BY_HAND

DEG = np.pi / 180
DESIGNS = st.builds(
    lambda arc, angle: FinnedTube(fin_arc=arc * DEG, attachment_angle=angle * DEG),
    st.floats(35, 120),
    st.floats(35, 90),
)


def record(specimen, experiment, index, **values):
    dims = {"p": (index, "axis"), "tip": (index, "axis")}
    found = channels(*(Channel(name, "", np.asarray(v), dims.get(name, (index,))) for name, v in values.items()))
    return Record("fea", "made up", specimen.model_dump(), experiment.model_dump(), found)


def test_defaults_are_those_of_table_4_1():
    tube = FinnedTube()
    assert (tube.diameter, tube.length, tube.wall, tube.fin_thickness) == (0.050, 0.050, 0.0015, 0.002)
    assert np.rad2deg([tube.fin_arc, tube.attachment_angle]) == pytest.approx([65, 60])
    chambers = tube.chambers
    assert (chambers.number, chambers.width, chambers.height, chambers.length, chambers.wall) == (
        9, 0.005, 0.005, 0.014, 0.0004,
    )  # fmt: skip
    assert tube.material.youngs_modulus == 7.8e6
    assert (tube.place, tube.mid_radius) == (0.025, pytest.approx(0.02425))


@settings(deadline=None)
@given(DESIGNS)
def test_the_crease_of_the_middle_surfaces_is_plane(tube):
    """Points that lie on both middle cylinders, in the plane of e_y and (cos theta/2, 0, -sin theta/2)."""
    psi = np.linspace(-tube.fin_arc / 2, tube.fin_arc / 2, 21)
    half, radius = tube.attachment_angle / 2, tube.mid_radius
    # Where the fin's middle cylinder meets the tube's: equal radii, hence s = Rm cos(psi) tan(theta/2).
    crease = tube.fin_places(psi, radius * np.cos(psi) * np.tan(half))
    np.testing.assert_allclose(np.hypot(*crease.T[:2]), radius, rtol=1e-12)
    np.testing.assert_allclose(crease @ [np.sin(half), 0, np.cos(half)], tube.fin_centre[2] * np.cos(half), rtol=1e-12)
    np.testing.assert_allclose(crease[10], [radius, 0, tube.place], atol=1e-15)
    assert tube.root_middle == pytest.approx(crease[10])
    assert tube.crown_along == pytest.approx(radius * np.tan(half))


@settings(deadline=None)
@given(DESIGNS, st.floats(0, 1))
def test_the_root_lies_on_the_tubes_outside_and_on_the_fins_face(tube, depth):
    psi = np.linspace(-tube.fin_arc / 2, tube.fin_arc / 2, 15)
    root = tube.root(psi, tube.face_radius(depth))
    np.testing.assert_allclose(np.hypot(*root.T[:2]), tube.radius, atol=1e-14)
    assert (root[:, 0] > 0).all()
    arms = root - tube.fin_centre
    off = arms - np.outer(arms @ tube.fin_axis, tube.fin_axis)
    np.testing.assert_allclose(np.linalg.norm(off, axis=1), tube.face_radius(depth), rtol=1e-12)


def test_theta_is_the_angle_between_generators_and_axis_and_the_fin_is_concave_towards_z():
    tube = FinnedTube()
    assert np.rad2deg(np.arccos(tube.fin_axis[2])) == pytest.approx(60)
    assert tube.fin_axis @ tube.fin_normal == pytest.approx(0, abs=1e-15)
    crown, edge = tube.fin_places(np.array([0.0, tube.fin_arc / 2]), np.full(2, tube.tip_along))
    assert tube.tip_corner == pytest.approx(edge)
    assert edge[1] > 0
    # The edges stand on the concave side of the crown: nearer to the tube's axis and further along +z.
    assert (edge - crown) @ tube.fin_normal < 0
    assert edge[2] > crown[2]
    assert np.linalg.norm(crown - tube.root_middle) == pytest.approx(tube.fin_length)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"wall": "6 mm"}, r"wall 6 mm is too thick for diameter 50 mm"),
        ({"fin_thickness": "6 mm"}, r"fin_thickness 6 mm is too thick"),
        ({"attachment_angle": "15 deg"}, r"attachment_angle 15 deg must lie between 20 and 120 deg"),
        ({"attachment_angle": "121 deg"}, r"attachment_angle 121 deg must lie between"),
        ({"fin_arc": "160 deg"}, r"fin_arc 160 deg must lie between .* and 154\.4 deg, up to which both faces meet"),
        ({"fin_arc": "5 deg"}, r"fin_arc 5 deg must lie between 9\.45 deg, twice its thickness"),
        ({"fin_place": "2 mm"}, r"crease runs from z = .* must stay 3 mm within the tube of 50 mm: move fin_place"),
        ({"fin_place": "47 mm"}, r"crease runs from z = 46\.\d to 5\d\.\d mm"),
        ({"fin_length": "3 mm"}, r"fin_length 3 mm is shorter than its root needs: more than \d\.\d+ mm"),
        ({"chambers": {"number": 12}}, r"12 chambers on each side take \d+\.\d of the 180 deg"),
        ({"chambers": {"height": "15 mm"}}, r"chambers of height 15 mm leave too little"),
        ({"chambers": {"length": "51 mm"}}, r"chambers of length 51 mm are longer than the tube, 50 mm"),
        ({"chambers": {"wall": "2.5 mm"}}, r"a wall of 2\.5 mm leaves no cavity; needed: less than 2\.5 mm"),
        ({"load_fin": {"width": "0.1 mm"}}, r"fibreglass would be .* mm thick"),
        ({"diameter": "50"}, r"50' has the unit dimensionless"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(fields, why):
    with pytest.raises(ValidationError, match=why) as caught:
        FinnedTube.model_validate(fields, context=WRITTEN_BY_HAND)
    assert caught.value.error_count() == 1
    assert "\n" not in caught.value.errors()[0]["msg"]


def test_without_chambers_their_sizes_do_not_matter():
    assert FinnedTube(chambers=Chambers(number=0, length=0.06, height=0.02)).chambers.number == 0


def test_chambers_keep_their_gap_at_their_tops():
    tube = FinnedTube()
    chambers = tube.chambers
    angles = chambers.angles(tube.inner_radius)
    assert angles.mean() == pytest.approx(np.pi / 2)
    assert np.ptp(angles) + chambers.pitch(tube.inner_radius) < np.pi
    top = tube.inner_radius - chambers.height
    corners = [
        top * np.exp(1j * angles[number]) + 1j * side * chambers.width / 2 * np.exp(1j * angles[number])
        for number, side in ((0, 1), (1, -1))
    ]
    # The gap is an arc, its chord a little less.
    assert abs(corners[1] - corners[0]) == pytest.approx(chambers.gap, rel=1e-3)


def test_the_load_fin_gives_the_chord_of_the_reynolds_numbers():
    """Re = u c / nu with Re 2490 at 29.76 mm/s, and 1014 at 19.2 mm/s without it."""
    tube = FinnedTube(load_fin=LoadFin())
    assert tube.fin_length == pytest.approx(1014e-6 / 19.2e-3, rel=1e-3)
    assert tube.fin_length + tube.load_fin.length == pytest.approx(2490e-6 / 29.76e-3, rel=1e-3)
    assert tube.load_fin.sheet == pytest.approx(0.0008, rel=0.01)


def test_the_mesh_depends_on_geometry_alone_which_makes_the_specimen_again():
    tube = FinnedTube(fin_arc=1.0, load_fin=LoadFin())
    again = TypeAdapter(Specimen).validate_python({"kind": "FinnedTube", **tube.geometry()})
    assert again == tube.model_copy(update={"load_fin": None})
    assert "material" not in tube.geometry()


def test_experiments_read_units_and_go_through_json():
    written = {"kind": "ShapePropagation", "drive": "pressure", "pressure": "40 psi"}
    experiment = TypeAdapter(Experiment).validate_python(written, context=WRITTEN_BY_HAND)
    assert experiment.pressure == pytest.approx(275790.29, rel=1e-6)
    assert TypeAdapter(Experiment).validate_json(experiment.model_dump_json()) == experiment
    assert ShapePropagation().pinched_length(FinnedTube()) == 0.014
    assert ShapePropagation(pinch_length=0.02).pinched_length(FinnedTube()) == 0.02
    assert PaddleThrust().pressure == pytest.approx(60 / 40 * 275790.29, rel=1e-6)


def test_a_drive_says_why_it_cannot_be_done():
    tube, bare = FinnedTube(), FinnedTube(chambers=Chambers(number=0))
    assert ShapePropagation().misfit(tube) == ShapePropagation(drive="pressure").misfit(tube) == ""
    assert "needs chambers" in FinPush(drive="pressure").misfit(bare)
    assert "more than the inside of the tube has, 47 mm" in ShapePropagation(travel=0.047).misfit(tube)
    assert "exceeds the tube's length" in FinPush(pinch_length=0.06).misfit(tube)


def test_travel_of_p_is_reduced_in_its_plane_and_towards_it():
    travel = np.linspace(0.0, 0.033, 12)
    p = np.outer(travel / 0.033, [-0.012, -0.003, 0.005])
    experiment = ShapePropagation()
    found = experiment.reduce(
        record(
            FinnedTube(), experiment, "increment", travel=travel, force=20 * travel / 0.033, p=p, strain=travel,
            fin_radius=0.024 - travel / 4, fin_angle=np.pi / 3 - travel * 10,
        )
    )  # fmt: skip
    value = {name: scalar.value for name, scalar in found.items()}
    assert value["s"] == pytest.approx(0.013)
    assert value["y"] == pytest.approx(0.003)
    assert value["stroke"] == pytest.approx(0.33)
    assert value["transmission"] == pytest.approx(0.013 / 0.033)
    assert value["curvature_gain"] == pytest.approx(0.024 / (0.024 - 0.033 / 4))
    assert value["work"] == pytest.approx(20 * 0.033 / 2)
    assert value["force_max"] == 20


@pytest.mark.parametrize(
    ("force", "peak"),
    [([0, 1, 2, 1.995, 3, 2.9], 4), ([0, 1, 2, 3], -1), ([0, 2, 1, 5, 0], 1), ([0, 0, 0], -1), ([0, -1, -2], -1)],
)
def test_a_limit_is_a_peak_that_the_force_falls_from(force, peak):
    assert first_peak(np.array(force, dtype=float)) == peak


def test_a_push_that_buckles_and_one_that_does_not():
    way = np.linspace(0.0, 0.02, 41)
    stage = np.r_[0, np.full(9, FIN_STAGES.index("pinch")), np.full(41, FIN_STAGES.index("push"))]
    experiment = FinPush()
    lever = 0.85 * 0.0528

    def reduced(force):
        whole = record(
            FinnedTube(), experiment, "increment", stage=stage, push=np.r_[np.zeros(10), way],
            force=np.r_[np.full(10, 99.0), force],
        )  # fmt: skip
        return {name: scalar.value for name, scalar in experiment.reduce(whole).items()}

    buckled = reduced(np.minimum(100 * way, 1.0 - 20 * (way - 0.01)))
    assert buckled["limit_load"] == buckled["force_max"] == pytest.approx(1.0)
    assert buckled["push_at_limit"] == pytest.approx(0.01)
    assert buckled["stiffness_initial"] == pytest.approx(100)
    assert buckled["torque"] == pytest.approx(lever)
    assert buckled["torsional_stiffness"] == pytest.approx(100 * lever**2)
    rising = reduced(50 * way)
    assert np.isnan(rising["limit_load"])
    assert rising["force_max"] == pytest.approx(1.0)


def test_a_push_that_never_came_has_no_numbers():
    experiment = FinPush()
    whole = record(FinnedTube(), experiment, "increment", stage=np.zeros(1), push=np.zeros(1), force=np.zeros(1))
    assert all(np.isnan(scalar.value) for scalar in experiment.reduce(whole).values())


def test_thrust_is_averaged_over_whole_cycles_after_the_warm_up():
    experiment = PaddleThrust(frequency=2.0, cycles=3, warm_up=1, body="free", samples_per_cycle=100)
    time = experiment.times
    assert (len(time), time[-1]) == (experiment.samples, pytest.approx(1.5))
    turn = 2 * np.pi * 2.0 * time
    warm = np.where(time < 0.5 - 1e-9, 50.0, 0.0)
    power = experiment.power_stroke(time)
    assert power[:100].sum() == 50
    assert power[100]
    found = experiment.reduce(
        record(
            FinnedTube(), experiment, "time", time=time, thrust=0.2 + np.sin(turn) + warm, x1=turn, fin_angle=turn,
            buckling=-0.3 * np.sin(turn), tip_speed=np.where(power, 0.3, 0.1), input_force=turn,
            body=0.04 * time + warm, body_speed=np.full(len(time), 0.04),
        )
    )  # fmt: skip
    value = {name: scalar.value for name, scalar in found.items()}
    assert value["thrust_mean"] == pytest.approx(0.2)
    assert (value["thrust_max"], value["thrust_min"]) == (pytest.approx(1.2), pytest.approx(-0.8))
    assert (value["buckling_min"], value["buckling_max"]) == (pytest.approx(-0.3), pytest.approx(0.3))
    assert value["tip_speed_mean_power"] == pytest.approx(0.3)
    assert value["tip_speed_mean_recovery"] == pytest.approx(0.1)
    assert value["swim_speed"] == pytest.approx(0.04)


def test_a_held_body_has_no_speed_and_the_warm_up_leaves_a_cycle():
    assert PaddleThrust().body == "fixed"
    with pytest.raises(ValidationError, match="warm_up 4 leaves none of 4 cycles"):
        PaddleThrust(warm_up=4)
