import pytest

from lab.formulas import FORMULAS
from lab.published import figures


@pytest.mark.parametrize(
    ("name", "value"),
    [
        # 3 E I / L^3 = 3604 N/m in series with G A / 2 / L = 6761 N/m
        ("printed_tube_stiffness", 1 / (1 / 3604 + 1 / 6761)),
        ("hinge_stiffness_ratio", 12.19),
        ("speed_in_body_lengths", 1.06),
        ("solid_mass", 3.63e-3),
        ("fin_pinch_increment", 0.165e-3),
        ("foot_gap", 5.5e-3),
        ("links_length", 50e-3),
        ("last_link", 26.34e-3),
        ("segment_twist", 45),
        ("plate_speed_for_peak_thrust", 0.557),
        ("pinch_slope", 0.75),
        ("tendon_spacing", 60),
        ("pinch_spacing", (90, 60)),
        ("reynolds_load_fin", (2024, 2490)),
        ("reynolds_tpe_fin", (855, 1014)),
        ("plate_resultant", (0.5, 0.8660, 1)),
        ("plate_along_flow", (0.25, 0.75, 1)),
        ("plate_across_flow", (0.4330, 0.4330, 0)),
    ],
)
def test_formulas_by_hand(name, value):
    assert FORMULAS[name]() == pytest.approx(value, rel=1e-3, abs=1e-12)


def test_beam_theory_without_shear_is_an_upper_bound():
    """12 E I / l^3 of the text's beam is 4992 and 112.3 N/m; the slender axis loses hardly anything to shear."""
    assert 3000 < FORMULAS["guided_strong_axis"]() < 4992 * 0.7
    assert FORMULAS["guided_weak_axis"]() == pytest.approx(112.3, rel=0.02)


def test_torsion_of_a_strip():
    """G b t^3 / 3 (1 - 0.63 t / b) / l: an independent form of the same constant."""
    constant = 20e-3 * 3e-3**3 / 3 * (1 - 0.63 * 0.15)
    assert FORMULAS["torsion"]() == pytest.approx(26e6 / 2.9 * constant / 50e-3, rel=1e-3)


def test_formulas_follow_the_published_figures(monkeypatch):
    changed = {**figures(), "c5-density": {**figures()["c5-density"], "value": 2420.0}}
    monkeypatch.setattr("lab.formulas.figures", lambda: changed)
    assert FORMULAS["solid_mass"]() == pytest.approx(2 * 3.63e-3)
