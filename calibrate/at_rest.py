"""Physical quantities that every model of a device has, whatever its parameters are called."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lab.records import Scalar
from lab.specimens import Specimen
from prb.mechanism import Hinge
from prb.model import PrbModel

if TYPE_CHECKING:
    from prb.statics import Chain

Array = NDArray[np.float64]
_MODES, _ROUNDS, _STEP = 2, 30, 1e-6
_COMPLIANCES = (("C_yy", 1, "m/N", "along y"), ("C_zz", 2, "m/N", "along z"), ("C_rxrx", 3, "rad/(N*m)", "about x"))


def quantities_at_rest(model: PrbModel, specimen: Specimen, values: Mapping[str, float]) -> dict[str, Scalar]:
    """Compliances of the tip, and frequencies and damping ratios of the first modes, of small motions about rest.

    A mode of frequency w is that of the mechanism with the springs' storage stiffness at w (Maxwell
    branches are partly stiff); its damping ratio is phi^T C phi / (2 w phi^T M phi) with the dampers' loss at w.

    Parameters
    ----------
    values
        Every parameter of the model's topology, SI.

    Returns
    -------
    quantities
        Without the modes where the mechanism has no free motion (a singular inertia).
    """
    from prb.mujoco_model import compile_mechanism
    from prb.release import refusal
    from prb.statics import Chain, tip_compliance

    mechanism = model.topology.build(specimen, values)
    compliance, _ = tip_compliance(Chain(compile_mechanism(mechanism)))
    found = {
        name: Scalar(float(compliance[dof, dof]), unit, f"compliance of the free tip {where}")
        for name, dof, unit, where in _COMPLIANCES
    }
    compiled = compile_mechanism(mechanism.in_motion)
    if refusal(compiled):
        return found
    for number in range(_MODES):
        frequency, damping = _mode(Chain(compiled), mechanism.in_motion.hinges, number)
        order = f"mode {number + 1} at rest"
        found[f"f_{number + 1}"] = Scalar(frequency, "Hz", f"undamped frequency of {order}")
        found[f"zeta_{number + 1}"] = Scalar(damping, "1", f"damping ratio of {order}")
    return found


def _mode(chain: "Chain", hinges: Sequence[Hinge], number: int) -> tuple[float, float]:
    """Frequency (Hz) and damping ratio of a mode, counted by frequency; NaN where there are fewer."""
    from scipy.linalg import eigh

    from prb.release import inertia_at

    count = len(hinges)
    if number >= count:
        return float("nan"), float("nan")
    mass = inertia_at(chain.model, chain.data, chain.laws.with_hidden(chain.slack))[:count, :count]
    relaxed, turning, damping = _relaxed_stiffness(chain, count), 0.0, float("nan")
    for _ in range(_ROUNDS):
        parts = [_storage_and_loss(hinge, turning) for hinge in hinges]
        squares, shapes = eigh(relaxed + np.diag([storage for storage, _ in parts]), mass)
        before, turning = turning, float(np.sqrt(max(squares[number], 0.0)))
        shape = shapes[:, number]
        damping = float(shape**2 @ [loss for _, loss in parts]) / (2.0 * turning) if turning else float("nan")
        if abs(turning - before) <= 1e-12 * turning:
            break
    return turning / (2.0 * np.pi), damping


def _relaxed_stiffness(chain: "Chain", count: int) -> Array:
    """Derivative of the springs' torques at rest, (count, count); the mean of both sides at a knee."""
    steps = _STEP * np.eye(count)
    return np.array(
        [(chain.laws.torque(chain.slack + e) - chain.laws.torque(chain.slack - e)) / (2.0 * _STEP) for e in steps]
    ).T


def _storage_and_loss(hinge: Hinge, turning: float) -> tuple[float, float]:
    """Stiffness that the branches of a joint add at an angular frequency (rad/s), and damping with its damper."""
    storage, loss = 0.0, hinge.damping
    for branch in hinge.branches:
        square = (turning * branch.time) ** 2
        storage += branch.stiffness * square / (1.0 + square)
        loss += branch.stiffness * branch.time / (1.0 + square)
    return storage, loss
