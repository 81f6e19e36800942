"""Declarations: what they build, and how a wrong one is refused."""

import copy
import re

import numpy as np
import pytest

from lab.specimens import TwistedBeam
from prb.declaration import checked, read_declaration
from prb.mechanism import CLAMP, Branch, Knee
from prb.topologies import TOPOLOGIES

BEAM = TwistedBeam()
GOOD = {
    "name": "two",
    "settings": {"rows": {"value": 2}},
    "parameters": {
        "k": {"unit": "N*m/rad", "nominal": "0.3 N*m/rad", "lower": "0.1 N*m/rad", "upper": "10 * nominal"},
        "share": {"unit": "1", "nominal": 0.5, "lower": 0.1, "upper": 0.9},
    },
    "define": {"first": "share * length", "rest": "length - first"},
    "bodies": [
        {
            "name": "near",
            "shape": {"length": "first", "width": "width", "thickness": "3 mm", "angle": "root_angle"},
            "mass": "beam_mass * share",
            "joints": [{"name": "root", "axis": [0, 1, 0], "spring": "k", "damper": "1e-3 * k"}],
        },
        {
            "name": "far",
            "shape": {"length": "rest", "width": "width", "thickness": "thickness"},
            "mass": "beam_mass * (1 - share)",
            "joints": [{"name": "middle", "axis": [0, 2, 2], "spring": "k", "damper": "1e-3 * k"}],
        },
    ],
}


def altered(change) -> dict:
    document = copy.deepcopy(GOOD)
    change(document)
    return document


def body(**changes) -> dict:
    """The good document with its second body changed."""
    return altered(lambda d: d["bodies"][1].update(changes))


def joint(**changes) -> dict:
    """The good document with the joint of its second body changed."""
    return altered(lambda d: d["bodies"][1]["joints"][0].update(changes))


def build(document: dict, **values: float):
    declared = checked(document, "test")
    return declared.build(BEAM, declared.values(BEAM, values))


def test_numbers_come_from_parameters_specimen_and_definitions():
    mechanism = build(GOOD, share=0.4, k=0.7)
    near, far = mechanism.links
    assert (near.length, far.length, near.thickness) == pytest.approx((0.02, 0.03, 0.003))
    assert (near.mass, far.mass) == pytest.approx((0.4 * BEAM.beam_mass, 0.6 * BEAM.beam_mass))
    assert mechanism.hinges[1].axis == pytest.approx((0, np.sqrt(0.5), np.sqrt(0.5)))
    assert (mechanism.hinges[0].stiffness, mechanism.hinges[0].damping) == pytest.approx((0.7, 0.7e-3))


def test_springs_dampers_and_branches_in_full():
    springs = {
        "stiffness": "k",
        "rest": "5 deg",
        "above": {"at": "0.1 rad", "stiffness": "k / 4"},
        "below": {"at": 0, "stiffness": "2 * k"},
    }
    branches = [{"stiffness": "k / 2", "time": "20 ms"}]
    hinge = build(joint(spring=springs, damper=["1e-3 * k", "1e-4 * k", 0], branches=branches)).hinges[1]
    assert hinge.rest == pytest.approx(np.deg2rad(5))
    assert (hinge.above, hinge.below) == (Knee(0.1, 0.075), Knee(0.0, 0.6))
    assert hinge.higher_damping == pytest.approx((3e-5, 0))
    assert hinge.branches == (Branch(0.15, 0.02),)
    assert build(joint(spring={"polynomial": ["k", 0, "2 * k"]})).hinges[1].higher == pytest.approx((0, 0.6))


def test_branches_of_the_tree_are_put_in_the_simulator_s_order():
    def grow(document):
        shape = GOOD["bodies"][1]["shape"]
        document["bodies"] += [
            {"name": "rib{i}", "repeat": {"i": "rows"}, "parent": "near", "shape": shape, "mass": "1 g"},
            {"name": "end", "parent": "far", "shape": shape, "mass": "1 g", "rotation": [0, 0, "90 deg"]},
            {"name": "free", "parent": "clamp", "shape": shape, "mass": "1 g", "place": [0, "5 mm", 0]},
        ]
        document["tip"] = {"body": "far", "place": ["rest / 2", 0, 0]}

    mechanism = build(altered(grow))
    assert [link.name for link in mechanism.links] == ["near", "far", "end", "rib0", "rib1", "free"]
    assert [link.parent for link in mechanism.links] == [CLAMP, 0, 1, 0, 0, CLAMP]
    assert mechanism.place(4) == pytest.approx((0.025, 0, 0))
    assert mechanism.tip == (1, pytest.approx((0.0125, 0, 0)))
    fewer = checked(altered(grow), "test").with_settings({"rows": 1})
    assert len(fewer.build(BEAM, fewer.values(BEAM, {})).links) == 5


def test_a_weight_may_hang_on_a_body_of_its_own():
    heavy = TwistedBeam(tip_mass=0.1)
    for carries, expected in ((True, 0.1), (False, 0.0)):
        declared = checked(altered(lambda d, c=carries: d.update(tip={"carries": c})), "test")
        assert declared.build(heavy, declared.values(heavy, {})).tip_mass == expected


def parameter(**changes) -> dict:
    return altered(lambda d: d["parameters"]["k"].update(changes))


