"""Compiled motion of a clamped shell: against ``fea.dynamics``, order, energies."""

import numpy as np
import pytest

from fea.dynamics import Dynamics
from fea.modes import natural_modes
from fea.shell import Shell
from fea.shell_motion import ShellMotion
from lab.experiments.shaking import SmoothShake
from lab.materials import Material
from meshes.structured import surface_mesh


def twisted(counts=(3, 1), **material):
    def place(a, b):
        y, angle = 0.02 * (b - 0.5), 0.5 * np.pi * a
        return np.stack([0.05 * a, y * np.cos(angle), y * np.sin(angle)], axis=1)

    return Shell(surface_mesh(counts, place, ("root", "tip", "side", "side")), 0.003, Material(**material))


def first_mode(motion, size):
    """Shape (nodes, 3) with the largest displacement ``size`` m, and period, s."""
    shell = motion.shell
    pattern, taken = shell.pattern.restrict(motion.free)
    stiffness = shell.tangent(np.zeros((shell.nodes, 3)))[1][taken]
    modes = natural_modes(pattern, stiffness, shell.mass(motion.on_boundary)[taken], 1)
    shape = np.zeros(3 * shell.nodes)
    shape[motion.free] = modes.shapes[0]
    return size * shape.reshape(-1, 3) / np.abs(shape).max(), 1.0 / modes.frequencies[0]


@pytest.mark.parametrize("law", ["saint-venant-kirchhoff", "neo-hookean"])
def test_same_as_the_plain_integrator(law):
    shell = twisted(law=law, mass_damping=2.0)
    load = np.zeros((shell.nodes, 3))
    load[shell.boundary("tip"), 1] = 0.02
    fast = ShellMotion(shell, {"tip": 5e-4}, load, tolerance=1e-8)
    plain = Dynamics(shell, {"tip": 5e-4}, load, tolerance=1e-8)
    shape, period = first_mode(fast, 1e-3)
    start, speed = 0.1 * shape, shape * 2 * np.pi / period
    begin = plain.start(start.reshape(-1)[plain.free], speed.reshape(-1)[plain.free])
    theirs = list(plain.samples(begin, 2e-3, 16, 2))
    ours = fast.run(2e-3, 16, 2, u=start, v=speed)
    assert not ours.stopped
    expected = np.array([plain.nodal(motion.u) for motion in theirs])
    np.testing.assert_allclose(ours.displacement, expected, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(ours.kinetic, [plain.kinetic_energy(m) for m in theirs], rtol=1e-4)
    np.testing.assert_allclose(ours.strain, [plain.strain_energy(m) for m in theirs], rtol=1e-4)


@pytest.mark.parametrize("viscous_time", [0.0, 2e-3])
def test_second_order_in_time(viscous_time):
    motion = ShellMotion(twisted(viscous_time=viscous_time), tolerance=1e-9)
    shape, period = first_mode(motion, 1e-5)
    ends = [
        motion.run(period / 4, 2, steps, v=shape * 2 * np.pi / period).displacement[-1] for steps in (8, 16, 32, 64)
    ]
    errors = [np.linalg.norm(b - a) for a, b in zip(ends, ends[1:], strict=False)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(2.0, abs=0.4)


def test_steady_shaking_follows_the_linear_oscillator():
    motion = ShellMotion(twisted(), tolerance=1e-8)
    shell, drive = motion.shell, SmoothShake((0.0, 0.0, 1e-5), 18.0, rise=0.2)
    run = motion.run(1e-3, 1001, base=drive.acceleration)
    pattern, taken = shell.pattern.restrict(motion.free)
    stiffness = pattern.full(shell.tangent(np.zeros((shell.nodes, 3)))[1][taken]).toarray()
    mass, w = motion.mass.toarray(), 2 * np.pi * 18.0
    along = shell.pattern.full(shell.mass()).toarray()[motion.free][:, 2::3].sum(axis=1)
    complex_stiffness = stiffness * (1 + 1j * w * shell.material.viscous_time) - w**2 * mass
    expected = np.zeros(3 * shell.nodes, complex)
    expected[motion.free] = np.linalg.solve(complex_stiffness, w**2 * 1e-5 * along)
    tail = run.times >= 0.6
    waves = np.imag(expected[None] * np.exp(1j * w * run.times[tail])[:, None])
    ours = run.displacement[tail].reshape(tail.sum(), -1)
    assert np.linalg.norm(ours - waves) < 0.01 * np.linalg.norm(waves)


def test_rigid_motion_of_the_clamp_costs_what_it_should():
    # Work of the inertia forces = stored + dissipated; the loss is measured apart, from the viscous forces.
    motion = ShellMotion(twisted(viscous_time=1e-3), tolerance=1e-8)
    run = motion.run(2e-4, 601, base=SmoothShake((0.0, 0.0, 2e-3), 30.0).acceleration)
    shell = motion.shell
    strains = np.array([shell.strains(u) for u in run.displacement])
    rates = np.diff(strains, axis=0) / 2e-4
    loss = np.einsum("sea,eab,seb->s", rates, motion.system.elements.stiffness, rates, optimize=True)
    lost = 2e-4 * shell.material.viscous_time * np.cumsum(loss)
    balance = run.kinetic[1:] + run.strain[1:] + lost - run.work[1:]
    assert np.abs(balance).max() < 0.01 * run.work.max()
    assert lost[-1] > 0.3 * run.work[-1]


def test_energy_is_kept_without_damping_and_lost_with_it():
    for viscous_time, rho, low, high in ((0.0, 1.0, 0.99, 1.01), (0.0, 0.9, 0.9, 1.005), (1e-3, 0.9, 0.1, 0.9)):
        motion = ShellMotion(twisted(viscous_time=viscous_time), tolerance=1e-8, rho=rho)
        shape, period = first_mode(motion, 5e-3)
        run = motion.run(period / 40, 41, v=shape * 2 * np.pi / period)
        total = run.kinetic + run.strain
        assert low < total[-1] / total[0] < high


def test_steps_are_halved_where_they_fail_and_the_end_is_said():
    motion = ShellMotion(twisted(), tolerance=1e-6)
    shape, period = first_mode(motion, 1e-3)
    # A jolt that a whole step does not survive.
    run = motion.run(period / 3, 4, v=shape * 60 * np.pi / period)
    assert motion.work.counts[1] > 0
    assert len(run.times) == len(run.displacement)
    assert bool(run.stopped) == (len(run.times) < 4)
    absurd = motion.run(period, 3, v=1e6 * shape / period)
    assert "no equilibrium" in absurd.stopped
    assert len(absurd.times) == 1
