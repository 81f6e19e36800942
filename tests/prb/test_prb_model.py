"""The study's side of the performer: parameters with units, bounds, and light imports."""

import json
import subprocess
import sys

import numpy as np
import pytest
from pydantic import ValidationError

import prb
from lab.experiments import RingDown
from lab.materials import Material
from lab.specimens import PinchedTube, TwistedBeam
from lab.units import WRITTEN_BY_HAND
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain
from prb.topologies import TOPOLOGIES

OF_A_BEAM = [name for name, declared in TOPOLOGIES.items() if declared.specimen == "TwistedBeam"]
OF_A_TUBE = [name for name, declared in TOPOLOGIES.items() if declared.specimen == "PinchedTube"]


def lines(error: ValidationError) -> list[str]:
    return [fault["msg"].removeprefix("Value error, ") for fault in error.errors()]


def written(topology: str, **parameters: object) -> PrbModel:
    data = {"kind": "prb", "topology": topology, "parameters": parameters}
    return PrbModel.model_validate(data, context=WRITTEN_BY_HAND)


def test_text_with_units_becomes_si():
    model = written("five-hinge", k="340 N*mm/rad", l2="23.66 mm")
    assert model.parameters == pytest.approx({"k": 0.340, "l2": 0.02366})


def test_python_callers_pass_si():
    assert PrbModel(topology="gauss-chain", parameters={"E": 65e6}).parameters == {"E": 65e6}


@pytest.mark.parametrize(
    ("parameters", "fragment"),
    [
        ({"k": 0.34}, "parameter k: 0.34 has no unit; write it like '0.34 N*m/rad'"),
        ({"k": "5 mm"}, "parameter k: '5 mm' has the unit millimeter; expected one like N*m/rad"),
        ({"stiffness": "1 N*m/rad"}, "topology five-hinge has no parameter 'stiffness'; it has k, b, l2"),
        ({"k": "50 N*m/rad"}, "parameter k = 50 N*m/rad is out of bounds; allowed: 0.02 N*m/rad to 5 N*m/rad"),
    ],
)
def test_wrong_parameters_are_refused_in_one_line(parameters, fragment):
    with pytest.raises(ValidationError) as error:
        written("five-hinge", **parameters)
    assert lines(error.value) == [fragment]


def test_bounds_that_depend_on_the_specimen_are_checked_with_it():
    model = written("five-hinge", l2="30 mm")
    assert model.values(TwistedBeam())["l2"] == pytest.approx(0.030)
    with pytest.raises(ValueError, match=r"parameter l2 = 30 mm is out of bounds; allowed: 0.6 mm to 29.4 mm"):
        model.values(TwistedBeam(length=0.030))


def test_an_unknown_topology_is_named():
    with pytest.raises(ValidationError, match="there is no topology 'six-hinge'; there are .*five-hinge-anisotropic"):
        written("six-hinge", k="1 N*m/rad")


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_a_model_survives_being_written_down(name):
    model = PrbModel(topology=name)
    document = json.loads(json.dumps(model.model_dump(mode="json")))
    again = PrbModel.model_validate(document)
    assert again == model
    assert again.model_dump(mode="json") == document


def test_settings_change_the_structure():
    model = PrbModel.model_validate({"topology": "gauss-chain", "settings": {"stations": 4}})
    assert len(model.mechanism(TwistedBeam()).hinges) == 16
    assert PrbModel.model_validate(model.model_dump(mode="json")).topology.chosen == {"stations": 4}


@pytest.mark.parametrize(
    ("settings", "fragment"),
    [
        ({"stations": 0}, "settings of gauss-chain: settings.stations: 0 is out of bounds; allowed: 1 to 40"),
        ({"segments": 3}, "gauss-chain has no setting 'segments'; it has stations"),
    ],
)
def test_wrong_settings_are_refused_in_one_line(settings, fragment):
    with pytest.raises(ValidationError) as error:
        PrbModel.model_validate({"topology": "gauss-chain", "settings": settings})
    assert lines(error.value) == [fragment]


def test_a_file_beside_the_study_is_a_topology(tmp_path):
    (tmp_path / "mine.yaml").write_text(json.dumps(TOPOLOGIES["five-hinge"].model_dump(mode="json") | {"name": "mine"}))
    model = PrbModel.model_validate({"topology": "mine.yaml"}, context={"beside": tmp_path})
    assert model.topology.name == "mine"
    assert prb.perform(TwistedBeam(), RingDown(duration=0.05), model).how["topology"] == "mine"
    with pytest.raises(ValidationError, match="there is no file .*yours.yaml"):
        PrbModel.model_validate({"topology": "yours.yaml"}, context={"beside": tmp_path})


