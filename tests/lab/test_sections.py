import pytest

from lab.sections import torsion_constant


@pytest.mark.parametrize(("ratio", "coefficient"), [(1, 0.1406), (2, 0.229), (10, 0.312)])
def test_torsion_constant_of_the_tables(ratio, coefficient):
    """Timoshenko & Goodier, art. 109: width * thickness^3 times these."""
    assert torsion_constant(0.003 * ratio, 0.003) == pytest.approx(coefficient * ratio * 0.003**4, rel=3e-3)


def test_torsion_constant_of_a_square_and_of_a_thin_strip():
    assert torsion_constant(1.0, 1.0) == pytest.approx(0.140577, rel=1e-5)
    assert torsion_constant(100.0, 1.0) == pytest.approx(100 / 3 * (1 - 0.63025 / 100), rel=1e-7)


def test_sides_may_change_places():
    assert torsion_constant(0.003, 0.02) == pytest.approx(torsion_constant(0.02, 0.003), rel=1e-6)
