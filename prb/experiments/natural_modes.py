"""Undamped small vibrations about rest."""

from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from lab.experiments import NaturalModes
from lab.experiments.natural_modes import senses
from lab.records import Channel, Fields, Record, channels
from lab.specimens import Specimen, TwistedBeam
from prb.experiments.common import DOFS, heading, how
from prb.model import PrbModel
from prb.mujoco_model import compile_mechanism
from prb.statics import Chain, is_sprung
from prb.vibration import Modes, vibrations

Array = NDArray[np.float64]
#: Why a mechanism has no modes.
LOOSE = "a joint has no spring at rest, so the mechanism has no vibration about it; give every joint a spring"
#: Largest displacement of a drawn mode by the linear theory over the length of the mechanism.
_DRAWN = 0.1
_VTK_QUAD = 9


def natural_modes(specimen: Specimen, experiment: NaturalModes, model: PrbModel) -> Record:
    """Modes of the mechanism without its dampers, its springs slack at rest.

    Returns
    -------
    record
        Channels ``mode``, ``frequency`` (modes,), Hz, and ``tip`` (modes, 6), m and rad at a modal mass of 1 kg, with
        the sign that makes the largest of them positive (rotations times half the width).  A mechanism of few joints
        has fewer modes than wanted: ``how`` says so under ``missing``.  Fields: the middle planes of the links, one
        state for each mode, deflected so far that the largest displacement is about a tenth of the length.
    """
    mechanism = model.mechanism(specimen).in_motion
    chain, head = Chain(compile_mechanism(mechanism)), heading(specimen, experiment, model)
    begin = perf_counter()
    if not is_sprung(chain):
        return Record(**head, how=how(specimen, model, perf_counter() - begin), status="unsupported", reason=LOOSE)
    modes = vibrations(mechanism, chain, experiment.count)
    facts = how(specimen, model, perf_counter() - begin)
    tip = tip_of(chain, modes, specimen)
    if missing := experiment.count - len(tip):
        facts["missing"] = f"the last {missing} of {experiment.count} modes: the mechanism has only {len(tip)}"
    return Record(**head, channels=_channels(modes, tip), how=facts, fields=_fields(chain, modes))


def tip_of(chain: Chain, modes: Modes, specimen: Specimen) -> Array:
    """Motion of the tip in each mode, (modes, 6), m and rad, its largest positive (rotations times half the width)."""
    tip = modes.shapes @ chain.at_rest.jacobian.T
    width = specimen.width if isinstance(specimen, TwistedBeam) else 2.0 * specimen.radius
    return np.asarray(senses(tip, width)[:, None] * tip)


def _channels(modes: Modes, tip: Array) -> dict[str, Channel]:
    numbers = np.arange(1, len(tip) + 1)
    return channels(
        Channel("mode", "1", numbers, ("mode",), "number of the mode, slowest first"),
        Channel("frequency", "Hz", modes.frequencies, ("mode",), "natural frequency"),
        Channel("tip", "m, rad", tip, ("mode", "dof"), f"motion of the tip at a modal mass of 1 kg; {DOFS}"),
    )


def _fields(chain: Chain, modes: Modes) -> Fields:
    corners = chain.plates(chain.slack)
    states = []
    for shape in modes.shapes:
        small = 1e-6 / np.abs(shape).max() * shape
        furthest = np.linalg.norm(chain.plates(chain.slack + small) - corners, axis=1).max()
        # The links stay rigid: the posture itself, not its linear displacements.
        states.append(chain.plates(chain.slack + _DRAWN * chain.length / furthest * small) - corners)
    cells = np.arange(len(corners), dtype=np.int64).reshape(-1, 4)
    meaning = f"displacement of the links' corners, some {_DRAWN:g} of the length at most"
    channel = Channel("displacement", "m", np.array(states), ("state", "point", "axis"), meaning)
    return Fields(corners, cells, _VTK_QUAD, np.arange(1.0, len(states) + 1), {"displacement": channel})
