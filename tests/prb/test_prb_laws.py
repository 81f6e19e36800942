"""Springs, dampers and branches: closed forms, the simulator's own forces, and direct integrations."""

import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from lab.measures import tracking_error
from prb.laws import Laws
from prb.mechanism import CLAMP, Branch, Hinge, Knee, Link, Mechanism, Tie
from prb.mujoco_model import compile_mechanism, to_mjcf, write_mechanism
from prb.release import extrapolated, inertia_at, is_stable, release
from prb.statics import Chain, Load, NotConverged, hang

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
LENGTH, MASS = 0.1, 0.02
INERTIA = MASS * (LENGTH**2 / 3 + 0.01**2 / 12)
LINEAR = Hinge("h", Z, 0.5, 1e-3)
CUBIC = Hinge("h", Z, 0.5, 1e-3, higher=(0.3, 2.0), higher_damping=(2e-4, 1e-5), rest=0.1)
BILINEAR = Hinge("h", Z, 0.5, 1e-3, rest=-0.05, above=Knee(0.2, 0.05), below=Knee(0.0, 2.0))
RELAXING = Hinge("h", Z, 0.5, 1e-4, branches=(Branch(0.4, 0.01), Branch(0.2, 0.05)))
HINGES = {"linear": LINEAR, "cubic": CUBIC, "bilinear": BILINEAR, "relaxing": RELAXING}


def bar(hinge: Hinge) -> Mechanism:
    return Mechanism((Link("bar", LENGTH, 0.01, 0.01, MASS, hinges=(hinge,)),))


def torque(hinge: Hinge, q: float) -> float:
    """Resistance of the spring, written down once more."""
    x = q - hinge.rest
    found = hinge.stiffness * x + hinge.higher[0] * x**2 + hinge.higher[1] * x**3
    if hinge.above and x > hinge.above.at:
        found += (hinge.above.stiffness - hinge.stiffness) * (x - hinge.above.at)
    if hinge.below and x < hinge.below.at:
        found += (hinge.below.stiffness - hinge.stiffness) * (x - hinge.below.at)
    return found


