"""Arms of pinched tubes: one tube by hand, MuJoCo's own rest, symmetry of the workspace."""

import importlib.util
import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from lab.specimens import PinchedTube
from prb.arm import Arm, Cable
from prb.hinge_curves import COLUMNS, HingeCurves, HingeTable
from prb.model import PrbModel

TUBE = PinchedTube()
SOFT, STIFF, REACH = 0.4, 1.5, 0.045
ROOT = Path(__file__).resolve().parents[2]


def curves() -> HingeCurves:
    """10 N*m/rad open; closed ``SOFT`` and ``STIFF``, 10 mm shorter."""
    given = {
        "travel": (0, 0.04), "force": (0, 10), "bend_mean": (10, (SOFT + STIFF) / 2), "torsion": (5, 2),
        "bend_along": (0, (STIFF - SOFT) / 2), "lever": (0.05, REACH), "shortening": (0, 0.01),
        "give_across": (1e-4, 1e-4), "give_along": (1e-4, 1e-4),
    }  # fmt: skip
    columns = {name: given.get(name, (0.0, 0.0)) for name in COLUMNS}
    tables = tuple(HingeTable(pinch_angle=a, touches=True, columns=columns) for a in (0.0, np.pi / 3))
    return HingeCurves(pairs=3, shares=(0.0, 1.0), tables=tables, specimen=TUBE.model_dump(mode="json"))


MODEL = PrbModel(topology="tube-three-axis", hinge=curves())


def test_one_tube_bends_as_two_lines_by_hand_say():
    weight, arm = 0.2 * 9.81, REACH + TUBE.block_length
    turn = brentq(lambda t: SOFT * t - weight * arm * np.cos(t), 0.0, 1.5)
    light = TUBE.model_copy(update={"material": TUBE.material.model_copy(update={"density": 1e-6})})
    tip = Arm(light, MODEL, count=1, payload=0.2).rest([0.0]).tip
    assert tip == pytest.approx([0, -arm * np.sin(turn), REACH + arm * np.cos(turn)], abs=1e-8)


def test_the_cable_bends_by_tension_times_its_arm():
    # Along both faces of a block the cable is straight: a small pull's moment is tension times offset.
    cable = Cable(0.02, -np.pi / 2, 1e-3)
    pose = Arm(TUBE, MODEL, count=1, gravity=(0, 0, 0), cable=cable).rest([0.0])
    assert pose.joints[0] == pytest.approx(1e-3 * 0.02 / SOFT, rel=1e-3)
    assert np.abs(pose.joints[1:]).max() < 1e-9


@pytest.mark.parametrize("cable", [None, Cable(0.02, -1.0, 2.0)])
def test_mujoco_s_own_motion_comes_to_the_same_rest(cable):
    arm = Arm(TUBE, MODEL, count=2, block_mass=0.01, payload=0.02, cable=cable)
    choices = [0.0, np.deg2rad(120.0)]
    model = mujoco.MjModel.from_xml_string(arm.to_mjcf(choices, 1e-3))
    model.dof_damping[:] = 0.02
    data = mujoco.MjData(model)
    data.ctrl[:] = -2.0
    for _ in range(8000):
        mujoco.mj_step(model, data)
    assert np.abs(data.qvel).max() < 1e-6
    assert data.site("tip").xpos == pytest.approx(arm.rest(choices).tip, abs=2e-6)


def test_the_workspace_of_a_vertical_arm_turns_with_its_pads():
    # Without side loads of its own a cable at another pad pulls the same arm, turned by 60 degrees.
    options = [None, *np.deg2rad([0.0, 120.0, 240.0])]
    sets = []
    for angle in (-np.pi / 2, -np.pi / 6):
        arm = Arm(TUBE, MODEL, count=2, gravity=(0, 0, -9.81), block_mass=0.01, cable=Cable(0.02, angle, 1.0))
        combinations, tips = arm.workspace(options)
        assert len(tips) == len(combinations) == 16
        sets.append(tips)
    turned = np.exp(1j * np.pi / 3) * (sets[0][:, 0] + 1j * sets[0][:, 1])
    there = sets[1][:, 0] + 1j * sets[1][:, 1]
    assert np.abs(turned[:, None] - there).min(axis=1) == pytest.approx(0.0, abs=1e-7)
    assert len(np.unique(there.round(6))) == 16


def test_a_posture_that_falls_is_a_hole_in_the_workspace():
    arm = Arm(TUBE, MODEL, count=1, payload=2.0, gravity=(0, 0, -9.81))
    combinations, tips = arm.workspace([None, 0.0])
    assert combinations == [(None,), (0.0,)]
    assert np.isfinite(tips[0]).all()
    assert np.isnan(tips[1]).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arm(TUBE, MODEL, count=0), "count 0 must be at least 1"),
        (lambda: Arm(TUBE, MODEL, payload=-1.0), "must not be negative"),
        (lambda: Arm(TUBE, MODEL, cable=Cable(0.05, 0.0, 1.0)), "cable radius 0.05 m must lie within the block"),
        (lambda: Arm(TUBE, MODEL, count=2).rest([0.0]), "1 choices for 2 tubes"),
        (lambda: Arm(TUBE, PrbModel(topology="tube-shear"), count=1).rest([0.0]), "a pinched tube needs a model"),
    ],
)
def test_what_cannot_be_built_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_the_example_writes_a_workspace_and_an_arm(tmp_path):
    path = ROOT / "examples" / "snake_arm.py"
    spec = importlib.util.spec_from_file_location("snake_arm", path)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    (tmp_path / "hinge.json").write_text(json.dumps({"hinge": curves().model_dump(mode="json")}))
    found = example.main(tmp_path / "hinge.json", tmp_path, [None, 0.0])
    assert [tips.shape for tips in found.values()] == [(1, 8, 3), (3, 8, 3)]
    assert (tmp_path / "workspace.png").stat().st_size > 10_000
    assert len((tmp_path / "workspace.csv").read_text().splitlines()) == 33
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    # The cable, and a tendon for either side of the knees of three soft and three stiff springs.
    assert (model.ntendon, model.nu, model.nbody) == (13, 1, 7)
    (tmp_path / "failed.json").write_text(json.dumps({"reason": "no reference"}))
    with pytest.raises(SystemExit, match="no result of a fit of kind hinge: no reference"):
        example.main(tmp_path / "failed.json", tmp_path, [None])
