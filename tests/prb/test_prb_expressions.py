"""Numbers of declarations: quantities and formulas, and nothing else."""

import re

import numpy as np
import pytest

from lab.sections import torsion_constant
from prb.expressions import environment, gauss_node, gauss_weight, read


def value(text, unit="1", **names):
    return read(text, unit)(environment(names))


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("23.66 mm", "m", 0.02366),
        ("0.34 N*m/rad", "N*m/rad", 0.34),
        ("5 deg", "rad", np.deg2rad(5)),
        ("1e-3 s", "s", 1e-3),
        ("0", "m", 0.0),
        (0, "m", 0.0),
        (2, "1", 2.0),
        ("pi / 2", "rad", np.pi / 2),
        ("2 * a ** 2 - b / 4", "m", 2 * 9 - 0.5),
        ("a if b > 1 else -a", "m", 3.0),
        ("max(a, min(b, 5), abs(-7))", "m", 7.0),
        ("sqrt(cos(0) * 4) + sin(pi / 2)", "1", 3.0),
        ("7 // 2 + 7 % 4", "1", 6.0),
        ("torsion_constant(2 * b, b)", "m**4", torsion_constant(4.0, 2.0)),
    ],
)
def test_what_is_written_becomes_a_number(text, unit, expected):
    assert value(text, unit, a=3.0, b=2.0) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "fragment"),
    [
        ("0.34", "N*m/rad", "0.34 has no unit; write it like '0.34 N*m/rad'"),
        (-3, "m", "-3 has no unit; write it like '-3 m'"),
        ("5 mm", "rad", "'5 mm' has the unit millimeter; expected one like rad"),
        ("5 flurbs", "m", "cannot read '5 flurbs' as a quantity like '1 m', or as a formula"),
        ("1 +", "m", "cannot read '1 +' as a quantity like '1 m', or as a formula"),
        ("a ^ 2", "m", "write powers as 'a ** b'"),
        ("length.real", "m", "is neither a quantity like '1 mm' nor a formula"),
        ("[a]", "m", "is neither a quantity like '1 mm' nor a formula"),
        ("(lambda: 1)()", "1", "calls something unknown; there are sin, cos"),
        ("__import__('os')", "1", "calls something unknown; there are sin, cos"),
        ("min(a, b, key=a)", "1", "is neither a quantity like '1 mm' nor a formula"),
        ("'a' * 9", "1", "'a' is not a number"),
        ("9 ** 9 ** 9 ** 9", "1", "cannot be evaluated"),
        ("+".join(["a"] * 600), "1", "is longer than 1000 characters"),
    ],
)
def test_anything_else_is_refused_in_one_line(text, unit, fragment):
    with pytest.raises(ValueError, match=re.escape(fragment)) as error:
        read(text, unit)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("a / b", "'a / b' cannot be evaluated: float division by zero"),
        ("c + 1", "'c + 1': c is not a number here"),
        ("(0 - a) ** 0.5", "cannot be evaluated"),
        ("a * 1e308 * 1e308", "is inf, not a finite number"),
        ("sqrt(0 - a)", "cannot be evaluated"),
    ],
)
def test_a_formula_without_a_value_says_so(text, fragment):
    with pytest.raises(ValueError, match=re.escape(fragment)):
        value(text, a=1.0, b=0.0)


def test_gauss_nodes_and_weights_integrate_polynomials_exactly():
    nodes, weights = (np.array([f(i, 3) for i in range(3)]) for f in (gauss_node, gauss_weight))
    for power in range(6):
        assert weights @ nodes**power == pytest.approx(1 / (power + 1), rel=1e-14)
    assert [gauss_node(-1, 3), gauss_node(3, 3)] == [0.0, 1.0]
