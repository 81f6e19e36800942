"""Young's modulus from stiffness tables, and the ranking of their readings."""

import itertools

import numpy as np
import pytest

import prb
from calibrate.modulus import fit_modulus, row_scales
from calibrate.readings import look_up, rank_readings
from calibrate.spec import FORCE_ENTRIES
from lab.experiments import StaticStiffness
from lab.materials import Material
from lab.records import Record, Scalar
from lab.specimens import TwistedBeam
from prb.model import PrbModel

E0, TWISTS = 26e6, (0.0, 45.0, -45.0, 90.0, -90.0)
RIGS = (1e3, 3e3, 1e4, 3e4, None)


def stiffness(twist: float, root: float = 0.0, rig: float | None = None, modulus: float = E0) -> Record:
    """K' of the chain, which scales with E as any elastic body does."""
    specimen = TwistedBeam(
        twist=np.deg2rad(twist), root_angle=np.deg2rad(root), material=Material(youngs_modulus=modulus)
    )
    experiment = StaticStiffness(rig_stiffness=rig, increments=2)
    record = prb.perform(specimen, experiment, PrbModel(topology="gauss-chain"))
    assert record.completed
    return Record(**{**vars(record), "scalars": experiment.reduce(record)})


def numbers(record: Record) -> dict[str, float]:
    return {name: scalar.value for name, scalar in record.scalars.items()}


def test_a_known_modulus_comes_back():
    records = [stiffness(phi) for phi in (0.0, 90.0)]
    lab = [stiffness(phi, modulus=71e6).scalars for phi in (0.0, 90.0)]
    result = fit_modulus(records, lab, used=("0 deg", "90 deg"))
    assert result.values() == pytest.approx({"youngs_modulus": 71e6})
    assert result.objective == pytest.approx(0, abs=1e-8)
    assert result.parameters[0].standard_error < 1
    assert result.used == ("0 deg", "90 deg")


def test_scatter_gives_a_standard_error():
    record = stiffness(90.0)
    rng, exact = np.random.default_rng(4), {e: 2 * record.scalars[e].value for e in FORCE_ENTRIES}
    sizes = 0.05 * row_scales(exact, FORCE_ENTRIES)
    errors, found = [], []
    for _ in range(200):
        noise = sizes * rng.standard_normal(len(sizes))
        row = {entry: exact[entry] + error for entry, error in zip(FORCE_ENTRIES, noise, strict=True)}
        result = fit_modulus([record], [row])
        found.append(result.values()["youngs_modulus"])
        errors.append(result.parameters[0].standard_error)
    assert np.mean(found) == pytest.approx(2 * E0, rel=0.01)
    assert np.mean(errors) == pytest.approx(np.std(found), rel=0.3)


def test_one_entry_has_no_standard_error():
    result = fit_modulus([stiffness(0.0)], [{"n_xx": Scalar(0.1, "N*m/rad")}], ["n_xx"])
    assert result.to_json()["parameters"][0]["standard_error"] is None


def test_couplings_are_measured_by_the_largest_stiffness():
    row = {"k_yy": 5504.72, "k_yz": 28.19, "k_zy": 10.79, "k_zz": 559.69, "n_xx": 0.10}
    assert row_scales(row, FORCE_ENTRIES).tolist() == [5504.72] * 4 + [0.10]


def test_a_compliant_rig_is_refused():
    with pytest.raises(ValueError, match="on a rigid rig only"):
        fit_modulus([stiffness(0.0, rig=1e4)], [dict.fromkeys(FORCE_ENTRIES, 1.0)])


@pytest.fixture(scope="module")
def table():
    """K' at E0 of the flat-clamped beams, over rigs."""
    return {(phi, 0.0, rig): numbers(stiffness(phi, 0.0, rig)) for phi, rig in itertools.product(TWISTS, RIGS)}


@pytest.mark.parametrize(
    ("twist", "root", "missing"), [(45.0, 90.0, ()), (-90.0, 0.0, (-90.0,)), (-45.0, 90.0, (-45.0,))]
)
def test_images_of_a_beam_are_found_by_symmetry(table, twist, root, missing):
    less = {key: row for key, row in table.items() if key[0] not in missing}
    found, exact = look_up(less, twist, root, None), numbers(stiffness(twist, root))
    assert [found[e] for e in FORCE_ENTRIES] == pytest.approx([exact[e] for e in FORCE_ENTRIES], rel=1e-6)


def test_a_turned_beam_stands_for_a_flat_one():
    turned = {(45.0, 90.0, None): numbers(stiffness(45.0, 90.0))}
    found, exact = look_up(turned, -45.0, 0.0, None), numbers(stiffness(-45.0, 0.0))
    assert [found[e] for e in FORCE_ENTRIES] == pytest.approx([exact[e] for e in FORCE_ENTRIES], rel=1e-6)


def test_a_beam_without_image_is_named(table):
    with pytest.raises(ValueError, match="twist of 30 deg, a root angle of 0 deg and a rigid rig"):
        look_up(table, 30.0, 0.0, None)


@pytest.mark.parametrize(("mount", "sense"), itertools.product((0.0, 90.0), (1, -1)))
@pytest.mark.parametrize("rig", [None, 12e3])
def test_a_planted_reading_wins(table, mount, sense, rig):
    modulus = 80e6
    lab = {phi: numbers(stiffness(sense * phi, mount if abs(phi) == 45 else 0.0, rig, modulus)) for phi in TWISTS}
    ranked = rank_readings(table, lab, E0)
    assert len(ranked) == 8
    assert [r.misfit for r in ranked] == sorted(r.misfit for r in ranked)
    best = ranked[0]
    assert (best.mount_angle, best.twist_sense) == (mount, sense)
    assert best.youngs_modulus == pytest.approx(modulus, rel=0.02)
    assert best.misfit < 0.01
    assert ranked[2].misfit > 5 * best.misfit  # the second one differs at most by the rig
    if rig is not None:
        assert best.compliant_rig
        assert not best.at_edge
        assert best.rig_stiffness == pytest.approx(rig, rel=0.1)
    else:
        compliant = next(r for r in ranked[:2] if r.compliant_rig)
        assert compliant.rig_stiffness is None or compliant.rig_stiffness > 1e6


def test_a_rigid_table_gives_rigid_readings_only(table):
    rigid = {key: row for key, row in table.items() if key[2] is None}
    ranked = rank_readings(rigid, {90.0: rigid[90.0, 0.0, None]}, E0)
    assert len(ranked) == 4
    assert not any(r.compliant_rig for r in ranked)
    assert set(ranked[0].row_misfits) == {90.0}


def test_an_optimum_at_the_softest_rig_is_marked(table):
    lab = {phi: numbers(stiffness(phi, rig=200.0)) for phi in TWISTS}
    best = next(r for r in rank_readings(table, lab, E0) if r.compliant_rig)
    assert best.at_edge
