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
#: How often its step is halved at most.
_HALVINGS = 4


def paddle_in(water: Water, paddler: "Paddler", stroke: "Stroke", step: float) -> "Motion":
    """Motion from rest under a law of water; ``fault`` says whether it is a result.

    The plate law runs compiled, all others in MuJoCo, with a fifth of ``step`` and with half of that, halved again
    until the motion is steady.  A spring too fast for MuJoCo's step makes the fin rattle within bounds, which nothing
    but another step shows.

    Parameters
    ----------
    step
        Longest step of the compiled motion, s.
    """
    from prb.paddler import paddle  # compiled code, which only this needs

    if water == "plate":
        return paddle(paddler, stroke, step)
    from prb.paddler_mujoco import paddle_in_mujoco

    step /= _FINER
    motion = paddle_in_mujoco(paddler, stroke, water=water, time_step=step)
    for _ in range(_HALVINGS):
        step /= 2
        coarse, motion = motion, paddle_in_mujoco(paddler, stroke, water=water, time_step=step)
        motion = replace(motion, step_error=_apart(coarse, motion))
        if not motion.fault:
            break
    return motion


def _apart(coarse: "Motion", fine: "Motion") -> float:
    """Change of sensed thrust or tip speed, rms over rms, whichever is larger; NaN where a motion runs away.

    Without water nothing pushes a free body, and only its tips tell.
    """
    found = []
    for old, new in ((coarse.sensed, fine.sensed), (coarse.tip_speed, fine.tip_speed)):
        change = np.linalg.norm(np.interp(coarse["time"], fine["time"], new) - old)
        found.append(float(change) / max(float(np.linalg.norm(old)), 1e-9))
    return float(np.max(found))
