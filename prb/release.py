"""Free motion of compiled mechanisms, many at a time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from prb.laws import Laws
from prb.mujoco_model import silence

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


def extrapolated(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], starts: Array, samples: int, stride: int
) -> Motion:
    """``release`` with the models' steps and with half of them, extrapolated to no step at all (Richardson).

    The simulator's error is of first order, some 2 % of a ring-down at 0.25 ms.  What is left of second order is
    a tenth of that at twice the step.
    """
    coarse = release(models, data, starts, samples, stride)
    with halved(models):
        fine = release(models, data, starts, samples, 2 * stride)
    # Where only the fine steps are stable the longer ones cannot be vouched for: NaN from the coarse run stays.
    return Motion(
        2.0 * fine.positions - coarse.positions,
        2.0 * fine.joints - coarse.joints,
        fine.completed & coarse.completed,
    )


@contextmanager
def halved(models: Sequence[mujoco.MjModel]) -> Iterator[None]:
    """Halve the steps of models for a while."""
    distinct = list({id(model): model for model in models}.values())
    for model in distinct:
        model.opt.timestep /= 2.0
    try:
        yield
    finally:
        for model in distinct:
            model.opt.timestep *= 2.0


def release(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], starts: Array, samples: int, stride: int
) -> Motion:
    """Let mechanisms go from rest at ``starts`` and sample them every ``stride`` steps.

    Parameters
    ----------
    models
        One per run, of the same structure; a run's first sample is its start.
    data
        Scratch, one per thread.
    starts
        Joint coordinates, (n, joints), rad or m.
    """
    n, joints = starts.shape
    runs = np.flatnonzero([is_stable(m, data[0], q) for m, q in zip(models, starts, strict=True)])
    shape = (n, samples, models[0].nsensor, 3)
    result = Motion(np.full(shape, np.nan), np.full((n, samples, joints), np.nan), np.zeros(n, bool))
    if not len(runs):
        return result
    begin = full_states(models[0], Laws(models[0]).with_hidden(starts[runs]))
    # Sensors belong to the state before a step, states to the one after it: one step more than
    # intervals, and both arrays are read so that sample j is at j * stride steps.
    steps = (samples - 1) * stride + 1
    states, sensors = roll([models[int(i)] for i in runs], data, begin, steps)
    positions = sensors[:, ::stride].reshape(len(runs), samples, -1, 3)
    visited = np.concatenate([begin[:, None], states], axis=1)[:, :steps:stride, 1 : 1 + joints]
    # A run that MuJoCo stops for a bad state is filled with that state: its clock stands still.
    arrived = states[:, -1, 0] > (steps - 0.5) * np.array([models[int(i)].opt.timestep for i in runs])
    good = arrived & np.isfinite(positions).all(axis=(1, 2, 3))
    result.positions[runs[good]], result.joints[runs[good]] = positions[good], visited[good]
    result.completed[runs[good]] = True
    return result


def full_states(model: mujoco.MjModel, joints: Array) -> Array:
    """The simulator's states (n, size) at time 0 and at rest, with the joints at (n, joints)."""
    states = np.zeros((len(joints), mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    states[:, 1 : 1 + joints.shape[1]] = joints
    return states


def roll(
    models: Sequence[mujoco.MjModel], data: Sequence[mujoco.MjData], begin: Array, steps: int, **control: Any
) -> tuple[Array, Array]:
    """States (n, steps, size) after and sensors (n, steps, sensors) before each step, from ``begin`` (n, size)."""
    with silence(), rollout.Rollout(nthread=len(data) if len(data) > 1 else 0) as pool:
        states, sensors = pool.rollout(list(models), list(data), begin, nstep=steps, **control)
    return states, sensors


def inertia_at(model: mujoco.MjModel, data: mujoco.MjData, joints: Array) -> Array:
    """Inertia matrix of all joints at a posture, (joints, joints), kg*m^2."""
    inertia = np.empty((model.nv, model.nv))
    data.qpos[:] = joints
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_makeM(model, data)
    mujoco.mj_fullM(model, data, inertia)
    return inertia


def is_stable(model: mujoco.MjModel, data: mujoco.MjData, joints: Array) -> bool:
    """Whether the integrator is stable for small motions about a posture of the visible joints.

    With inertia M, dampers C and springs K, MuJoCo's semi-implicit step h with implicit joint damping has
    the characteristic polynomial (M + h C) z^2 - (2 M + h C - h^2 K) z + M, whose roots stay inside
    the unit circle (Jury) when 4 M + 2 h C - h^2 K is positive definite.  Springs that are not
    linear are looked at with slack springs, at the posture, and at its mirror image.
    """
    laws, step = Laws(model), model.opt.timestep
    inertia = inertia_at(model, data, laws.with_hidden(joints))
    resisting = 4.0 * inertia + np.diag(2.0 * step * model.dof_damping)
    return all(
        bool(np.linalg.eigvalsh(resisting - step**2 * stiffness)[0] > 0.0)
        for stiffness in laws.stiffness_matrices(joints)
    )


def unstable(step: float) -> str:
    """The sentence about a run that did not complete with steps of ``step`` (s)."""
    return f"the motion is not stable with a step of {1e3 * step:.3g} ms; shorten time_step"


def refusal(model: mujoco.MjModel, data: mujoco.MjData | None = None) -> str:
    """Why a mechanism cannot move freely, as a sentence; empty when it can.  ``data`` is scratch."""
    laws = Laws(model)
    inertia = inertia_at(model, data or mujoco.MjData(model), laws.with_hidden(laws.rest))
    moments = np.linalg.eigvalsh(inertia[: laws.count, : laws.count])
    if moments[0] > _SINGULAR * moments[-1]:
        return ""
    return (
        "the inertia of the joints is singular: parallel hinges at one place (R1 and R2 of an untwisted beam) "
        "cannot move independently, so the free motion is not defined"
    )
