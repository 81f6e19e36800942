import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from lab.materials import Material
from lab.specimens import TwistedBeam
from lab.units import WRITTEN_BY_HAND, Quantity, from_si, to_si


def test_text_with_a_unit_becomes_si():
    beam = TwistedBeam.model_validate({"length": "5 cm", "twist": "-90 deg", "mass": "5.17 g"}, context=WRITTEN_BY_HAND)
    assert beam.length == pytest.approx(0.05)
    assert beam.twist == pytest.approx(-math.pi / 2)
    assert beam.mass == pytest.approx(5.17e-3)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("length", 50, "50 has no unit"),
        ("width", "3 kg", "'3 kg' has the unit kilogram; expected one like m"),
        ("width", "3 furlongs per", "cannot read '3 furlongs per'"),
        ("thickness", "-3 mm", "greater than 0"),
        ("thickness", "30 mm", "exceeds width"),
        ("length", "nan mm", "not a finite number"),
        ("twist", "1000 deg", "less than or equal to"),
        ("lenght", "50 mm", "Extra inputs"),
    ],
)
def test_wrong_input_is_refused_in_words(field, value, words):
    with pytest.raises(ValidationError) as caught:
        TwistedBeam.model_validate({field: value}, context=WRITTEN_BY_HAND)
    assert words in str(caught.value)


def test_specimens_are_immutable_and_hashable():
    beam = TwistedBeam()
    assert hash(beam) == hash(TwistedBeam())
    with pytest.raises(ValidationError):
        beam.length = 0.1


@given(st.floats(1e-6, 1e6))
def test_units_round_trip(value):
    assert to_si(f"{from_si(value, 'Pa', 'MPa')!r} MPa", "Pa") == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "shown_in"),
    [("m", "mm"), ("rad", "deg"), ("Pa", "MPa"), ("N/m", "N/mm"), ("kg/m^3", "kg/m^3"), ("N*m/rad", "N*mm/deg"),
     ("m/s", "km/hour")],
)  # fmt: skip
def test_si_is_shown_as_pint_shows_it(unit, shown_in):
    import pint

    expected = pint.UnitRegistry().Quantity(0.7, unit).to(shown_in).magnitude
    for _ in range(2):  # the second one by what is kept of the first
        assert from_si(0.7, unit, shown_in) == pytest.approx(expected, rel=1e-15)


def test_a_value_is_not_shown_in_another_dimension():
    with pytest.raises(Exception, match="Cannot convert"):
        from_si(1.0, "m", "kg")


def test_quantities_are_shown_in_the_usual_unit():
    assert Quantity("rad", "deg").show(math.pi / 4) == "45 deg"


def test_mass_wins_over_density():
    assert TwistedBeam().beam_mass == pytest.approx(3.63e-3)
    assert TwistedBeam(mass=5.17e-3).effective_density == pytest.approx(1723.33, rel=1e-5)


def test_lame_constants_give_back_the_modulus():
    m = Material()
    assert m.shear_modulus * (3 * m.lame_lambda + 2 * m.shear_modulus) / (
        m.lame_lambda + m.shear_modulus
    ) == pytest.approx(m.youngs_modulus)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("23.66 mm", "m"), ("0.1 ms", "s"), ("5.17 g", "kg"), ("-45 deg", "rad"), ("26 MPa", "Pa"), ("3 N/mm", "N/m"),
     ("0.34 N*m/rad", "N*m/rad"), ("1e-3 m", "m")],
)  # fmt: skip
def test_common_units_are_read_as_pint_reads_them(text, unit):
    import pint

    expected = pint.UnitRegistry().Quantity(text).to(unit).magnitude
    assert to_si(text, unit) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("text", ["nan m", "inf m", "1_0 m m"])
def test_no_short_cut_lets_nonsense_through(text):
    with pytest.raises(ValueError, match="is not a finite number|cannot read|has the unit"):
        to_si(text, "m")
