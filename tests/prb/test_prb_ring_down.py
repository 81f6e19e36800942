"""Free decays: closed forms, an independent integration, sampling, mirror law, failures."""

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import prb
from lab.experiments import BaseShake, NaturalModes, RingDown, StaticStiffness
from lab.materials import Material
from lab.measures import dominant_mode, tracking_error
from lab.requests import Request
from lab.specimens import TwistedBeam
from prb.batch import Batch
from prb.experiments.ring_down import load_of
from prb.mechanism import Hinge, Link, Mechanism
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism, to_mjcf
from prb.release import extrapolated, is_stable, release, steps_per_sample
from prb.statics import Chain, hang
from prb.topologies import TOPOLOGIES

X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
BEAM = TwistedBeam(mass=0.00517)
#: The fin is a flat strip that moves in one plane only.
OF_A_TWISTED_BEAM = [
    name for name, declared in TOPOLOGIES.items() if declared.specimen == "TwistedBeam" and name != "buckling-fin"
]


def swing(mechanism: Mechanism, start: np.ndarray, time_step: float, samples: int, stride: int) -> np.ndarray:
    """Joint coordinates of a release, (samples, joints)."""
    model = compile_mechanism(mechanism, (), time_step)
    motion = release([model], [mujoco.MjData(model)], start[None], samples, stride)
    assert motion.completed.all()
    return motion.joints[0]


@pytest.mark.parametrize(
    ("axis", "inertia"), [(X, 0.02 * (0.03**2 + 0.01**2) / 12), (Z, 0.02 * (0.2**2 / 3 + 0.03**2 / 12))]
)
def test_one_hinge_swings_at_its_natural_frequency(axis, inertia):
    bar = Link("bar", 0.2, 0.03, 0.01, 0.02, hinges=(Hinge("h", axis, 0.3, 0.0),))
    expected = np.sqrt(0.3 / inertia) / (2 * np.pi)
    step = 1 / (400 * expected)
    joints = swing(Mechanism((bar,)), np.array([0.1]), step, 400, 4)
    assert dominant_mode(4 * step * np.arange(400), joints)[0] == pytest.approx(expected, rel=1e-4)


def test_a_point_mass_at_the_tip_swings_on_its_arm():
    bar = Link("bar", 0.2, 0.03, 0.01, 1e-9, hinges=(Hinge("h", Z, 0.3, 0.0),))
    expected = np.sqrt(0.3 / (0.05 * 0.2**2)) / (2 * np.pi)
    step = 1 / (400 * expected)
    joints = swing(Mechanism((bar,), tip_mass=0.05), np.array([0.1]), step, 400, 4)
    assert dominant_mode(4 * step * np.arange(400), joints)[0] == pytest.approx(expected, rel=1e-4)


def double_pendulum(time: float, state: np.ndarray, k: float, b: float, m: float, l: float) -> np.ndarray:  # noqa: E741
    """Lagrange's equations of two sprung slender bars in a plane, relative angles."""
    q1, q2, v1, v2 = state
    c, s, centre = np.cos(q2), np.sin(q2), m * l**2 / 12
    a = m * l**2 / 4 + centre
    mass = np.array([[2 * a + m * l**2 * (1 + c), a + m * l**2 / 2 * c], [a + m * l**2 / 2 * c, a]])
    h = m * l**2 / 2 * s
    forces = np.array([-k * q1 - b * v1 + h * (2 * v1 * v2 + v2**2), -k * q2 - b * v2 - h * v1**2])
    return np.concatenate([[v1, v2], np.linalg.solve(mass, forces)])


def test_a_double_pendulum_agrees_with_its_equations():
    k, b, m, length = 0.3, 2e-4, 0.01, 0.1
    links = tuple(Link(f"bar{i}", length, 1e-6, 1e-6, m, hinges=(Hinge(f"h{i}", Z, k, b),)) for i in range(2))
    start, samples, step = np.array([0.9, -0.6]), 60, 2e-5
    joints = swing(Mechanism(links), start, step, samples, 200)
    times = 200 * step * np.arange(samples)
    args, tolerances = (k, b, m, length), {"rtol": 1e-9, "atol": 1e-11}
    exact = solve_ivp(double_pendulum, (0, times[-1]), [*start, 0, 0], t_eval=times, args=args, **tolerances).y[:2].T
    assert tracking_error(joints[:, None], exact[:, None]) < 2e-3


