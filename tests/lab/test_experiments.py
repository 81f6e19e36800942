import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.experiments import RingDown, StaticStiffness
from lab.measures import dominant_mode, relative_error, tracking_error, tracking_rms
from lab.records import Channel, Record, channels


def stiffness_record(experiment, respond):
    """Record of an ideal tip whose wrench is ``respond(motion)``."""
    motion = np.array(
        [
            end * step / experiment.increments * np.eye(6)[dof]
            for dof, end in experiment.legs()
            for step in range(1, experiment.increments + 1)
        ]
    )
    leg = np.repeat(np.arange(len(experiment.legs())), experiment.increments)
    wrench = np.array([respond(row) for row in motion])
    dims = ("increment", "dof")
    found = channels(
        Channel("increment", "1", np.arange(len(motion)), ("increment",)),
        Channel("leg", "1", leg, ("increment",)),
        Channel("motion", "m, rad", motion, dims),
        Channel("wrench", "N, N*m", wrench, dims),
    )
    return Record("fea", "ideal", {}, {}, found)


def test_regression_gives_back_a_linear_tip():
    stiffness = np.zeros((6, 6))
    stiffness[1:4, 1:4] = [[5504.72, 28.19, -0.2], [10.79, 559.69, 0.73], [0.04, 0.66, 0.1]]
    experiment = StaticStiffness()
    found = experiment.reduce(stiffness_record(experiment, lambda x: stiffness @ x))
    assert [s.value for s in found.values()][:9] == pytest.approx(stiffness[1:4, 1:4].ravel())
    assert found["m_zx"].unit == "N/rad"
    assert found["p_xy"].value == pytest.approx(0.0, abs=1e-6)


def test_regression_finds_the_quadratic_axial_force():
    experiment = StaticStiffness()
    found = experiment.reduce(
        stiffness_record(experiment, lambda x: np.array([-7e5 * x[1] ** 2 - 3e5 * x[2] ** 2, 0, 0, 0, 0, 0]))
    )
    assert found["p_xy"].value == pytest.approx(-7e5)
    assert found["p_xz"].value == pytest.approx(-3e5)


@pytest.mark.parametrize("increments", [4, 5, 20])
def test_slope_of_a_hardening_tip_does_not_depend_on_the_increments(increments):
    """F = a x + c x^3 logged densely up to X: slope a + c int(x^4) / int(x^2) = a + 0.6 c X^2."""
    experiment = StaticStiffness(increments=increments)
    found = experiment.reduce(
        stiffness_record(experiment, lambda x: np.array([0, 0, 243 * x[2] + 1.5e7 * x[2] ** 3, 0, 0, 0]))
    )
    assert found["k_zz"].value == pytest.approx(243 + 0.6 * 1.5e7 * 0.005**2, rel=0.01)


@given(st.floats(5, 60), st.floats(0.01, 0.6), st.floats(-1, 1))
def test_main_mode_of_a_damped_oscillation(frequency, damping, slant):
    time = np.arange(91) / 360
    omega = 2 * np.pi * frequency
    signal = np.exp(-damping * omega * time) * np.cos(omega * np.sqrt(1 - damping**2) * time)
    found = dominant_mode(time, np.column_stack([signal, slant * signal]))
    assert found == pytest.approx((frequency * np.sqrt(1 - damping**2), damping), rel=1e-4)


def test_over_damped_motion_has_no_frequency():
    time = np.arange(91) / 360
    assert np.isnan(dominant_mode(time, np.exp(-40 * time)[:, None])).all()


def test_tracking_measures():
    reference = np.zeros((2, 3, 3))
    reference[0] = 1e-3
    assert tracking_rms(reference + np.array([3e-3, 4e-3, 0]), reference) == pytest.approx(5e-3)
    assert tracking_error(1.1 * reference, reference) == pytest.approx(0.1)
    assert relative_error(9.0, -10.0) == pytest.approx(1.9)
    assert np.isnan(relative_error(1.0, 0.0))


def test_ring_down_load_and_samples():
    experiment = RingDown(direction=np.pi / 2)
    assert experiment.load == pytest.approx((0.0, 0.0, 1.962))
    assert experiment.samples == 91
