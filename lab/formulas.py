"""Published figures that other published figures or elementary theory give: one named function each.

Every function takes nothing and returns its number, or a tuple of numbers, in the unit of the figure that
it answers (``lab.published.figures``), from published figures alone unless its docstring says more.
"""

import math
from collections.abc import Callable, Mapping

from lab.materials import material
from lab.pinching import first_order, pair_shares
from lab.published import figures
from lab.sections import torsion_constant
from lab.tube_theory import tip_stiffness

Number = float | tuple[float, ...]
#: Angles of attack at which the plate law of 4.5.3 is checked, rad.
_ATTACK = tuple(math.radians(angle) for angle in (30.0, 60.0, 90.0))
#: Poisson's ratio of the note on the printed tube; chapter 3 publishes none.
_TUBE_POISSON_RATIO = 0.48


def _value(id: str) -> float:
    return float(figures()[id]["value"])


def pinch_spacing() -> Number:
    """Angles (deg) between neighbours of 2 n evenly spaced pinch points, n = 2 and 3 pairs (eq. 3.1)."""
    return tuple(360.0 / (2 * pairs) for pairs in (2, 3))


def tendon_spacing() -> Number:
    """Angle (deg) between six tendons, three pairs (3.3.2)."""
    return 360.0 / 6


def pinch_force_increase() -> Number:
    """By how much (%) F_p must be larger half-way between two pairs, small deflections of a thin ring (eqs 3.2 to 3.5).

    The second harmonics of two equal forces add up to less than that of one.
    """
    middle = first_order(pair_shares(math.radians(60.0)))
    return 100.0 * (middle.force_factor - 1.0)


def pinch_slope() -> Number:
    """Slope of beta against alpha that turns from one pair to the next, 90 deg, within its sector of 120 deg."""
    return 90.0 / (360.0 / 3)


def hinge_stiffness_ratio() -> Number:
    """Unpinched over pinched bending stiffness (3.5.1)."""
    return _value("c3-k-unpinched") / _value("c3-k-pinched")


def printed_tube_stiffness() -> Number:
    """Tip stiffness (N/m) of the printed tube as a cantilever with shear (Timoshenko, thin ring).

    The diameter is read as the outer one.
    """
    wall = _value("c3-tpu-wall")
    radius = (_value("c3-tpu-diameter") - wall) / 2
    return tip_stiffness(_value("c5-tpu-E"), _TUBE_POISSON_RATIO, radius, wall, _value("c3-tpu-length"))


def fin_pinch_increment() -> Number:
    """Pinch of the fin's tube over the number of its load steps, m."""
    return _value("c4-fea-pinch") / _value("c4-fea-steps")


def speed_in_body_lengths() -> Number:
    """Swimming speed over the tube's length of table 4.1, 1/s."""
    return _value("c4-swim-speed") / _value("t4.1-L")


def _reynolds(speeds: tuple[float, float], published: str) -> Number:
    numbers = figures()[published]["value"]
    chord_over_viscosity = sum(number / speed for number, speed in zip(numbers, speeds, strict=True)) / 2
    return tuple(chord_over_viscosity * speed for speed in speeds)


def reynolds_load_fin() -> Number:
    """Both Reynolds numbers of the load fin with one chord, the mean of those that they imply."""
    return _reynolds((_value("c4-u-loadfin-recovery"), _value("c4-u-loadfin-power")), "c4-re-loadfin")


def reynolds_tpe_fin() -> Number:
    """Both Reynolds numbers of the fin itself with one chord."""
    return _reynolds((_value("c4-u-tpe-recovery"), _value("c4-u-tpe-power")), "c4-re-tpe")


def plate_along_flow() -> Number:
    """Part of the force of eq. 4.3, normal to the plate, along the flow, over rho u^2 A."""
    return tuple(math.sin(angle) * math.sin(angle) for angle in _ATTACK)


