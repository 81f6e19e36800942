"""Steady orbits over a shaken clamp: closed forms, a clamp that really moves, the criterion, mirror images."""

import dataclasses

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

import prb
from lab.experiments import BaseShake
from lab.measures import tracking_error
from lab.requests import Request
from lab.specimens import TwistedBeam
from prb.batch import Batch
from prb.mechanism import Branch, Hinge, Link, Mechanism
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.shaking import orbits, rest_of, step_of
from prb.statics import Chain
from prb.topologies import TOPOLOGIES

BEAM = TwistedBeam(mass=0.00517, tip_mass=0.01)
FINE = {"tolerance": 1e-6, "ramp_periods": 3}


def orbit_of(mechanism: Mechanism, experiment: BaseShake, time_step: float = 2e-4):
    model = compile_mechanism(mechanism, experiment.markers, step_of(experiment, time_step))
    model.opt.gravity[:] = experiment.own_gravity or (0, 0, 0)
    return orbits([model], [mujoco.MjData(model)], [experiment], [rest_of(Chain(model), experiment)])[0]


def bar(*branches: Branch) -> Mechanism:
    # Turns about -y: a positive angle lifts the tip along +z.
    hinge = Hinge("h", (0.0, -1.0, 0.0), 0.5, 4e-3, branches=branches)
    return Mechanism((Link("bar", 0.1, 0.01, 0.01, 0.02, hinges=(hinge,)),))


@pytest.mark.parametrize("branches", [(), (Branch(0.3, 0.01),)])
@pytest.mark.parametrize("frequency", [5.0, 14.0, 30.0])
def test_a_bar_answers_as_the_linear_oscillator(frequency, branches):
    # (I s^2 + b s + k + sum k_i s t_i / (1 + s t_i)) q = -m l / 2 s^2 z
    experiment = BaseShake(frequency=frequency, amplitude=1e-6, **FINE)
    orbit = orbit_of(bar(*branches), experiment)
    s = 2j * np.pi * frequency
    stiffness = 0.5 + 4e-3 * s + sum(b.stiffness * s * b.time / (1 + s * b.time) for b in branches)
    inertia = 0.02 * (0.1**2 / 3 + 0.01**2 / 12)
    answer = -0.02 * 0.05 * s**2 * 1e-6 / (inertia * s**2 + stiffness) * 0.1
    exact = np.imag(answer * np.exp(s * experiment.times))
    assert orbit.path[:, 0, 2] == pytest.approx(exact, abs=2e-3 * abs(answer))


