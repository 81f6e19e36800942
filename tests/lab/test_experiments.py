import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from lab.experiments import BaseShake, Experiment, RingDown, StaticStiffness
from lab.experiments.shaking import SmoothShake
from lab.measures import dominant_mode, relative_error, tracking_error, tracking_rms
from lab.orbits import LINE
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


def test_load_and_own_weight_turn_about_x_from_y():
    experiment = RingDown(direction=np.pi, own_weight=np.pi / 2, load_place=(0.0, 0.008, 0.0))
    assert experiment.load == pytest.approx((0.0, -1.962, 0.0))
    assert experiment.own_gravity == pytest.approx((0.0, 0.0, 9.81))
    assert RingDown().own_gravity is None


def test_the_weight_hangs_from_the_tip_face():
    with pytest.raises(ValidationError, match="its x must be 0, not 0.01 m"):
        RingDown(load_place=(0.01, 0.0, 0.0))


def test_an_experiment_is_known_by_its_kind():
    read = TypeAdapter(Experiment).validate_python({"kind": "BaseShake", "frequency": 9.0})
    assert read == BaseShake(frequency=9.0)


def orbit(experiment, major, minor, tilt, phase=0.3, harmonics=0.0):
    """Record of a tip on an ellipse with these semi-axes, m; ``minor`` > 0 turns right-handed about +x."""
    angle = 2 * np.pi * experiment.frequency * experiment.times + phase
    along, across = major * np.cos(angle), minor * np.sin(angle)
    path = np.stack(
        [0 * angle, np.cos(tilt) * along - np.sin(tilt) * across, np.sin(tilt) * along + np.cos(tilt) * across]
    )
    path += np.array([0.0, 1e-3, -2e-3])[:, None] + harmonics * np.cos(2 * angle)
    dims = ("time", "marker", "axis")
    found = channels(
        Channel("time", "s", experiment.times, ("time",)), Channel("markers", "m", path.T[:, None, :], dims)
    )
    return Record("fea", "ideal", {}, {}, found)


@given(st.floats(1e-4, 1e-2), st.floats(-0.95, 0.95), st.floats(-1.5, 1.5), st.floats(-3, 3))
def test_orbit_of_an_ellipse(major, ratio, tilt, phase):
    experiment = BaseShake(frequency=9.0, seen_from="clamp")
    found = experiment.reduce(orbit(experiment, major, ratio * major, tilt, phase, harmonics=0.1 * major))
    assert found["major_axis"].value == pytest.approx(2 * major)
    assert found["minor_axis"].value == pytest.approx(2 * abs(ratio) * major, abs=1e-12)
    assert found["tilt"].value == pytest.approx(tilt, abs=1e-9)
    assert found["axis_ratio"].value == pytest.approx(ratio, abs=1e-9)
    assert found["sense"].value == (np.sign(ratio) if abs(ratio) >= LINE else 0.0)
    # Half of 0.1 along each axis: cos(2 a) on both, of which the ellipse takes nothing.
    assert found["ellipse_residual"].value == pytest.approx(0.1 * major, rel=1e-6)
    size = major * np.sqrt(1.0 + ratio**2)
    assert found["harmonic_2"].value == pytest.approx(0.1 * np.sqrt(2.0) * major / size, rel=1e-6)
    assert found["harmonic_3"].value == pytest.approx(0.0, abs=1e-9)


def test_a_still_tip_is_seen_from_the_room_as_the_clamp_and_from_the_clamp_as_nothing():
    experiment = BaseShake(amplitude=0.003)
    still = orbit(experiment, 0.0, 0.0, 0.0)
    assert experiment.reduce(still)["major_axis"].value == pytest.approx(0.006)
    assert experiment.reduce(still)["tilt"].value == pytest.approx(-np.pi / 2)
    assert experiment.reduce(still)["sense"].value == 0.0
    from_clamp = experiment.model_copy(update={"seen_from": "clamp"})
    assert from_clamp.reduce(still)["major_axis"].value == pytest.approx(0.0, abs=1e-15)


def test_a_line_has_no_sense_of_travel():
    experiment = BaseShake(seen_from="clamp")
    assert experiment.reduce(orbit(experiment, 2e-3, 0.0, 0.4))["sense"].value == 0.0


def test_change_between_periods_is_relative_to_the_path():
    experiment = BaseShake()
    path = orbit(experiment, 3e-3, 1e-3, 0.0)["markers"]
    size = np.linalg.norm(path, axis=-1).max()
    other = path.copy()
    other[5, 0, 2] += 1e-5
    assert experiment.change(other, path) == pytest.approx(1e-5 / size)
    assert experiment.change(path, path) == 0.0
    assert experiment.change(path, 0 * path) == 1.0


def test_the_clamp_rises_smoothly_and_ends_as_the_sine_that_the_record_is_timed_by():
    experiment = BaseShake(frequency=8.0, ramp_periods=3.0)
    times = 4 * experiment.period + experiment.times
    sine = experiment.amplitude * np.sin(2 * np.pi * 8.0 * experiment.times)
    np.testing.assert_allclose(experiment.base.displacement(times)[:, 2], sine, atol=1e-15)
    assert not experiment.base.acceleration(np.zeros(1)).any()


def test_an_orbit_needs_three_periods_after_the_rise():
    with pytest.raises(ValidationError, match="three periods after the rise of 5: 7 is too few"):
        BaseShake(max_periods=7)
    with pytest.raises(ValidationError, match="three periods after the rise of 40: 42 is too few"):
        BaseShake(max_periods=42, rise=2.0, frequency=20.0)


@pytest.mark.parametrize(("frequency", "damping", "drive"), [(6.0, 0.02, 45.0), (27.0, 0.08, 3.0), (12.0, 0.3, 11.0)])
def test_what_is_left_of_a_transient_is_told_by_the_changes(frequency, damping, drive):
    """Of a free vibration the changes are |z - 1| |z|^n; what is left may be overrated, never underrated."""
    rate = 2 * np.pi * frequency * (-damping + 1j * np.sqrt(1 - damping**2))
    transient = np.abs(np.exp(rate / drive * np.arange(1, 30)))
    changes = np.abs(np.diff(np.exp(rate / drive * np.arange(1, 30))))
    for count in (2, 5, 28):
        left = BaseShake.remaining(changes[:count])
        assert transient[count] <= left
        assert left <= 2.01 * changes[count - 1] / (1 - np.exp(rate.real / drive))
    assert BaseShake.remaining(changes[:1]) == np.inf


def test_rounding_does_not_keep_an_orbit_from_being_steady():
    assert BaseShake.remaining([1e-2, 1e-4, 1e-6, 1.1e-6, 0.9e-6, 1e-6]) < 1e-5
    assert BaseShake.remaining([1e-6] * 12) == pytest.approx(2e-4)
    assert BaseShake.remaining([0.0, 0.0]) == 0.0


def test_smooth_shake_is_its_own_derivative():
    shake, times = SmoothShake((1e-3, 0.0, 2e-3), 7.0, 0.1), np.linspace(0.0, 0.3, 300001)
    step = times[1]
    second = np.diff(shake.displacement(times), 2, axis=0) / step**2
    np.testing.assert_allclose(second, shake.acceleration(times)[1:-1], atol=2e-3)
    assert not shake.displacement(times)[0].any()
