"""Equilibria against closed forms, derivatives against finite differences, compliance against beam theory."""

import numpy as np
import pytest

import prb
from lab.experiments import RingDown, StaticStiffness
from lab.materials import Material
from lab.specimens import TwistedBeam
from prb.mechanism import Hinge, Link, Mechanism
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.specimen_numbers import specimen_class
from prb.statics import Chain, Load, NotConverged, hang, hold, tip_compliance
from prb.topologies import TOPOLOGIES

Z = (0.0, 0.0, 1.0)


def gauss_chain(specimen: TwistedBeam, stations: int) -> Mechanism:
    return PrbModel(topology="gauss-chain", settings={"stations": stations}).mechanism(specimen)


def chain_of(mechanism: Mechanism) -> Chain:
    return Chain(compile_mechanism(mechanism))


def one_hinge(stiffness: float = 0.5, length: float = 0.1) -> Chain:
    return chain_of(Mechanism((Link("bar", length, 0.01, 0.01, 0.01, hinges=(Hinge("h", Z, stiffness, 0.0),)),)))


def chain_and_posture(topology: str, seed: int = 0) -> tuple[Chain, np.ndarray]:
    model = PrbModel(topology=topology)
    beam = model.topology.specimen == "TwistedBeam"
    specimen = TwistedBeam(twist=1.2, root_angle=0.3) if beam else specimen_class(model.topology.specimen)()
    chain = chain_of(model.mechanism(specimen))
    joints = 0.4 * np.random.default_rng(seed).standard_normal(chain.laws.count)
    return chain, np.where(chain.model.jnt_type == 2, 0.005 * joints, joints)


@pytest.mark.parametrize("force", [0.5, 5.0, 500.0])
def test_a_bar_on_a_spring_turns_as_its_equation_says(force):
    # k q = F l cos q, up to a bar that nearly points along the force.
    joints = hang(one_hinge(), Load(np.array([0.0, force, 0.0])))
    assert 0.5 * joints[0] == pytest.approx(force * 0.1 * np.cos(joints[0]), rel=1e-9)
    assert 0 < joints[0] < np.pi / 2


def test_a_load_path_that_ends_says_so():
    # A compressed bar buckles at F = k / l: beyond it the straight state is unstable, and Newton stays on it.
    with pytest.raises(NotConverged, match="no stable equilibrium beyond 9[89]"):
        hang(one_hinge(), Load(np.array([-0.5 / 0.1 * 1.01, 0.0, 0.0])))


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_geometric_stiffness_is_the_derivative_of_the_joint_loads(topology):
    chain, joints = chain_and_posture(topology)
    force, moment, step = np.array([0.3, -1.0, 0.7]), np.array([0.02, 0.05, -0.03]), 1e-6

    def loads(q: np.ndarray) -> np.ndarray:
        return chain.tip(q).jacobian.T @ np.concatenate([force, moment])

    differences = [(loads(joints + step * e) - loads(joints - step * e)) / (2 * step) for e in np.eye(len(joints))]
    assert chain.tip(joints).geometric_stiffness(force, moment) == pytest.approx(np.column_stack(differences), abs=1e-8)


def test_the_force_is_the_gradient_of_the_energy():
    chain = chain_of(PrbModel(topology="five-hinge").mechanism(TwistedBeam()))
    force = np.array([0.1, 1.5, -1.0])
    up, down = (hang(chain, Load((1 + sign * 1e-4) * force)) for sign in (1, -1))
    work = force @ (chain.tip(up).position - chain.tip(down).position)
    assert chain.energy(up) - chain.energy(down) == pytest.approx(work, rel=1e-7)


def test_a_held_tip_arrives_and_its_wrench_is_the_gradient_of_the_energy():
    chain = chain_of(PrbModel(topology="gauss-chain").mechanism(TwistedBeam()))
    motion = np.array([1e-4, 2e-3, -1e-3, 0.1, 0.02, -0.03])
    held = hold(chain, motion)
    tip = chain.tip(held.joints)
    assert tip.position - [0.05, 0, 0] == pytest.approx(motion[:3], abs=1e-10)
    step, gradient = 1e-6, []
    for i in range(3):
        there, back = (hold(chain, motion + s * step * np.eye(6)[i], held) for s in (1, -1))
        gradient.append((chain.energy(there.joints) - chain.energy(back.joints)) / (2 * step))
    assert held.wrench[:3] == pytest.approx(gradient, rel=1e-5)


