"""Clamped tip moved as a rigid body."""

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiments import StaticStiffness
from lab.records import Channel, Record, Scalar, channels
from lab.specimens import Specimen
from prb.experiments.common import DOFS, heading, how
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain, Held, NotConverged, is_sprung, move, tip_compliance

Array = NDArray[np.float64]
_RIGID_MOTIONS = 6
_LOOSE = "a joint has no spring at rest, so the tip has no stiffness; give every joint a spring"


@dataclass(frozen=True)
class _Row:
    """One recorded increment."""

    leg: int
    motion: Array
    pose: Array
    wrench: Array


def static_stiffness(specimen: Specimen, experiment: StaticStiffness, model: PrbModel) -> Record:
    """Wrench against the motion of a held tip.

    Returns
    -------
    record
        Channels ``increment``, ``leg``, and ``motion``, ``pose``, ``wrench`` of shape
        (increments, 6) in m, rad, N and N*m; ``tangent_stiffness`` (6, 6) at rest, rig included;
        ``tip_compliance`` (6, 6) at rest, without the rig, and its ``rank``.  Unsupported when
        the rank is below 6: then the tip cannot be held in every direction.
    """
    chain = Chain(compile_mechanism(model.mechanism(specimen)))
    begin = perf_counter()
    head = heading(specimen, experiment, model)
    if not is_sprung(chain):
        return Record(**head, how=how(specimen, model, perf_counter() - begin), status="unsupported", reason=_LOOSE)
    compliance, rank = tip_compliance(chain)
    head["scalars"] = {"rank": Scalar(float(rank), "1", "rank of the tip compliance")}
    common = {"tip_compliance": _matrix("tip_compliance", compliance, "m/N, rad/N, rad/(N*m)", "wrench_dof")}
    if reason := _refusal(rank):
        facts = how(specimen, model, perf_counter() - begin)
        return Record(**head, channels=common, how=facts, status="unsupported", reason=reason)
    rig = 0.0 if experiment.rig_stiffness is None else 1.0 / experiment.rig_stiffness
    rows, outcome = _sweep(chain, experiment, rig)
    facts = how(specimen, model, perf_counter() - begin)
    with_rig = compliance + np.diag([rig, rig, rig, 0.0, 0.0, 0.0])
    tangent = np.linalg.inv(with_rig).astype(np.float64)
    common |= {"tangent_stiffness": _matrix("tangent_stiffness", tangent, "N/m, N, N*m", "dof_moved")}
    return Record(**head, channels=_channels(rows) | common, how=facts, **outcome)


def held_tip(chain: Chain, experiment: StaticStiffness) -> tuple[dict[str, Array], str]:
    """``leg``, ``motion`` and ``wrench`` of all legs, or why they do not exist."""
    if reason := _refusal(tip_compliance(chain)[1]) if is_sprung(chain) else _LOOSE:
        return {}, reason
    rig = 0.0 if experiment.rig_stiffness is None else 1.0 / experiment.rig_stiffness
    rows, outcome = _sweep(chain, experiment, rig)
    found = _channels(rows)
    return {name: found[name].values for name in ("leg", "motion", "wrench")}, outcome.get("reason", "")


def _refusal(rank: int) -> str:
    if rank == _RIGID_MOTIONS:
        return ""
    return (
        f"rank of the tip compliance is {rank} of 6: the hinges cannot follow a held tip, "
        "so the clamped stiffness does not exist"
    )


def _matrix(name: str, values: Array, unit: str, second: str) -> Channel:
    return Channel(name, unit, values, ("dof", second), f"{name.replace('_', ' ')} at rest; {DOFS}")


def _sweep(chain: Chain, experiment: StaticStiffness, rig: float) -> tuple[list[_Row], dict[str, Any]]:
    """Rows reached, and the status when a leg could not be finished."""
    from scipy.spatial.transform import Rotation  # 0.4 s, which no other experiment needs

    rows: list[_Row] = []
    for leg, (dof, end) in enumerate(experiment.legs()):
        held, before = Held(chain.slack, np.zeros(6)), np.zeros(6)
        for share in np.arange(1, experiment.increments + 1) / experiment.increments:
            motion = np.zeros(6)
            motion[dof] = share * end
            try:
                held = move(chain, held, before, motion, rig)
            except NotConverged as failure:
                return rows, {"status": "diverged", "reason": f"leg {leg}: {failure}"}
            tip = chain.tip(held.joints)
            turn = Rotation.from_matrix(tip.rotation @ chain.at_rest.rotation.T)
            pose = np.concatenate([tip.position - chain.at_rest.position, turn.as_rotvec()])
            rows.append(_Row(leg, motion, pose, held.wrench))
            before = motion
    return rows, {}


def _channels(rows: list[_Row]) -> dict[str, Channel]:
    def table(name: str, unit: str, meaning: str) -> Channel:
        values = np.array([getattr(row, name) for row in rows]).reshape(-1, 6)
        return Channel(name, unit, values, ("increment", "dof"), f"{meaning}; {DOFS}")

    return channels(
        Channel("increment", "1", np.arange(len(rows)), ("increment",), "recorded increment"),
        Channel("leg", "1", np.array([row.leg for row in rows], dtype=np.int64), ("increment",), "leg of the motion"),
        table("motion", "m, rad", "motion of the robot from rest"),
        table("pose", "m, rad", "pose of the tip from rest"),
        table("wrench", "N, N*m", "force and moment of the rig on the tip, about its current centre"),
    )