def test_the_schema_lets_text_in():
    values = PrbModel.model_json_schema()["properties"]["parameters"]["additionalProperties"]
    assert {option["type"] for option in values["anyOf"]} == {"number", "string"}


def test_the_model_loads_no_simulator():
    code = "import sys, prb, prb.model, calibrate.spec; assert 'mujoco' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", OF_A_BEAM)
def test_nominal_values_respect_their_bounds(name):
    # Chains get more hinges on shorter beams, and none of the formulas may leave its bounds there.
    for parameter in TOPOLOGIES[name].declare(TwistedBeam(length=0.03, width=0.01, thickness=0.001, twist=-0.5)):
        assert parameter.lower < parameter.nominal < parameter.upper


@pytest.mark.parametrize("name", OF_A_TUBE)
def test_a_tube_s_halves_make_up_the_tube(name):
    tube = PinchedTube(size="pet")
    model = PrbModel(topology=name)
    for parameter in model.topology.declare(tube):
        assert parameter.lower <= parameter.nominal < parameter.upper
    mechanism = model.mechanism(tube)
    wall = np.pi * (tube.radius**2 - (tube.radius - tube.wall) ** 2) * tube.length
    assert sum(link.mass for link in mechanism.links) == pytest.approx(tube.material.density * wall)
    assert Chain(compile_mechanism(mechanism)).at_rest.position == pytest.approx([0, 0, tube.length], abs=1e-12)
    with pytest.raises(ValueError, match=f"topology {name} is declared for a PinchedTube, not for a TwistedBeam"):
        model.values(TwistedBeam())


@pytest.mark.parametrize("name", OF_A_BEAM)
def test_links_add_up_to_the_specimen(name):
    specimen = TwistedBeam(mass=0.00517, tip_mass=0.002)
    mechanism = PrbModel(topology=name).mechanism(specimen)
    assert sum(link.mass for link in mechanism.links) == pytest.approx(0.00517)
    assert Chain(compile_mechanism(mechanism)).at_rest.position == pytest.approx([specimen.length, 0, 0])
    assert mechanism.tip_mass == 0.002
    for hinge in mechanism.hinges:
        assert np.linalg.norm(hinge.axis) == pytest.approx(1.0)


def test_the_published_model_is_reading_a():
    specimen = TwistedBeam(root_angle=0.2, twist=1.0)
    mechanism = PrbModel(topology="five-hinge").mechanism(specimen)
    assert [h.name for h in mechanism.hinges] == ["R1", "R4", "R2", "R5", "R3"]
    angles = {h.name: np.arctan2(h.axis[2], h.axis[1]) for h in mechanism.hinges if h.axis[0] == 0}
    assert angles == pytest.approx({"R1": 0.2, "R2": 0.7, "R3": 1.2})
    assert [link.length for link in mechanism.links] == pytest.approx([0.02366, 0.02634])
    assert {h.stiffness for h in mechanism.hinges} == {0.340}


def test_the_anisotropic_model_contains_the_published_one():
    specimen = TwistedBeam()
    one, other = (PrbModel(topology=t).mechanism(specimen) for t in ("five-hinge", "five-hinge-anisotropic"))
    for a, b in zip(one.hinges, other.hinges, strict=True):
        assert (a.stiffness, a.damping, *a.axis) == pytest.approx((b.stiffness, b.damping, *b.axis))


def test_only_slides_are_locked_in_motion():
    chain = PrbModel(topology="gauss-chain").mechanism(TwistedBeam())
    assert len(chain.hinges) == 12
    assert all(h.kind == "rotation" for h in chain.in_motion.hinges)
    assert len(chain.in_motion.hinges) == 9


def test_pre_twist_stiffens_in_torsion():
    # Prototype figures for E = 65 MPa: n_xx = 0.072, 0.110, 0.226 N*m/rad at 0, 45, 90 deg.
    material = Material(youngs_modulus=65e6)
    beams = [TwistedBeam(twist=np.deg2rad(phi), material=material) for phi in (0, 45, 90)]
    stiffness = [TOPOLOGIES["gauss-chain"].values(beam, {})["GJ"] / beam.length for beam in beams]
    assert stiffness == pytest.approx([0.072, 0.110, 0.226], rel=0.04)
