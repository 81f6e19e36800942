"""Free motion of compiled mechanisms, many at a time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Slack for a sampling interval that is a whole number of steps up to rounding.
_ROUNDING = 1e-9
#: Ratio of extreme eigenvalues at which an inertia matrix counts as singular.
_SINGULAR = 1e-10


def steps_per_sample(rate: float, time_step: float) -> int:
    """Whole steps per sampling interval 1 / ``rate`` (Hz), none longer than ``time_step`` (s)."""
    return max(1, ceil(1.0 / (rate * time_step) - _ROUNDING))


@dataclass(frozen=True)
class Motion:
    """Sampled motion of n runs.

    Parameters
    ----------
    positions
        Places of the tip and of each marker, (n, samples, 1 + markers, 3), m.
    joints
        Joint coordinates, (n, samples, joints), rad or m.
    completed
        Whether the run was stable and stayed finite, (n,); positions and joints are NaN elsewhere.
    """

    positions: Array
    joints: Array
    completed: NDArray[np.bool_]


def release(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], starts: Array, samples: int, stride: int
) -> Motion:
    """Let mechanisms go from rest at ``starts`` and sample them every ``stride`` steps.

    Parameters
    ----------
    models
        One per run, of the same sizes; a run's first sample is its start.
    data
        Scratch, one per thread.
    starts
        Joint coordinates, (n, joints), rad or m.
    """
    n, joints = starts.shape
    sites, runs = (
        models[0].nsensor,
        np.flatnonzero([is_stable(m, data[0], q) for m, q in zip(models, starts, strict=True)]),
    )
    result = Motion(np.full((n, samples, sites, 3), np.nan), np.full((n, samples, joints), np.nan), np.zeros(n, bool))
    if not len(runs):
        return result
    begin = np.zeros((len(runs), mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    begin[:, 1 : 1 + joints] = starts[runs]
    # Sensors belong to the state before a step, states to the one after it: one step more than
    # intervals, and both arrays are read so that sample j is at j * stride steps.
    steps = (samples - 1) * stride + 1
    with _silence(), rollout.Rollout(nthread=len(data) if len(data) > 1 else 0) as pool:
        states, sensors = pool.rollout([models[int(i)] for i in runs], list(data), begin, nstep=steps)
    positions = sensors[:, ::stride].reshape(len(runs), samples, sites, 3)
    visited = np.concatenate([begin[:, None], states], axis=1)[:, :steps:stride, 1 : 1 + joints]
    # A run that MuJoCo stops for a bad state is filled with that state: its clock stands still.
    arrived = states[:, -1, 0] > (steps - 0.5) * models[0].opt.timestep
    good = arrived & np.isfinite(positions).all(axis=(1, 2, 3))
    result.positions[runs[good]], result.joints[runs[good]] = positions[good], visited[good]
    result.completed[runs[good]] = True
    return result


def inertia_at(model: mujoco.MjModel, data: mujoco.MjData, joints: Array) -> Array:
    """Inertia matrix of the joints at a posture, (joints, joints), kg*m^2."""
    inertia = np.empty((model.nv, model.nv))
    data.qpos[:] = joints
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_makeM(model, data)
    mujoco.mj_fullM(model, data, inertia)
    return inertia


def is_stable(model: mujoco.MjModel, data: mujoco.MjData, joints: Array) -> bool:
    """Whether the integrator is stable for small motions about a posture.

    With inertia M, dampers C and springs K, MuJoCo's semi-implicit step h with implicit joint damping has
    the characteristic polynomial (M + h C) z^2 - (2 M + h C - h^2 K) z + M, whose roots stay inside
    the unit circle (Jury) when 4 M + 2 h C - h^2 K is positive definite.
    """
    step = model.opt.timestep
    springs = 2.0 * step * model.dof_damping - step**2 * model.jnt_stiffness
    return bool(np.linalg.eigvalsh(4.0 * inertia_at(model, data, joints) + np.diag(springs))[0] > 0.0)


def refusal(model: mujoco.MjModel) -> str:
    """Why a mechanism cannot move freely, as a sentence; empty when it can."""
    moments = np.linalg.eigvalsh(inertia_at(model, mujoco.MjData(model), np.zeros(model.nq)))
    if moments[0] > _SINGULAR * moments[-1]:
        return ""
    return (
        "the inertia of the joints is singular: parallel hinges at one place (R1 and R2 of an untwisted beam) "
        "cannot move independently, so the free motion is not defined"
    )


@contextmanager
def _silence() -> Iterator[None]:
    """Keep MuJoCo from writing a log file for each run that blows up: such runs are reported as not completed."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