@pytest.mark.parametrize("topology", OF_A_TWISTED_BEAM)
def test_halving_the_step_quarters_the_error(topology):
    def run(step: float) -> np.ndarray:
        return prb.perform(BEAM, RingDown(), PrbModel(topology=topology, time_step=step))["markers"]

    fine = run(4e-5)
    coarse, finer = (tracking_error(run(step), fine) for step in (4e-4, 2e-4))
    assert coarse < 1e-3
    assert 3.3 < coarse / finer < 4.8


@pytest.mark.parametrize(
    ("rate", "step", "stride"), [(360.0, 0.25e-3, 12), (360.0, 1 / 3600, 10), (1000.0, 1e-3, 1), (100.0, 1.0, 1)]
)
def test_samples_are_whole_steps_apart(rate, step, stride):
    assert steps_per_sample(rate, step) == stride
    assert 1 / (rate * stride) <= max(step, 1 / rate) * (1 + 1e-9)


def test_sampling_does_not_shift_the_motion():
    # Every third sample of the fast recording is a sample of the slow one, at the same step length.
    slow, fast = RingDown(rate=360.0, duration=0.1), RingDown(rate=1080.0, duration=0.1)
    one = prb.perform(BEAM, slow, PrbModel(topology="five-hinge", time_step=1 / 4320))
    other = prb.perform(BEAM, fast, PrbModel(topology="five-hinge", time_step=1 / 4320))
    assert one["time"] == pytest.approx(other["time"][::3])
    assert one["markers"] == pytest.approx(other["markers"][::3], abs=1e-12)


@pytest.mark.parametrize("topology", OF_A_TWISTED_BEAM)
def test_the_record_starts_at_the_static_equilibrium(topology):
    experiment = RingDown(direction=0.7)
    record = prb.perform(BEAM, experiment, PrbModel(topology=topology))
    chain = Chain(compile_mechanism(PrbModel(topology=topology).mechanism(BEAM).in_motion, experiment.markers))
    chain.tip(hang(chain, load_of(experiment)))
    rest = np.array([BEAM.length, 0, 0])
    assert record["time"][0] == 0
    assert record["tip"][0] == pytest.approx(chain.data.site_xpos[0] - rest, abs=1e-15)
    places = chain.data.site_xpos[1:] - rest - np.array(experiment.markers)
    assert record["markers"][0] == pytest.approx(places, abs=1e-15)


def test_the_published_start_deflections_of_the_prototype():
    # Prototype, root flat: 19.3 mm under a load along y, 11.2 mm along z, and 6 to 7 mm across.
    flat = BEAM.model_copy(update={"root_angle": np.pi / 2})
    tips = [prb.perform(flat, RingDown(direction=d), PrbModel(topology="five-hinge"))["tip"][0] for d in (0, np.pi / 2)]
    assert [abs(tips[0][1]), abs(tips[1][2])] == pytest.approx([19.3e-3, 11.2e-3], abs=1e-4)


def test_channels_fields_and_how():
    record = prb.perform(BEAM, RingDown(), PrbModel(topology="gauss-chain"))
    assert {n: (c.values.shape, c.dims) for n, c in record.channels.items()} == {
        "time": ((91,), ("time",)),
        "markers": ((91, 3, 3), ("time", "marker", "axis")),
        "tip": ((91, 3), ("time", "axis")),
    }
    fields = record.fields
    assert fields.cell_type == 3
    assert fields.values[0] == 0
    assert fields.values[-1] == pytest.approx(0.06, abs=1 / 360)
    displacement = fields.point_data["displacement"].values
    assert displacement.shape == (len(fields.values), len(fields.points), 3)
    shown = np.searchsorted(record["time"], fields.values)
    # Joints and places are extrapolated each for itself, which differs by what is left of second order.
    assert displacement[:, -1] == pytest.approx(record["tip"][shown], abs=1e-5)
    assert displacement[:, 0] == pytest.approx(0)
    assert record.how["time_step"] <= 0.5e-3
    assert record.how["seconds_per_10_s"] > 0
    assert set(record.how["parameters"]) == {"E", "GJ", "tau", "tau_t"}


