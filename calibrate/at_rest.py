"""Physical quantities that every model of a device has, whatever its parameters are called."""

from collections.abc import Mapping

from lab.records import Scalar
from lab.specimens import Specimen
from prb.model import PrbModel

_MODES = 2
_COMPLIANCES = (("C_yy", 1, "m/N", "along y"), ("C_zz", 2, "m/N", "along z"), ("C_rxrx", 3, "rad/(N*m)", "about x"))


def quantities_at_rest(model: PrbModel, specimen: Specimen, values: Mapping[str, float]) -> dict[str, Scalar]:
    """Compliances of the tip, and frequencies and damping ratios of the first modes, of small motions about rest.

    The modes are those of ``prb.vibration``.

    Parameters
    ----------
    values
        Every parameter of the model's topology, SI.

    Returns
    -------
    quantities
        Without the modes that the mechanism does not have, and without any where it has no free motion (a singular
        inertia) or is not held by springs at rest.
    """
    from prb.mujoco_model import compile_mechanism
    from prb.release import refusal
    from prb.statics import Chain, is_sprung, tip_compliance
    from prb.vibration import vibrations

    mechanism = model.topology.build(specimen, values)
    compliance, _ = tip_compliance(Chain(compile_mechanism(mechanism)))
    found = {
        name: Scalar(float(compliance[dof, dof]), unit, f"compliance of the free tip {where}")
        for name, dof, unit, where in _COMPLIANCES
    }
    chain = Chain(compile_mechanism(mechanism.in_motion))
    if refusal(chain.model) or not is_sprung(chain):
        return found
    modes = vibrations(mechanism.in_motion, chain, _MODES)
    for number, (frequency, ratio) in enumerate(zip(modes.frequencies, modes.damping_ratios, strict=True), 1):
        order = f"mode {number} at rest"
        found[f"f_{number}"] = Scalar(float(frequency), "Hz", f"undamped frequency of {order}")
        found[f"zeta_{number}"] = Scalar(float(ratio), "1", f"damping ratio of {order}")
    return found