def without_unit(document) -> None:
    del document["parameters"]["k"]["unit"]


@pytest.mark.parametrize(
    ("document", "fragment"),
    [
        (
            body(mass="beam_mass * shares"),
            "bodies.far.mass: unknown name 'shares' in 'beam_mass * shares'; there are area",
        ),
        (altered(without_unit), "parameters.k: it has no unit; write one like 'unit: N*m/rad'"),
        (parameter(unit="N*mm/rad"), "'N*mm/rad' is not made of SI units (mm); put it in 'shown_in'"),
        (
            parameter(nominal="20 N*m/rad", upper="10 N*m/rad"),
            "nominal 20 N*m/rad is out of its bounds, 0.1 N*m/rad to",
        ),
        (parameter(nominal="0.3"), "parameters.k: 0.3 has no unit; write it like '0.3 N*m/rad'"),
        (parameter(lower="1 N*m/rad", upper="0.5 N*m/rad"), "lower 1 N*m/rad is not below upper 0.5 N*m/rad"),
        (parameter(nominal="share"), "parameters.k.nominal: unknown name 'share'"),
        (body(parent="middle"), "body far: its parent 'middle' does not exist before it; there are clamp, near"),
        (body(name="near"), "two bodies are named 'near'; put the index in braces"),
        (joint(name="root"), "two joints are named 'root'"),
        (joint(axis=[0, 0, 0]), "body far: joint middle: its axis has no direction"),
        (
            joint(spring="3 N/m"),
            "bodies.far.joints.middle.spring: '3 N/m' has the unit newton / meter; expected one like",
        ),
        (joint(spring={"polynomial": ["k", 0, 0], "stiffness": "k"}), "a polynomial spring has neither"),
        (joint(spring={"stiffness": "k", "above": {"at": "-1 deg", "stiffness": "k"}}), "'above' begins at -0.0174533"),
        (joint(friction="-1 N*m"), "joint middle: its friction is negative, -1"),
        (joint(friction="1 N"), "bodies.far.joints.middle.friction: '1 N' has the unit newton; expected one like N*m"),
        (joint(kind="ball"), "Input should be 'rotation' or 'slide'"),
        (joint(stiffness="k"), "Extra inputs are not permitted"),
        (body(mass="beam_mass - 1 "), "body far: mass -0.99637 kg must be positive"),
        (altered(lambda d: d["define"].update(width="length")), "define: the name 'width' is taken; it is a number of"),
        (altered(lambda d: d["define"].update({"a b": "length"})), "define: 'a b' is not a name"),
        (
            altered(lambda d: d.update(specimen="Tube")),
            "no specimen 'Tube'; there are FinnedTube, PinchedTube, TwistedBeam",
        ),
        (altered(lambda d: d.update(tip={"body": "end"})), "tip: there is no body 'end'; there are near, far"),
        (altered(lambda d: d.update(bodies=[])), "at least 1 item"),
        (altered(lambda d: d["settings"]["rows"].update(value=0)), "0 is out of bounds; allowed: 1 to 100"),
    ],
)
def test_wrong_declarations_are_refused_in_one_line(document, fragment):
    with pytest.raises(ValueError, match=re.escape(fragment)) as error:
        build(document)
    assert "\n" not in str(error.value)


def test_bounds_that_a_specimen_breaks_are_named():
    declared = checked(parameter(nominal="0.3 * length / 0.05", upper="1 N*m/rad"), "test")
    with pytest.raises(ValueError, match="parameter k: nominal 1.2 N.m/rad is out of its bounds, .* for this specimen"):
        declared.values(TwistedBeam(length=0.2), {})


def test_a_file_that_is_not_yaml_is_named(tmp_path):
    (tmp_path / "bad.yaml").write_text("name: [")
    with pytest.raises(ValueError, match="bad.yaml is not YAML"):
        read_declaration(tmp_path / "bad.yaml")


@pytest.mark.parametrize(("name", "hinges"), [("hinge-chain", 3), ("hinge-chain-anisotropic", 3)])
@pytest.mark.parametrize("segments", [1, 2, 7])
def test_segments_make_hinges(name, hinges, segments):
    declared = TOPOLOGIES[name].with_settings({"segments": segments})
    mechanism = declared.build(BEAM, declared.values(BEAM, {}))
    assert len(mechanism.hinges) == hinges * segments
    assert sum(link.length for link in mechanism.links) == pytest.approx(BEAM.length)


def test_many_anisotropic_segments_are_a_continuum():
    # Tip compliance of a straight cantilever: L^3 / (3 E I), reached from below as 1 - 1 / (4 N^2).
    from prb.mujoco_model import compile_mechanism
    from prb.statics import Chain, tip_compliance

    beam = TwistedBeam(twist=0.0)
    declared = TOPOLOGIES["hinge-chain-anisotropic"].with_settings({"segments": 10})
    values = declared.values(beam, {})
    compliance, _ = tip_compliance(Chain(compile_mechanism(declared.build(beam, values))))
    for axis, rigidity in ((1, values["edge"]), (2, values["flat"])):
        assert compliance[axis, axis] == pytest.approx(beam.length**3 / (3 * rigidity) * (1 - 1 / 400), rel=1e-9)
