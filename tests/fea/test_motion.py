"""Motion of cases: against the closed form, in time order, free flight, viscoelasticity, vibrations and buckling."""

import numpy as np
import pytest
from skfem import MeshQuad

from fea.case import Case, constant
from fea.motion import Motion, transient
from fea.shell import Shell
from fea.statics import static
from fea.vibration import linear_buckling, vibrations
from lab.materials import Material, PronyBranch

MODULUS, LENGTH, THICKNESS = 1.2e6, 10.0, 0.1
#: Such that Euler and Bernoulli's first frequency is 10 Hz (Sze, Liu & Lo's cantilever).
DENSITY = 3.1314e-4


def cantilever(elements=6, **material):
    strip = MeshQuad.init_tensor(np.linspace(0, LENGTH, elements + 1), np.linspace(0, 1, 2))
    strip = strip.with_boundaries({"root": lambda x: x[0] < 1e-9, "tip": lambda x: x[0] > LENGTH - 1e-9})
    own = {"youngs_modulus": MODULUS, "poisson_ratio": 0.0, "density": DENSITY, "viscous_time": 0.0, **material}
    return Shell(strip, THICKNESS, Material(**own))


def test_first_frequency_by_eigenvalues_and_by_motion():
    case = Case(cantilever()).fix("root")
    found = vibrations(case, 3)
    assert found.frequencies[0] == pytest.approx(10.0, rel=2e-3)
    assert found.missed == 0
    shape = found.shapes[0]
    run = transient(case, 0.1, 0.5e-3, velocity=shape / np.abs(shape).max(), rho=1.0)
    tip = run.displacement("tip")[:, 2]
    crossings = np.flatnonzero(np.diff(np.sign(tip[1:]))) + 1
    assert run.t[crossings[0]] == pytest.approx(0.05, abs=1e-3)


def test_prestress_raises_and_thrust_lowers_the_frequency():
    """Along the beam; at the buckling load the first frequency vanishes."""
    pulled = Case(cantilever()).fix("root").force("tip", (1.0, 0, 0))
    factor = linear_buckling(Case(cantilever()).fix("root").force("tip", (-1.0, 0, 0))).factors[0]
    assert factor == pytest.approx(np.pi**2 * MODULUS * THICKNESS**3 / 12 / (4 * LENGTH**2), rel=2e-3)
    rest = vibrations(pulled, 1).frequencies[0]
    assert vibrations(pulled, 1, static(pulled, [1.0])).frequencies[0] > 1.05 * rest
    pushed = Case(cantilever()).fix("root").force("tip", (-0.98 * factor, 0, 0))
    assert vibrations(pushed, 1, static(pushed, [1.0])).frequencies[0] < 0.2 * rest


def test_motion_under_a_sudden_load_balances_its_energy():
    case = Case(cantilever()).fix("root").force("tip", (0, 0, 0.4), ramp=constant)
    run = transient(case, 0.1, 1e-3, rho=1.0)
    work = 0.4 * run.displacement("tip")[:, 2]
    np.testing.assert_allclose(run.energy + run.kinetic, work, atol=2e-3 * run.energy.max())


def test_second_order_in_time():
    case = Case(cantilever(3)).fix("root").force("tip", (0, 0, 0.4), ramp=lambda t: np.sin(60 * t) ** 2)
    ends = [transient(case, 0.04, step).displacement("tip")[-1, 2] for step in (2e-3, 1e-3, 0.125e-3)]
    errors = np.abs(np.array(ends[:2]) - ends[2])
    assert 1.7 < np.log2(errors[0] / errors[1]) < 2.4


def test_free_flight_keeps_momenta():
    case = Case(cantilever(4))
    case.rigid("mass", "tip", mass=1e-3, inertia=np.diag([1e-3, 2e-3, 2e-3]))
    spin = np.array([3.0, 20.0, 5.0])
    velocity = np.cross(spin, case.points - np.array([5, 0.5, 0]))
    run = transient(case, 0.2, 2e-3, velocity=velocity)
    assert run.completed, run.reason
    mass = Motion(case).mass
    linear, angular = [], []
    for x, v in zip(run._fields, run._velocities, strict=True):
        momentum = (mass @ v.ravel()).reshape(-1, 3)
        linear.append(momentum.sum(axis=0))
        angular.append(np.cross(case.points + x, momentum).sum(axis=0))
    np.testing.assert_allclose(
        linear, np.broadcast_to(linear[0], (len(linear), 3)), atol=1e-9 * np.abs(linear[0]).max()
    )
    np.testing.assert_allclose(
        angular, np.broadcast_to(angular[0], (len(angular), 3)), atol=0.01 * np.abs(angular[0]).max()
    )
    assert np.ptp(run.energy + run.kinetic) < 0.03 * run.kinetic[0]


def test_shaken_base_by_prescribed_motion_and_by_acceleration():
    """The clamp moved, or the frame accelerated: the same motion relative to the clamp."""
    amplitude, rate = 0.05, 2 * np.pi * 7.0

    def moved(t):
        return amplitude * (1 - np.cos(rate * t))

    case = Case(cantilever(4)).fix("root", "xy").fix("root", "z", to=1.0, ramp=moved)
    first = transient(case, 0.1, 1e-3)
    base = transient(
        Case(cantilever(4)).fix("root"), 0.1, 1e-3, base=lambda t: (0.0, 0.0, amplitude * rate**2 * np.cos(rate * t))
    )
    relative = first.displacement("tip")[:, 2] - moved(first.t)
    np.testing.assert_allclose(relative, base.displacement("tip")[:, 2], atol=0.01 * np.abs(relative).max())


def test_damping_takes_energy_away():
    velocity = vibrations(Case(cantilever(4)).fix("root"), 1).shapes[0]
    velocity = velocity / np.abs(velocity).max()
    # Kelvin-Voigt: the ratio of the first mode is pi f tau.
    ratio = 0.05
    damped = Case(cantilever(4, viscous_time=ratio / (np.pi * 10.0))).fix("root")
    run = transient(damped, 0.1, 0.5e-3, velocity=velocity)
    total = run.energy + run.kinetic
    assert (np.diff(total) < 1e-9 * total[0]).all()
    assert total[-1] / total[0] == pytest.approx(np.exp(-4 * np.pi * ratio), rel=0.05)
    maxwell = Case(cantilever(4, prony=(PronyBranch(ratio=0.2, time=0.01),))).fix("root")
    run = transient(maxwell, 0.1, 0.5e-3, velocity=velocity)
    assert (run.energy + run.kinetic)[-1] < 0.6 * run.kinetic[0]


def test_start_from_a_static_run_and_release():
    shell = cantilever(4)
    hung = static(Case(shell).fix("root").force("tip", (0, 0, 0.2)), [1.0])
    free = Case(shell).fix("root")
    run = transient(free, 0.05, 0.5e-3, start=hung, rho=1.0)
    tip = run.displacement("tip")[:, 2]
    assert tip[0] == pytest.approx(hung.displacement("tip")[-1, 2])
    assert tip.min() == pytest.approx(-tip[0], rel=0.1)


def test_a_motion_that_fails_keeps_what_it_had():
    case = Case(cantilever(2)).fix("root").fix("tip", "x", to=1.0, ramp=lambda t: -1e3 * t if t < 0.01 else np.nan)
    run = transient(case, 0.02, 1e-3)
    assert run.status == "diverged"
    assert "the motion stopped at" in run.reason
    assert 0 < run.reached < 1
    assert np.isfinite(run.displacement("tip")).all()