@pytest.mark.parametrize("topology", OF_A_TWISTED_BEAM)
@pytest.mark.parametrize(("direction", "mirrored"), [(0.0, np.pi), (np.pi / 2, np.pi / 2), (0.5, np.pi - 0.5)])
def test_mirrored_beams_move_as_mirror_images(topology, direction, mirrored):
    markers = ((0.0, 0.01, 0.0), (0.0, -0.01, 0.0), (0.0, 0.0, 0.01))
    model = PrbModel(topology=topology)
    one = prb.perform(BEAM, RingDown(direction=direction, markers=markers), model)
    reflected = TwistedBeam(mass=0.00517, twist=-BEAM.twist)
    swapped = RingDown(direction=mirrored, markers=(markers[1], markers[0], markers[2]))
    other = prb.perform(reflected, swapped, model)
    assert other["markers"] == pytest.approx(one["markers"] * (1, -1, 1), abs=1e-9)


def test_the_mjcf_text_gives_the_same_motion():
    experiment, model = RingDown(), PrbModel(topology="five-hinge")
    mechanism, stride = model.mechanism(BEAM), steps_per_sample(experiment.rate, model.time_step)
    text = to_mjcf(mechanism, experiment.markers, 1 / (experiment.rate * stride))
    loaded = mujoco.MjModel.from_xml_string(text)
    start = hang(Chain(loaded), load_of(experiment))
    motion = extrapolated([loaded], [mujoco.MjData(loaded)], start[None], experiment.samples, stride)
    rest = np.array([BEAM.length, 0, 0]) + np.array(experiment.markers)
    markers = motion.positions[0, :, 1:] - rest
    assert tracking_error(markers, prb.perform(BEAM, experiment, model)["markers"]) < 1e-4


@pytest.mark.parametrize("topology", OF_A_TWISTED_BEAM)
def test_the_batch_equals_single_records(topology):
    experiments = [RingDown(direction=d, load_mass=0.05) for d in (np.pi / 4, np.pi / 2)]
    nominal = TOPOLOGIES[topology].values(BEAM, {})
    candidates = [{name: share * value for name, value in nominal.items()} for share in (1.0, 0.8, 1.2)]
    requests = [Request(BEAM, e, values) for values in candidates for e in experiments]
    batch = Batch(TOPOLOGIES[topology])
    batch(requests[::-1])  # models are edited: nothing of earlier candidates may remain
    for request, response in zip(requests, batch(requests), strict=True):
        model = PrbModel(topology=topology, parameters=dict(request.values))
        record = prb.perform(BEAM, request.experiment, model)
        assert response["markers"] == pytest.approx(record["markers"], abs=1e-12)


def five_hinges(*values: tuple[float, float, float]) -> list[Request]:
    return [Request(BEAM, RingDown(), dict(zip(("k", "b", "l2"), row, strict=True))) for row in values]


