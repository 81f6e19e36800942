"""Laws of water that a study may choose for a paddling device.  Importing this is light."""

from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from prb.paddler import Motion, Paddler, Stroke

#: The plate law of section 4.5.3, MuJoCo's two models of a fluid, and no water at all.
Water = Literal["plate", "ellipsoid", "inertia-box", "none"]
#: MuJoCo's steps in one of the compiled motion: its method is of the first order, the other of the fourth.
_FINER = 5


def paddle_in(water: Water, paddler: "Paddler", stroke: "Stroke", step: float) -> "Motion":
    """Motion from rest under a law of water; ``fault`` says whether it is a result.

    The plate law runs compiled, all others in MuJoCo with a fifth of ``step`` and with a tenth: the second motion is
    returned, with how far it is from the first.  A spring too fast for MuJoCo's step makes the fin rattle within
    bounds, which only another step shows.

    Parameters
    ----------
    step
        Longest step of the compiled motion, s.
    """
    from prb.paddler import paddle  # compiled code, which only this needs

    if water == "plate":
        return paddle(paddler, stroke, step)
    from prb.paddler_mujoco import paddle_in_mujoco

    coarse = paddle_in_mujoco(paddler, stroke, water=water, time_step=step / _FINER)
    if not coarse.completed:
        return coarse
    fine = paddle_in_mujoco(paddler, stroke, water=water, time_step=step / _FINER / 2)
    if not fine.completed:
        return fine
    # Without water nothing pushes a free body, and only its tips tell.
    apart = [
        float(np.linalg.norm(np.interp(coarse["time"], fine["time"], new) - old))
        / max(float(np.linalg.norm(old)), 1e-9)
        for new, old in ((fine.sensed, coarse.sensed), (fine.tip_speed, coarse.tip_speed))
    ]
    return replace(fine, step_error=max(apart))