def test_the_held_tip_turns_as_the_rotation_vector_says():
    from scipy.spatial.transform import Rotation

    chain = chain_of(PrbModel(topology="gauss-chain").mechanism(TwistedBeam()))
    motion = np.array([0, 0, 0, 0.2, 0.1, -0.05])
    rotation = chain.tip(hold(chain, motion).joints).rotation
    assert Rotation.from_matrix(rotation).as_rotvec() == pytest.approx(motion[3:], abs=1e-9)


def test_moment_about_x_at_rest_is_torsional_stiffness():
    specimen = TwistedBeam(twist=0.0)
    model = PrbModel(topology="gauss-chain")
    held = hold(chain_of(model.mechanism(specimen)), np.array([0, 0, 0, 0.1, 0, 0]))
    assert held.wrench[3] == pytest.approx(0.1 * model.values(specimen)["GJ"] / specimen.length, rel=1e-9)


@pytest.mark.parametrize("twist", [0.0, 45.0, 90.0, -90.0])
@pytest.mark.parametrize("topology", ["five-hinge", "five-hinge-anisotropic"])
def test_five_hinges_reach_four_directions(topology, twist):
    specimen = TwistedBeam(twist=np.deg2rad(twist))
    rank = tip_compliance(chain_of(PrbModel(topology=topology).mechanism(specimen)))[1]
    # Untwisted, all bending axes are parallel (and R1 and R2 the same): y, rotation about z, and torsion.
    assert rank == (3 if twist == 0.0 else 4)