@pytest.mark.parametrize("name", HINGES)
@pytest.mark.parametrize("q", [-0.9, -0.06, 0.0, 0.12, 0.3, 1.1])
def test_statics_and_simulator_know_the_same_spring(name, q):
    hinge = HINGES[name]
    model = compile_mechanism(bar(hinge))
    laws, data = Laws(model), mujoco.MjData(model)
    posture = np.array([q])
    data.qpos[:] = laws.with_hidden(posture)
    mujoco.mj_forward(model, data)
    assert laws.torque(posture)[0] == pytest.approx(torque(hinge, q), rel=1e-12, abs=1e-15)
    assert -data.qfrc_spring[0] == pytest.approx(torque(hinge, q), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", HINGES)
@pytest.mark.parametrize("q", [-0.9, 0.12, 1.1])
def test_torque_is_the_slope_of_the_energy_and_tangent_that_of_the_torque(name, q):
    laws, step = Laws(compile_mechanism(bar(HINGES[name]))), 1e-6
    up, down = np.array([q + step]), np.array([q - step])
    assert (laws.energy(up) - laws.energy(down)) / (2 * step) == pytest.approx(laws.torque(np.array([q]))[0], rel=1e-8)
    slope = (laws.torque(up) - laws.torque(down)) / (2 * step)
    assert laws.tangent(np.array([q]))[0] == pytest.approx(slope, rel=1e-8)


@pytest.mark.parametrize("name", HINGES)
def test_a_loaded_bar_turns_as_its_equation_says(name):
    # t(q) = F l cos q, F along y.
    chain = Chain(compile_mechanism(bar(HINGES[name])))
    q = hang(chain, Load(np.array([0.0, 1.0, 0.0])))[0]
    assert torque(HINGES[name], q) == pytest.approx(1.0 * LENGTH * np.cos(q), rel=1e-9)


def test_own_weight_and_a_load_beside_the_tip():
    # t(q) = m g l / 2 cos q + F (l cos q - h sin q): the load's place (0, h) rides on the bar.
    chain, height, force, gravity = Chain(compile_mechanism(bar(LINEAR))), 0.02, 0.8, 9.81
    load = Load(np.array([0.0, force, 0.0]), np.array([0.0, height, 0.0]), np.array([0.0, gravity, 0.0]))
    q = hang(chain, load)[0]
    arm = LENGTH * np.cos(q) - height * np.sin(q)
    assert 0.5 * q == pytest.approx(MASS * gravity * LENGTH / 2 * np.cos(q) + force * arm, rel=1e-9)
    sag = hang(chain, load.own_weight)[0]
    assert 0.5 * sag == pytest.approx(MASS * gravity * LENGTH / 2 * np.cos(sag), rel=1e-9)


def test_loads_are_balanced_with_their_own_derivative():
    chain = Chain(compile_mechanism(tree()))
    load = Load(np.array([0.1, 0.3, -0.2]), np.array([0.0, 0.01, 0.005]), np.array([1.0, -9.0, 3.0]))
    q = 0.3 * np.random.default_rng(1).standard_normal(chain.laws.count)
    step = 1e-6
    columns = [
        (chain.balance(q - step * e, load)[0] - chain.balance(q + step * e, load)[0]) / (2 * step)
        for e in np.eye(len(q))
    ]
    assert chain.balance(q, load)[1] == pytest.approx(np.column_stack(columns), abs=1e-7)


def test_a_joint_that_has_yielded_turns_until_the_lever_is_short_enough():
    chain = Chain(compile_mechanism(bar(Hinge("h", Z, 0.5, 0.0, above=Knee(0.1, 0.0)))))
    assert np.cos(hang(chain, Load(np.array([0.0, 0.9, 0.0])))[0]) == pytest.approx(0.5 * 0.1 / (0.9 * LENGTH))
    with pytest.raises(NotConverged, match="no stable equilibrium beyond 96.* of the load"):
        # Against the axis: k q = F l sin q holds up to F = k / l, then the bar turns over.
        hang(Chain(compile_mechanism(bar(LINEAR))), Load(np.array([-5.2, 0.0, 0.0])))


def integrated(hinge: Hinge, start: float, times: np.ndarray) -> np.ndarray:
    """Angle of a released bar (n,): the pendulum with its springs and Maxwell branches written down directly."""

    def rates(time: float, state: np.ndarray) -> list[float]:
        q, v, *forces = state
        b1, (b2, b3) = hinge.damping, hinge.higher_damping
        moment = -torque(hinge, q) - b1 * v - b2 * v * abs(v) - b3 * v**3 - sum(forces)
        relaxing = [b.stiffness * v - f / b.time for b, f in zip(hinge.branches, forces, strict=True)]
        return [v, moment / INERTIA, *relaxing]

    begin = [start, 0.0, *np.zeros(len(hinge.branches))]
    return solve_ivp(rates, (0, times[-1]), begin, t_eval=times, rtol=1e-9, atol=1e-12, max_step=1e-3).y[0]


@pytest.mark.parametrize("name", HINGES)
def test_a_release_agrees_with_a_direct_integration(name):
    hinge, samples, step, stride = HINGES[name], 80, 1e-4, 25
    model = compile_mechanism(bar(hinge), (), step)
    motion = extrapolated([model], [mujoco.MjData(model)], np.array([[0.6]]), samples, stride)
    assert motion.completed.all()
    exact = integrated(hinge, 0.6, stride * step * np.arange(samples))
    assert tracking_error(motion.joints[0], exact[:, None]) < 2e-3


def test_dry_friction_takes_the_same_share_of_every_half_swing():
    # Between two turning points of an undamped bar on dry friction M the amplitude drops by 2 M / k.
    moment, k = 0.01, 0.5
    bar_ = bar(Hinge("h", Z, k, 0.0, friction=moment))
    half = np.pi / np.sqrt(k / INERTIA)
    model = compile_mechanism(bar_, (), half / 800)
    motion = release([model], [mujoco.MjData(model)], np.array([[0.5]]), 9, 800)
    peaks = np.abs(motion.joints[0, :, 0])
    assert -np.diff(peaks) == pytest.approx(2 * moment / k, rel=0.02)
    assert hang(Chain(model), Load(np.array([0.0, 1e-3, 0.0])))[0] > 0  # no friction in static states


def tree(scale: float = 1.0) -> Mechanism:
    """Two limbs on a root with springs of every kind, a tip beside the axis, and turned frames."""
    hinges = [
        Hinge("a", Z, 0.5 * scale, 1e-3, rest=0.1 * scale),
        Hinge(
            "b",
            Y,
            0.6,
            2e-3 * scale,
            higher=(0.1 * scale, 0.4),
            higher_damping=(1e-4, 1e-5 * scale),
            friction=1e-4 * scale,
        ),
        Hinge("c", X, 0.4, 1e-3, above=Knee(0.1, 0.1 * scale), below=Knee(-0.2 * scale, 1.0)),
        Hinge("d", (0.0, 0.6, 0.8), 0.4 * scale, 1e-3, branches=(Branch(0.3 * scale, 0.02),)),
    ]
    links = (
        Link("root", 0.04, 0.02, 0.003, 0.004 * scale, 0.2, (hinges[0],)),
        Link("limb", 0.03, 0.02, 0.003 * scale, 0.002, hinges=(hinges[1],), parent=0, rotation=(0.1, 0.4, 0.0)),
        Link("hand", 0.02, 0.01, 0.003, 0.001, hinges=(hinges[2],), parent=1),
        Link("other", 0.03 * scale, 0.02, 0.003, 0.002, hinges=(hinges[3],), parent=0, place=(0.02, 0.01, 0.0)),
        Link("lone", 0.03, 0.02, 0.003, 0.002, parent=CLAMP, place=(0.0, 0.0, -0.01)),
    )
    ties = (
        Tie("pair", (("a", 1.0), ("c", -0.5 * scale)), 0.1, (0.2 * scale, 0.3), 1e-4 * scale),
        Tie("three", (("b", 1.0), ("c", 1.0), ("d", 0.3)), 0.05 * scale),
    )
    return Mechanism(links, 0.003, 2, (0.02, 0.004 * scale, 0.0), ties, (0.02, 0.003 * scale, 0.3 * scale))


def moved(model: mujoco.MjModel) -> np.ndarray:
    start = hang(Chain(model), Load(np.array([0.0, 0.5, 0.3])))
    motion = release([model], [mujoco.MjData(model)], start[None], 60, 20)
    assert motion.completed.all()
    return motion.positions[0]


MARKERS = ((0.0, 0.01, 0.0), (0.0, 0.0, 0.01))


def test_an_edited_model_is_the_compiled_one():
    model = compile_mechanism(tree(1.3), MARKERS, 1e-4)
    write_mechanism(model, mujoco.MjData(model), tree(), MARKERS)
    assert moved(model) == pytest.approx(moved(compile_mechanism(tree(), MARKERS, 1e-4)), abs=1e-14)


def test_mjcf_gives_the_same_motion():
    text = to_mjcf(tree(), MARKERS, 1e-4)
    ours = moved(compile_mechanism(tree(), MARKERS, 1e-4))
    assert moved(mujoco.MjModel.from_xml_string(text)) == pytest.approx(ours, abs=2e-6)


def test_markers_stand_in_the_fixed_axes_with_slack_springs():
    chain = Chain(compile_mechanism(tree(), MARKERS))
    places = chain.sites(chain.slack)
    assert places[1:] - places[0] == pytest.approx(np.array(MARKERS), abs=1e-12)
    assert chain.slack == pytest.approx([0.1, 0, 0, 0])


def test_the_tip_s_mass_is_a_plate_beside_the_axis():
    # Kinetic energy of the tip's mass alone: the difference that it makes to the inertia matrix.
    q, place, (width, thickness, angle) = np.array([0.2, -0.3, 0.4, 0.1]), (0.02, 0.004, 0.0), (0.03, 0.01, 0.7)
    masses = [
        compile_mechanism(Mechanism(tree().links, mass, 2, place, (), (width, thickness, angle)))
        for mass in (0.5, 1e-9)
    ]
    heavy, light = (inertia_at(m, mujoco.MjData(m), Laws(m).with_hidden(q))[:4, :4] for m in masses)
    tip = Chain(masses[1]).tip(q)
    about_x = Rotation.from_rotvec([angle, 0, 0]).as_matrix()
    axes = tip.rotation @ about_x
    plate = axes @ np.diag([width**2 + thickness**2, thickness**2, width**2]) @ axes.T / 12
    energy = tip.jacp.T @ tip.jacp + tip.jacr.T @ plate @ tip.jacr
    assert heavy - light == pytest.approx(0.5 * energy, rel=1e-6, abs=1e-11)


def test_ties_couple_joints_as_their_energy_says():
    mechanism, q = tree(), np.array([0.2, -0.3, 0.4, 0.1])
    model = compile_mechanism(mechanism)
    laws, loose = Laws(model), Laws(compile_mechanism(dataclasses.replace(mechanism, ties=())))
    pair, three = q[0] - 0.5 * q[2], q[1] + q[2] + 0.3 * q[3]
    energy = 0.1 * pair**2 / 2 + 0.2 * pair**3 / 3 + 0.3 * pair**4 / 4 + 0.05 * three**2 / 2
    assert laws.energy(q) - loose.energy(q) == pytest.approx(energy, rel=1e-10)
    torque = 0.1 * pair + 0.2 * pair**2 + 0.3 * pair**3
    expected = np.array([torque, 0.05 * three, -0.5 * torque + 0.05 * three, 0.015 * three])
    assert laws.torque(q) - loose.torque(q) == pytest.approx(expected, rel=1e-10)
    data = mujoco.MjData(model)
    data.qpos[:] = laws.with_hidden(q)
    mujoco.mj_forward(model, data)
    assert -data.qfrc_spring[:4] == pytest.approx(laws.torque(q), rel=1e-12)
    step = 1e-6
    columns = [(laws.torque(q + step * e) - laws.torque(q - step * e)) / (2 * step) for e in np.eye(4)]
    assert laws.tangent(q) == pytest.approx(np.column_stack(columns), abs=1e-8)


def test_ties_of_locked_joints_go_with_them():
    slide = Hinge("s", X, 100.0, 0.0, "slide", locked_in_motion=True)
    links = (Link("bar", LENGTH, 0.01, 0.01, MASS, hinges=(slide, LINEAR)),)
    moving = Mechanism(links, ties=(Tie("t", (("s", 1.0), ("h", 0.1)), 50.0),)).in_motion
    assert (len(moving.hinges), moving.ties) == (1, ())


def test_stability_counts_knees_and_branches():
    def limit(hinge: Hinge) -> float:
        model = compile_mechanism(bar(hinge))
        data, stable = mujoco.MjData(model), []
        for step in np.geomspace(1e-4, 1.0, 400):
            model.opt.timestep = step
            stable += [step] * is_stable(model, data, np.array([0.6]))
        return max(stable)

    undamped = Hinge("h", Z, 0.5, 0.0)
    assert limit(undamped) == pytest.approx(2 / np.sqrt(0.5 / INERTIA), rel=0.03)
    hardening = Hinge("h", Z, 0.5, 0.0, above=Knee(0.3, 8.0))
    assert limit(hardening) == pytest.approx(2 / np.sqrt(8.0 / INERTIA), rel=0.03)
    assert limit(Hinge("h", Z, 0.5, 0.0, branches=(Branch(4.0, 1.0),))) < 0.5 * limit(undamped)