def plate_across_flow() -> Number:
    """Part of the force of eq. 4.3, normal to the plate, across the flow, over rho u^2 A."""
    return tuple(math.sin(angle) * math.cos(angle) for angle in _ATTACK)


def plate_resultant() -> Number:
    """Resultant of the drag of eq. 4.1 and the lift of eq. 4.2, over rho u^2 A."""
    return tuple(math.hypot(math.sin(a) ** 2, math.cos(a) * math.sin(a)) for a in _ATTACK)


def plate_speed_for_peak_thrust() -> Number:
    """Plate speed (m/s) at which eq. 4.3 gives half of the peak thrust with load fins: two fins share it.

    The area is the chord behind the published Reynolds number times the tube's length, in water of 1000 kg/m^3
    and 1e-6 m^2/s: neither area nor span of the load fin is published.
    """
    chord = figures()["c4-re-loadfin"]["value"][1] * 1e-6 / _value("c4-u-loadfin-power")
    return math.sqrt(_value("c4-thrust-max-fin") / 2 / (1000.0 * chord * _value("t4.1-L")))


def links_length() -> Number:
    """Length of the published links together, l1 = 0, m."""
    return _value("c5-l2") + _value("c5-l3")


def last_link() -> Number:
    """l3 = l - l2, m."""
    return _value("c5-beam-length") - _value("c5-l2")


def solid_mass() -> Number:
    """Mass (kg) of the solid beam of table 5.2 at the published density."""
    return _value("c5-density") * _value("t5.2-l") * _value("t5.2-w") * _value("t5.2-t")


def segment_twist() -> Number:
    """Half of the total twist, one share for each torsion joint, deg."""
    return _value("t5.2-phi") / 2


def foot_gap() -> Number:
    """Distance from stage to plate less the length of the foot, m."""
    return _value("c5-h") - _value("c5-foot-length")


def _guided(width: float, thickness: float) -> float:
    """Shear stiffness (N/m) of the untwisted beam, both ends' rotations held; bent across ``thickness``, m."""
    modulus, length = _value("c5-tpu-E"), _value("t5.2-l")
    shear_modulus = modulus / (2 * (1 + material("tpu-95a").poisson_ratio))
    bending = 12 * modulus * width * thickness**3 / 12 / length**3
    shear = 5 / 6 * shear_modulus * width * thickness / length
    return 1 / (1 / bending + 1 / shear)


def guided_strong_axis() -> Number:
    """Beam theory's k_yy at phi = 0 and the datasheet's modulus, Timoshenko, N/m; Poisson's ratio ASSUMED."""
    return _guided(_value("t5.2-t"), _value("t5.2-w"))


def guided_weak_axis() -> Number:
    """Beam theory's k_zz at phi = 0 and the datasheet's modulus, Timoshenko, N/m; Poisson's ratio ASSUMED."""
    return _guided(_value("t5.2-w"), _value("t5.2-t"))


def torsion() -> Number:
    """Saint-Venant's G J / l at phi = 0 and the datasheet's modulus, N*m/rad; Poisson's ratio ASSUMED."""
    modulus, length, width, thickness = (_value(id) for id in ("c5-tpu-E", "t5.2-l", "t5.2-w", "t5.2-t"))
    shear_modulus = modulus / (2 * (1 + material("tpu-95a").poisson_ratio))
    return shear_modulus * torsion_constant(width, thickness) / length


#: Formulas by the names that ``lab/data/ledger.yaml`` uses.
FORMULAS: Mapping[str, Callable[[], Number]] = {
    function.__name__: function
    for function in (
        pinch_spacing, tendon_spacing, pinch_slope, pinch_force_increase, hinge_stiffness_ratio,
        printed_tube_stiffness, fin_pinch_increment, speed_in_body_lengths, reynolds_load_fin, reynolds_tpe_fin,
        plate_along_flow, plate_across_flow, plate_resultant, plate_speed_for_peak_thrust, links_length, last_link,
        solid_mass, segment_twist, foot_gap, guided_strong_axis, guided_weak_axis, torsion,
    )
}  # fmt: skip
