"""Following equilibria: loads, steered displacements, the whole path; what is kept when it is lost."""

import numpy as np
import pytest
from skfem import MeshQuad

from fea.body import Body
from fea.case import Case, stages
from fea.shell import Shell
from fea.statics import Steer, static, trace
from lab.materials import Material, PronyBranch
from meshes.block import block_mesh
from meshes.options import MeshOptions
from meshes.structured import surface_mesh

MODULUS = 1.2e6


def cantilever():
    strip = MeshQuad.init_tensor(np.linspace(0, 10, 9), np.linspace(0, 1, 2))
    strip = strip.with_boundaries({"root": lambda x: x[0] < 1e-9, "tip": lambda x: x[0] > 10 - 1e-9})
    return Shell(strip, 0.1, Material(youngs_modulus=MODULUS, poisson_ratio=0.0))


def shallow_arch(rise=0.2, span=10.0, thickness=0.1):
    """Half of a shallow arch of unit width, hinged at its foot, on its plane of symmetry."""

    def place(a, b):
        x = span / 2 * a
        return np.stack([x, b, rise * np.cos(np.pi * x / span)], axis=1)

    mesh = surface_mesh((5, 1), place, ("crown", "foot", "sides", "sides"))
    shell = Shell(mesh, thickness, Material(youngs_modulus=MODULUS, poisson_ratio=0.0))
    case = Case(shell).symmetry("crown", "x").fix("foot", layer="middle").symmetry("sides", "y")
    return case.force("crown", (0, 0, -1.0)).watch("crown", "crown")


def test_load_and_displacement_control_find_the_same_equilibria():
    case = Case(cantilever()).fix("root").force("tip", (0, 0, 4.0)).watch("tip", "tip")
    loaded = static(case, [0.5, 1.0])
    steered = static(case, [0.5, 1.0], Steer("tip", "z", float(loaded.displacement("tip")[-1, 2])))
    assert loaded.completed
    assert steered.completed
    assert steered.t[-1] == pytest.approx(1.0, rel=1e-6)
    np.testing.assert_allclose(steered.displacement("tip")[-1], loaded.displacement("tip")[-1], atol=1e-6)
    # Exact elastica at P L^2 / EI = 4: deflection 0.66996, shortening 0.32894 of the length.
    np.testing.assert_allclose(loaded.displacement("tip")[-1, [0, 2]], [-3.2894, 6.6996], rtol=2e-3)
    assert loaded.reaction("root")[-1, 2] == pytest.approx(-4.0, rel=1e-6)


@pytest.fixture(scope="module")
def snapped():
    return trace(shallow_arch(), until=2.0, first=0.02, largest=0.2)


def test_arc_length_passes_limit_points_of_load_and_of_displacement(snapped):
    """The crown comes back while the load falls (snap-back), before the arch ends up hanging."""
    assert snapped.completed, snapped.reason
    load, fall = snapped.t, -snapped.displacement("crown")[:, 2]
    first = int(np.argmax(np.diff(load) < 0))
    assert 1.5 < load[first] < 2.0
    assert load.min() < -1.0
    assert (np.diff(fall) < 0).any()
    assert fall[-1] > 0.4
    # Up to its first limit point the arch behaves as the same arch under a steered crown.
    run = static(shallow_arch(), np.linspace(0.1, 1, 10), Steer("crown", "z", -0.2))
    assert run.completed
    expected = np.interp(-run.displacement("crown")[:, 2], fall[: 3 * first], load[: 3 * first])
    np.testing.assert_allclose(run.t, expected, atol=0.02 * load[first])


def test_a_lost_path_keeps_what_it_reached():
    """A load that ends in nothing at t = 0.83: every increment before stays, and the run is marked."""
    case = Case(cantilever()).fix("root").watch("tip", "tip")
    case.force("tip", (0, 0, 1.0), ramp=lambda t: t if t < 0.83 else np.nan)
    run = static(case, [0.25, 0.5, 0.75, 1.0])
    assert run.status == "diverged"
    assert 0.75 < run.reached < 0.83
    assert "stopped at" in run.reason
    assert run.t[:4].tolist() == [0.0, 0.25, 0.5, 0.75]
    assert run.t[-1] == pytest.approx(run.reached)
    assert np.isfinite(run.displacement("tip")).all()


def test_small_increments_extrapolate_and_need_few_tangents():
    case = Case(cantilever()).fix("root").force("tip", (0, 0, 1.0))
    run = static(case, np.linspace(0.05, 1, 20))
    assert run.history["tangents"] <= 3 * 20


def test_slow_viscoelastic_pull_relaxes_and_closes_a_loop():
    """A bar of one Maxwell branch, pulled, held, let back: the closed form of relaxation, and energy lost."""
    branch, modulus = PronyBranch(ratio=0.5, time=2.0), 1e6
    material = Material(youngs_modulus=modulus, poisson_ratio=0.0, prony=(branch,), viscous_time=0.0)
    bar = Body(block_mesh((1.0, 0.1, 0.1), MeshOptions(along=1, across=1, through=1)), material)
    ramp = stages((0, 0), (1, 1), (5, 1), (6, 0))
    case = Case(bar).fix("root").fix("tip", "x", to=1e-4, ramp=ramp)
    run = static(case, np.linspace(0.1, 6, 60), seconds=1.0)
    force = run.reaction("tip")[:, 0] / (modulus * 0.01 * 1e-4)
    decay = branch.ratio * branch.time * (1 - np.exp(-1 / branch.time))
    assert force[10] == pytest.approx(1 + decay, rel=2e-3)
    assert force[50] == pytest.approx(1 + decay * np.exp(-4 / branch.time), rel=2e-3)
    assert force[60] < -0.1
    assert run.work[-1] > 0.1 * run.work.max()
    quick = static(Case(bar).fix("root").fix("tip", "x", to=1e-4), [1.0])
    assert quick.reaction("tip")[-1, 0] == pytest.approx(modulus * 0.01 * 1e-4, rel=1e-3)


def test_unusable_levels_are_refused():
    with pytest.raises(ValueError, match="positive and growing"):
        static(Case(cantilever()).fix("root"), [0.5, 0.5])
    held = Case(cantilever()).fix("root").force("tip", (0, 0, 1.0))
    with pytest.raises(ValueError, match="is held"):
        static(held, [1.0], Steer("root", "z", 1.0))