def kirchhoff_compliance(specimen: TwistedBeam, values: dict[str, float]) -> np.ndarray:
    """Tip compliance of a Kirchhoff rod that can stretch, by fine quadrature, (6, 6): u, then rotations."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    places, weights = (nodes + 1) * specimen.length / 2, weights * specimen.length / 2
    width, thickness, modulus = specimen.width, specimen.thickness, values["E"]
    flexibility = np.diag(
        [1 / values["GJ"], 12 / (modulus * width * thickness**3), 12 / (modulus * thickness * width**3)]
    )
    total = np.zeros((6, 6))
    for s, w in zip(places, weights, strict=True):
        a = specimen.section_angle(s)
        frame = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        arm = specimen.length - s
        # A turn t of the section moves the tip by t x (arm, 0, 0).
        motion = np.vstack([[[0, 0, 0], [0, 0, arm], [0, -arm, 0]], np.eye(3)])
        total += w * motion @ frame @ flexibility @ frame.T @ motion.T
        total[0, 0] += w / (modulus * width * thickness)
    return total


def principal(compliance: np.ndarray) -> np.ndarray:
    """Principal lateral stiffnesses with rotations held, soft and stiff, N/m."""
    return np.linalg.eigvalsh(np.linalg.inv(compliance)[1:3, 1:3])


@pytest.mark.parametrize(("twist", "count", "tolerance"), [(0, 3, 1e-9), (45, 3, 0.01), (90, 3, 0.05), (90, 4, 0.002)])
def test_the_chain_agrees_with_beam_theory(twist, count, tolerance):
    specimen = TwistedBeam(twist=np.deg2rad(twist))
    values = PrbModel(topology="gauss-chain").values(specimen)
    compliance, rank = tip_compliance(chain_of(gauss_chain(specimen, count)))
    assert rank == 6
    assert principal(compliance) == pytest.approx(principal(kirchhoff_compliance(specimen, values)), rel=tolerance)


def test_a_strip_buckles_sideways_at_the_load_of_the_textbook():
    # F = 4.013 sqrt(E I GJ) / L^2 (Timoshenko & Gere, 6.3); lumped hinges come to it from below.
    strip = TwistedBeam(twist=0.0)
    values = PrbModel(topology="gauss-chain").values(strip)
    bending = values["E"] * strip.width * strip.thickness**3 / 12
    textbook = 4.013 * np.sqrt(bending * values["GJ"]) / strip.length**2
    chain = chain_of(gauss_chain(strip, 20).in_motion)
    assert np.abs(hang(chain, Load(np.array([0.0, 0.94 * textbook, 0.0])))).max() < 0.5
    with pytest.raises(NotConverged):
        hang(chain, Load(np.array([0.0, 1.03 * textbook, 0.0])))


# Shell elements on the quick study's mesh, E = 48 MPa, nu = 0.45: N/m and N*m/rad (K' of 5 mm and 15 deg).
FEA_TABLE = {
    0.0: {"k_yy": 6471, "k_zz": 479.3, "n_xx": 0.0691},
    45.0: {"k_yy": 3329, "k_yz": 869, "k_zy": 954, "k_zz": 1313, "n_xx": 0.0928},
    90.0: {"k_yy": 1815, "k_yz": -334, "k_zy": -334, "k_zz": 1815, "n_xx": 0.154},
}


@pytest.mark.parametrize("twist", FEA_TABLE)
def test_the_strip_has_the_stiffness_of_finite_elements_with_nothing_fitted(twist):
    beam = TwistedBeam(twist=np.deg2rad(twist), material=Material(youngs_modulus=48e6))
    experiment = StaticStiffness(increments=3)
    found = experiment.reduce(prb.perform(beam, experiment, PrbModel(topology="gauss-strip")))
    for entry, expected in FEA_TABLE[twist].items():
        assert found[entry].value == pytest.approx(expected, rel=0.18 if entry == "n_xx" else 0.08), entry


#: Mean marker (y, z) in mm under a mass (kg) along the direction (deg) and at the place (m), by the same shells.
FEA_STARTS = [
    ({}, 0.0, (0.0, 0.0, 0.0), 0.2, (8.28, -10.03)),
    ({}, 0.0, (0.0, 0.0, 0.008), 0.2, (8.80, -10.96)),
    ({}, 0.0, (0.0, 0.0, -0.008), 0.2, (7.58, -9.13)),
    ({}, 45.0, (0.0, 0.0, 0.0), 0.2, (-1.35, 13.23)),
    ({}, 90.0, (0.0, 0.0, 0.0), 0.2, (-7.07, 22.78)),
    ({}, 135.0, (0.0, 0.0, 0.0), 0.2, (-9.88, 20.93)),
    ({"twist": np.pi / 4}, 45.0, (0.0, 0.0, 0.0), 0.2, (-1.42, 17.47)),
    ({"twist": np.pi / 4}, 0.0, (0.0, 0.0, 0.008), 0.2, (3.35, -6.52)),
    ({"thickness": 0.002}, 0.0, (0.0, 0.0, 0.008), 0.06, (8.43, -11.22)),
    ({"thickness": 0.002}, 135.0, (0.0, 0.0, 0.0), 0.06, (-9.56, 20.97)),
    ({"length": 0.08}, 0.0, (0.0, 0.0, 0.0), 0.08, (13.59, -16.18)),
    ({"length": 0.08}, 90.0, (0.0, 0.0, 0.0), 0.08, (-11.42, 36.89)),
]


@pytest.mark.parametrize(("change", "direction", "place", "mass", "expected"), FEA_STARTS)
def test_the_strip_bends_as_finite_elements_do_with_nothing_fitted(change, direction, place, mass, expected):
    beam = TwistedBeam(**change, mass=0.00517, material=Material(youngs_modulus=48e6))
    experiment = RingDown(direction=np.deg2rad(direction), load_place=place, load_mass=mass, duration=0.01)
    start = 1e3 * prb.perform(beam, experiment, PrbModel(topology="gauss-strip"))["markers"][0].mean(axis=0)[1:]
    assert start == pytest.approx(expected, abs=0.07 * np.linalg.norm(expected))