def test_inertial_forces_are_a_clamp_that_moves():
    # The same mechanism on a very heavy carriage that is driven along z, stepped from Python.
    experiment = BaseShake(frequency=12.0, amplitude=0.004, ramp_periods=3.0, tolerance=1e-4, samples_per_period=32)
    mechanism, step = PrbModel(topology="five-hinge").mechanism(BEAM), step_of(experiment, 5e-5)
    slide = Hinge("carriage", (0.0, 0.0, 1.0), 0.0, 0.0, "slide")
    root, limb = mechanism.links
    links = (
        Link("carriage", 0.01, 0.01, 0.01, 1e6, hinges=(slide,)),
        dataclasses.replace(root, parent=0, place=(0.0, 0.0, 0.0)),
        dataclasses.replace(limb, parent=1),
    )
    model = compile_mechanism(Mechanism(links, BEAM.tip_mass), (), step)
    data = mujoco.MjData(model)
    period = round(experiment.period / model.opt.timestep)
    acceleration = experiment.base.acceleration(np.arange(12 * period + 1) * model.opt.timestep)[:, 2]
    # Velocity half a step back, so that the carriage's own places are right to second order.
    data.qvel[0] = experiment.base.acceleration(np.zeros(1))[0, 2] * -0.5 * model.opt.timestep
    path = []
    for k, a in enumerate(acceleration):
        data.qfrc_applied[0] = 1e6 * a
        if k >= 11 * period and (k - 11 * period) % (period // 32) == 0:
            mujoco.mj_kinematics(model, data)
            path.append(data.site("tip").xpos - [BEAM.length, 0.0, data.qpos[0]])
        mujoco.mj_step(model, data)
    assert tracking_error(np.array(path), orbit_of(mechanism, experiment).path[:, 0]) < 0.02


def test_the_record_of_a_steady_orbit():
    experiment = BaseShake(frequency=20.0, markers=((0, 0.01, 0), (0, 0, 0.01)))
    record = prb.perform(BEAM, experiment, PrbModel(topology="gauss-chain"))
    assert record.completed
    assert {n: c.values.shape for n, c in record.channels.items()} == {
        "time": (65,), "markers": (65, 2, 3), "tip": (65, 3),
    }  # fmt: skip
    assert record["markers"][0] == pytest.approx(record["markers"][-1], abs=2e-3 * np.abs(record["markers"]).max())
    assert record.scalars["periods"].value >= experiment.ramp_periods + 2
    assert record.scalars["change"].value < record.scalars["remaining"].value < experiment.tolerance
    assert record.how["seconds_per_10_s"] > 0


def test_an_orbit_that_is_not_steady_in_time_is_diverged_with_its_path():
    experiment = BaseShake(frequency=15.0, max_periods=8)
    record = prb.perform(BEAM, experiment, PrbModel(topology="gauss-chain"))
    assert record.status == "diverged"
    assert record.reason.startswith("not steady after 8 periods: the last one still changed the path by")
    assert record["markers"].shape == (65, 1, 3)


@pytest.mark.parametrize("frequency", [11.0, 40.0])
def test_a_lightly_damped_bar_is_steady_long_before_its_free_vibration_dies(frequency):
    # Damping ratio 0.6 %: left to itself, 40 Hz takes some 600 periods.
    hinge = Hinge("h", (0.0, -1.0, 0.0), 0.5, 7e-5)
    light = Mechanism((Link("bar", 0.1, 0.01, 0.01, 0.02, hinges=(hinge,)),))
    orbit = orbit_of(light, BaseShake(frequency=frequency, amplitude=1e-5, tolerance=1e-3))
    s, inertia = 2j * np.pi * frequency, 0.02 * (0.1**2 / 3 + 0.01**2 / 12)
    answer = -0.02 * 0.05 * s**2 * 1e-5 / (inertia * s**2 + 7e-5 * s + 0.5) * 0.1
    assert orbit.periods < 60
    assert orbit.remaining < 1e-3
    exact = np.imag(answer * np.exp(s * np.arange(65) / 64 / frequency))
    assert orbit.path[:, 0, 2] == pytest.approx(exact, abs=3e-3 * abs(answer))


def test_the_picture_is_the_last_period_with_the_links_as_lines():
    experiment = BaseShake(frequency=20.0, own_weight=np.pi)
    record = prb.perform(BEAM, experiment, PrbModel(topology="gauss-chain"))
    fields, displacement = record.fields, record.fields.point_data["displacement"].values
    assert (fields.cell_type, displacement.shape) == (3, (17, len(fields.points), 3))
    assert fields.values == pytest.approx(record["time"][::4])
    # Joints and places are extrapolated each for itself, which differs by what is left of second order.
    assert displacement[:, -1] == pytest.approx(record["tip"][::4], abs=1e-5)
    assert fields.points[-1, 1] < 0  # it sags


def test_a_bar_sags_and_swings_about_where_it_hangs():
    # k q = -m g l / 2 cos q, then I s^2 + b s + k - m g l / 2 sin q about it.
    experiment = BaseShake(frequency=5.0, amplitude=1e-6, own_weight=-np.pi / 2, gravity=200.0, **FINE)
    orbit, moment = orbit_of(bar(), experiment), 0.02 * 200.0 * 0.05
    sag = brentq(lambda q: 0.5 * q + moment * np.cos(q), -1.0, 0.0)
    assert sag < -0.3
    s, inertia = 2j * np.pi * 5.0, 0.02 * (0.1**2 / 3 + 0.01**2 / 12)
    resisting = inertia * s**2 + 4e-3 * s + 0.5 - moment * np.sin(sag)
    answer = -0.02 * 0.05 * np.cos(sag) * s**2 * 1e-6 / resisting * 0.1 * np.cos(sag)
    exact = np.imag(answer * np.exp(s * experiment.times))
    assert orbit.path[:, 0, 2] == pytest.approx(exact, abs=2e-3 * abs(answer))
    assert orbit.joints[:, 0] == pytest.approx(sag, abs=1e-4)


def test_own_weight_without_an_equilibrium_says_so():
    edgewise, experiment = TwistedBeam(twist=0.0), BaseShake(own_weight=np.pi, gravity=5000.0)
    record = prb.perform(edgewise, experiment, PrbModel(topology="gauss-chain"))
    assert record.status == "diverged"
    assert record.reason.startswith("static start: no stable equilibrium beyond")
    batch = Batch(TOPOLOGIES["gauss-chain"])
    assert batch([Request(edgewise, experiment, TOPOLOGIES["gauss-chain"].values(edgewise, {}))]) == [None]
    assert batch.failures == {0: record.reason}


def test_halving_the_step_quarters_the_error():
    def path(step: float) -> np.ndarray:
        model = PrbModel(topology="five-hinge", time_step=step)
        return prb.perform(BEAM, BaseShake(frequency=20.0, samples_per_period=16, **FINE), model)["markers"]

    fine = path(5e-5)
    coarse, finer = (tracking_error(path(step), fine) for step in (1.6e-3, 0.8e-3))
    assert coarse < 0.01
    assert 3.3 < coarse / finer < 4.8


def test_mirror_images_travel_the_other_way():
    experiment, chain = BaseShake(frequency=20.0, tolerance=1e-5), PrbModel(topology="gauss-chain")
    one, other = (
        experiment.reduce(prb.perform(BEAM.model_copy(update={"twist": s * np.pi / 2}), experiment, chain))
        for s in (1, -1)
    )
    assert one["sense"].value == -other["sense"].value != 0
    assert one["minor_axis"].value == pytest.approx(other["minor_axis"].value, rel=1e-4)
    assert one["tilt"].value == pytest.approx(-other["tilt"].value, rel=1e-4)


def test_an_unstable_step_and_a_singular_mechanism_say_so():
    stiff = PrbModel(topology="five-hinge", parameters={"k": 5.0, "b": 1e-4}, time_step=2e-3)
    assert "not stable with a step of" in prb.perform(BEAM, BaseShake(samples_per_period=8), stiff).reason
    flat = prb.perform(TwistedBeam(twist=0.0), BaseShake(), PrbModel(topology="five-hinge"))
    assert flat.status == "unsupported"