def test_threads_do_not_change_the_batch():
    requests = five_hinges(*np.outer(np.linspace(0.5, 2, 9), [0.34, 0.0029, 0.02]).tolist())
    one, two = (Batch(TOPOLOGIES["five-hinge"], threads=n)(requests) for n in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert np.array_equal(a["markers"], b["markers"])


def test_failed_candidates_are_none_and_leave_the_others_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    batch = Batch(TOPOLOGIES["five-hinge"], time_step=2e-3)
    good, unstable, impossible = batch(five_hinges((0.34, 0.0029, 0.02366), (5.0, 1e-4, 0.02366), (0.34, 0.0029, 0.06)))
    assert np.isfinite(good["markers"]).all()
    assert unstable is impossible is None
    assert batch.failures == {
        1: "the motion is not stable with a step of 1.39 ms; shorten time_step",
        2: "body link1: mass -0.001034 kg must be positive",
    }
    assert not list(tmp_path.iterdir())  # MuJoCo's log file


def test_an_unstable_step_is_a_diverged_record():
    model = PrbModel(topology="five-hinge", parameters={"k": 5.0, "b": 1e-4}, time_step=2e-3)
    record = prb.perform(BEAM, RingDown(), model)
    assert record.status == "diverged"
    assert record.reason == "the motion is not stable with a step of 1.39 ms; shorten time_step"


def test_the_stability_limit_is_that_of_the_oscillator():
    # Undamped: h < 2 / omega.
    bar = Link("bar", 0.2, 0.03, 0.01, 0.02, hinges=(Hinge("h", Z, 0.3, 0.0),))
    limit = 2 / np.sqrt(0.3 / (0.02 * (0.2**2 / 3 + 0.03**2 / 12)))
    for factor in (0.99, 1.01):
        model = compile_mechanism(Mechanism((bar,)), (), factor * limit)
        assert is_stable(model, mujoco.MjData(model), np.zeros(1)) == (factor < 1)


def test_a_batch_takes_experiments_of_any_kind_and_sampling():
    specimens = [BEAM, TwistedBeam(mass=0.00517, twist=1.0)]
    one_marker = RingDown(rate=100.0, markers=((0.0, 0.0, 0.01),))
    experiments = [
        StaticStiffness(increments=1),
        BaseShake(),
        NaturalModes(),
        RingDown(),
        one_marker,
        RingDown(direction=1.0),
    ]
    batch, chain = Batch(TOPOLOGIES["gauss-chain"]), PrbModel(topology="gauss-chain")
    requests = [Request(s, e, chain.values(s)) for s in specimens for e in experiments]
    for request, response in zip(requests, batch(requests), strict=True):
        record = prb.perform(request.specimen, request.experiment, chain)
        assert set(response) < set(record.channels)
        for name, values in response.items():
            assert values == pytest.approx(record[name], abs=1e-10)


def test_the_declared_topologies_are_those_that_were_python():
    # Tip of the plain release (steps of 0.25 ms) by the code that the YAML files replaced, m.
    material = Material(youngs_modulus=61e6, viscous_time=3e-3)
    beam = TwistedBeam(length=0.08, width=0.015, thickness=0.002, twist=-1.1, root_angle=0.4, material=material)
    known = {
        "five-hinge": (0.009042736211858218, 6.277840681031594e-05, -0.00020987703520192153),
        "gauss-chain": (0.03899643500358718, 0.005357091007777806, -0.025316820349860655),
    }
    for topology, (start_y, later_y, later_z) in known.items():
        experiment = RingDown(direction=0.7)
        model = compile_mechanism(
            PrbModel(topology=topology).mechanism(beam).in_motion, experiment.markers, 1 / (360 * 12)
        )
        start = hang(Chain(model), load_of(experiment))
        tip = release([model], [mujoco.MjData(model)], start[None], experiment.samples, 12).positions[0, :, 0]
        assert tip[0, 1] == pytest.approx(start_y, rel=1e-12)
        assert tip[15, 1:] == pytest.approx([later_y, later_z], rel=1e-9)


@pytest.mark.parametrize("topology", ["five-hinge", "five-hinge-anisotropic"])
def test_an_untwisted_beam_on_coincident_hinges_is_refused(topology, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flat = TwistedBeam(twist=0.0)
    record = prb.perform(flat, RingDown(), PrbModel(topology=topology))
    assert record.status == "unsupported"
    assert "parallel hinges at one place" in record.reason
    declared = TOPOLOGIES[topology]
    batch = Batch(declared)
    assert batch([Request(flat, RingDown(), declared.values(flat, {}))]) == [None]
    assert "parallel hinges at one place" in batch.failures[0]
    assert not list(tmp_path.iterdir())  # MuJoCo's log file


def test_an_untwisted_chain_moves_flatwise_and_buckles_edgewise():
    flat, chain = TwistedBeam(twist=0.0), PrbModel(topology="gauss-chain")
    assert prb.perform(flat, RingDown(direction=np.pi / 2), chain).completed
    record = prb.perform(flat, RingDown(), chain)
    assert record.status == "diverged"
    assert record.reason.startswith("static start: no stable equilibrium beyond 79")
