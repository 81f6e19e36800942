"""Materials as data: refusals, coefficients of rubber, and data files that say where every figure comes from."""

import pytest
from pydantic import ValidationError

from lab.materials import Material, PronyBranch, material, materials, sheet
from lab.published import figures
from lab.specimens import TwistedBeam
from lab.units import WRITTEN_BY_HAND, to_si


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"youngs_modulus": 0.0}, "greater than 0"),
        ({"youngs_modulus": float("nan")}, "finite"),
        ({"poisson_ratio": 0.5}, "less than 0.5"),
        ({"poisson_ratio": -1.0}, "greater than -1"),
        ({"density": -1.0}, "greater than 0"),
        ({"law": "hooke"}, "'saint-venant-kirchhoff', 'neo-hookean'"),
        ({"law": "mooney-rivlin", "c01_share": 1.2}, "less than or equal to 1"),
        ({"law": "neo-hookean", "c01_share": 0.2}, "c01_share belongs to the law mooney-rivlin, not to neo-hookean"),
        ({"law": "mooney-rivlin", "c30_ratio": 0.2}, "c30_ratio belongs to the law yeoh"),
        ({"law": "yeoh", "c20_ratio": -0.3}, "loses its shear stiffness at a shear of 0.745; needed: positive up to 3"),
        ({"law": "yeoh", "c20_ratio": 0.1, "c30_ratio": -0.1}, "loses its shear stiffness at a shear of 1.0"),
        ({"prony": [{"ratio": 0.0, "time": 1.0}]}, "prony.0.ratio\n.*greater than 0"),
        ({"prony": [{"ratio": 1.0, "time": 0.0}]}, "prony.0.time\n.*greater than 0"),
    ],
)
def test_bad_parameters_are_refused(bad, words):
    with pytest.raises(ValidationError, match=words):
        Material(**bad)


def test_yeoh_laws_that_stiffen_again_are_allowed():
    assert Material(law="yeoh", c20_ratio=-0.1, c30_ratio=0.01).law == "yeoh"
    assert Material(law="yeoh", c20_ratio=0.02, c30_ratio=-1e-5).law == "yeoh"


def test_published_coefficients():
    rubber = Material.from_coefficients(0.4e6, c01=0.1e6, bulk_modulus=500e6, density=950.0)
    assert (rubber.law, rubber.c01_share, rubber.density) == ("mooney-rivlin", pytest.approx(0.2), 950.0)
    assert rubber.shear_modulus == pytest.approx(1e6)
    assert rubber.bulk_modulus == pytest.approx(500e6)
    yeoh = Material.from_coefficients(0.5e6, c20=-0.01e6, c30=2e3, poisson_ratio=0.499)
    assert (yeoh.law, yeoh.c20_ratio, yeoh.c30_ratio) == ("yeoh", pytest.approx(-0.02), pytest.approx(0.004))
    assert yeoh.youngs_modulus == pytest.approx(2 * 1e6 * 1.499)


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        ({"c10": -1.0, "c01": 0.5, "poisson_ratio": 0.4}, "no positive shear stiffness"),
        ({"c10": 1.0}, "either poisson_ratio or bulk_modulus"),
        ({"c10": 1.0, "bulk_modulus": -1.0}, "bulk_modulus -1 Pa must be positive"),
        ({"c10": 1.0, "c01": 1.0, "c20": 1.0, "poisson_ratio": 0.4}, "give one law's"),
        ({"c10": float("nan"), "poisson_ratio": 0.4}, "no positive shear stiffness"),
    ],
)
def test_bad_coefficients_are_refused(coefficients, words):
    with pytest.raises(ValueError, match=words):
        Material.from_coefficients(**coefficients)


def test_materials_with_branches_are_hashable():
    branch = {"ratio": 0.3, "time": "20 ms"}
    slow = Material.model_validate({"prony": [branch]}, context=WRITTEN_BY_HAND)
    assert slow.prony == (PronyBranch(ratio=0.3, time=0.02),)
    assert hash(slow) != hash(Material())


def test_every_field_of_a_data_file_has_its_source():
    assert materials() == ("latex", "nylon", "pet", "tpe-92a", "tpu-95a")
    for name in materials():
        found = sheet(name)
        assert material(name).law in ("saint-venant-kirchhoff", "nearly-incompressible-neo-hookean")
        assert set(found.written) == set(found.sources)
        # Every figure of the model is there or is the neutral one, and every assumption gives its reason.
        neutral = {"c01_share", "c20_ratio", "c30_ratio", "prony"}
        assert set(Material.model_fields) == set(found.written) | neutral
        assert all(len(text) > len("ASSUMED: ") + 8 for text in found.sources.values())
        assert found.title


def test_sources_name_published_figures_with_the_same_value():
    compared = 0
    for name in materials():
        for field, identity in sheet(name).figures.items():
            figure = figures()[identity]
            assert "ASSUMED" not in sheet(name).sources[field].split(";")[0]
            if field == "youngs_modulus" and figure["unit"] == "Shore A":
                gent = 0.0981 * (56 + 7.66 * figure["value"]) / (0.137505 * (254 - 2.54 * figure["value"]))
                assert material(name).youngs_modulus == pytest.approx(gent * 1e6, rel=5e-3)
            else:
                assert to_si(sheet(name).written[field], figure["unit"]) == figure["value"]
            compared += 1
    assert compared == 5


def test_what_is_nowhere_published_is_marked():
    for name in materials():
        assert "poisson_ratio" in sheet(name).assumptions
        assert "viscous_time" in sheet(name).assumptions
    assert set(sheet("nylon").assumptions) == set(sheet("nylon").written)
    assert "density" not in sheet("tpu-95a").assumptions


def test_defaults_are_the_data_file_of_tpu():
    assert material("tpu-95a") == Material()


def test_a_specimen_takes_a_material_by_name():
    beam = TwistedBeam.model_validate({"material": "tpe-92a"}, context=WRITTEN_BY_HAND)
    assert beam.material == material("tpe-92a")
    assert TwistedBeam.model_validate(beam.model_dump()) == beam


def test_an_unknown_material_is_named():
    with pytest.raises(ValidationError, match="no material 'gold'; there are latex, nylon, pet, tpe-92a, tpu-95a"):
        TwistedBeam(material="gold")
