"""The worked examples of docs/fea.md run, and say what mechanics says."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_ring_between_plates():
    result = runpy.run_path(str(EXAMPLES / "ring_between_plates.py"))
    assert result["run"].completed
    travel, force = result["travel"], result["force"]
    # Thin inextensible ring under two opposite forces: travel / R = 0.1488 F R^2 / EI at first.
    stiffness = 26e6 * 0.010 * 0.0015**3 / 12 / 0.025**3 / 0.1488
    assert force[1] / (1e-3 * travel[1]) == pytest.approx(stiffness, rel=0.05)
    assert (force[1:] > force[:-1]).all()
    assert result["penetration"] < 0.01


def test_bracket_with_hole():
    result = runpy.run_path(str(EXAMPLES / "bracket_with_hole.py"))
    assert result["hung"].completed
    volume = result["bracket"].volumes.sum()
    assert volume == pytest.approx((60 * 20 - 3.1416 * 25) * 6e-9, rel=1e-3)
    assert result["held"] == pytest.approx((0.1 + volume * result["rubber"].density) * 9.81, rel=1e-6)
    assert 4.0 < result["ringing"][0] < 8.0
