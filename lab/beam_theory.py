"""Natural vibrations of the twisted beam by beam theory, beside which finite elements and mechanisms can be judged.

The section turns along the axis; all fields are in the fixed axes, so that the equations hold for any twist:

- bending and shear in both planes at once (Timoshenko, shear factor 5/6, rotary inertia): deflections v, w and
  slopes p_y, p_z, where u_x = -y p_y - z p_z;
- torsion and stretch (Saint-Venant and Wagner): in a beam with the pre-twist kappa the fibre at the radius r winds
  around the axis, so it stretches by u' + kappa r^2 theta'.  Where the beam may shorten freely, that gives

      G J + E kappa^2 (int r^4 dA - (int r^2 dA)^2 / A)  ~  G J + E width^5 thickness kappa^2 / 180.

  In motion, shortening takes the mass along the axis with it: torsion is slower than that rigidity and the polar
  inertia alone make it, by 2 % in the 50 x 20 x 3 mm beam at 90 degrees and by 7 % at 180.

Left out: that clamped faces neither warp nor curve across, that wide strips curve across elsewhere, and all terms of
higher order in kappa * width.  They matter where the beam is as short as a few widths or turns a lot within one.

Every field is a sum of integrated Legendre polynomials, which vanish at the clamp (Galerkin's method).
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from lab.materials import Material
from lab.sections import torsion_constant
from lab.specimens import TwistedBeam

Array = NDArray[np.float64]
Kind = Literal["bending", "torsion", "stretch", "mixed"]

_SHEAR_FACTOR = 5.0 / 6.0
#: Polynomials of each field beyond one per mode: exact to 1e-6 for sections to 20 : 1 and 50 widths, turned once.
_POLYNOMIALS = 16
#: Part of the strain energy from which on a mode is called after one kind of deformation.
_MOSTLY = 0.75
#: Fields v, w, p_y, p_z, u, theta, and strains: their derivatives, less the slopes in the first two (shear).
_FIELDS = 6
_SLOPES = np.eye(_FIELDS, k=2) * (np.arange(_FIELDS) < 2)[:, None]


@dataclass(frozen=True)
class Mode:
    """A natural vibration.

    Parameters
    ----------
    frequency
        Without damping, Hz.
    kind
        The deformation that holds at least three quarters of its strain energy, else ``mixed``.
    """

    frequency: float
    kind: Kind


def natural_modes(specimen: TwistedBeam, count: int) -> list[Mode]:
    """Slowest vibrations of the clamped beam with what its tip carries, about the unloaded shape.

    ``tip_mass`` is spread evenly over the tip face, the load frame is rigid.  Viscous damping is left out; branches
    of the material that relax count with the stiffness that they have at the mode's own frequency.

    Parameters
    ----------
    count
        Number of modes, at least 1.

    Returns
    -------
    modes
        In ascending order of frequency.

    Examples
    --------
    >>> [(round(mode.frequency, 1), mode.kind) for mode in natural_modes(TwistedBeam(twist=0.0), 2)]
    [(28.3, 'bending'), (121.5, 'torsion')]
    """
    from scipy.linalg import eigh

    if count < 1:
        raise ValueError(f"count {count} must be at least 1")
    basis = _basis(_POLYNOMIALS + count)
    stiffness, mass = _stiffness(specimen, basis), _mass(specimen, basis)
    # The slow modes are the largest values of the inverse problem, which keeps their digits in slender beams.
    size = len(mass)
    inverses, shapes = eigh(mass, stiffness, subset_by_index=(size - count, size - 1))
    return [
        Mode(_frequency(1.0 / np.sqrt(inverse), specimen.material), _kind(specimen, basis, stiffness, shape))
        for inverse, shape in zip(inverses[::-1], shapes.T[::-1], strict=True)
    ]


def torsional_rigidity(specimen: TwistedBeam) -> float:
    """Torque over twist per length of the beam that may shorten freely, pre-twist included, N*m^2."""
    (stretch, coupling), (_, torsion) = _fibres(specimen)
    return float(torsion - coupling**2 / stretch)


@dataclass(frozen=True)
class _Basis:
    """Polynomials on [0, 1] that vanish at 0.

    Parameters
    ----------
    places, weights
        Of the quadrature, (q,).
    values, slopes
        There, (q, n).
    tip
        Values at 1, (n,).
    """

    places: Array
    weights: Array
    values: Array
    slopes: Array
    tip: Array


@cache
def _basis(count: int) -> _Basis:
    # Enough points for products of two polynomials and two turns of the section.
    nodes, weights = legendre.leggauss(count + _POLYNOMIALS)
    polynomials = legendre.legvander(np.append(nodes, 1.0), count)
    degrees = np.arange(1, count)
    rising = (polynomials[:, 2:] - polynomials[:, :-2]) / (2 * degrees + 1)
    values = np.column_stack([1.0 + polynomials[:, 1], rising]) / 2.0
    return _Basis((1.0 + nodes) / 2.0, weights / 2.0, values[:-1], polynomials[:-1, :-1], values[-1])


def _fibres(specimen: TwistedBeam) -> Array:
    """Stiffness of stretch u' and twist theta', (2, 2), N, N*m, N*m^2."""
    e, b, t = specimen.material.youngs_modulus, specimen.width, specimen.thickness
    pretwist = specimen.twist / specimen.length
    second = b * t * (b**2 + t**2) / 12.0
    fourth = b * t * (b**4 + t**4) / 80.0 + b**3 * t**3 / 72.0
    rigidity = specimen.material.shear_modulus * torsion_constant(b, t)
    return np.array([[e * b * t, e * pretwist * second], [e * pretwist * second, rigidity + e * pretwist**2 * fourth]])


def _second_moments(specimen: TwistedBeam, x: Array) -> Array:
    """Integral of (y, z)(y, z)^T over the section at every x (q, 2, 2), m^4."""
    b, t = specimen.width, specimen.thickness
    angle = np.asarray(specimen.section_angle(x))
    along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    across = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
    return (
        t * b**3 / 12.0 * along[:, :, None] * along[:, None, :]
        + b * t**3 / 12.0 * across[:, :, None] * across[:, None, :]
    )


def _stiffness(specimen: TwistedBeam, basis: _Basis) -> Array:
    """Of all fields' polynomials, (6 n, 6 n)."""
    material, length = specimen.material, specimen.length
    section = np.zeros((len(basis.places), _FIELDS, _FIELDS))
    section[:, [0, 1], [0, 1]] = _SHEAR_FACTOR * material.shear_modulus * specimen.area
    section[:, 2:4, 2:4] = material.youngs_modulus * _second_moments(specimen, length * basis.places)
    section[:, 4:, 4:] = _fibres(specimen)
    strains = _of_every_field(basis.slopes / length) - _SLOPES @ _of_every_field(basis.values)
    return _integral(strains, section, length * basis.weights)


def _mass(specimen: TwistedBeam, basis: _Basis) -> Array:
    """Of beam and tip, (6 n, 6 n)."""
    moments = _second_moments(specimen, specimen.length * basis.places)
    density = specimen.effective_density
    section = np.zeros((len(basis.places), _FIELDS, _FIELDS))
    section[:, [0, 1, 4], [0, 1, 4]] = density * specimen.area
    section[:, 2:4, 2:4] = density * moments
    section[:, 5, 5] = density * np.trace(moments, axis1=1, axis2=2)
    beam = _integral(_of_every_field(basis.values), section, specimen.length * basis.weights)
    tip = _of_every_field(basis.tip[None])[0]
    return beam + tip.T @ _tip_mass(specimen) @ tip


def _of_every_field(rows: Array) -> Array:
    """The same polynomials (q, n) for each field: its value from all fields' coefficients (q, 6, 6 n)."""
    return np.asarray(np.kron(np.eye(_FIELDS), rows[:, None, :]), dtype=float)


def _integral(rows: Array, section: Array, weights: Array) -> Array:
    """Sum over the points q of weights rows^T section rows; rows (q, 6, 6 n), section (q, 6, 6)."""
    weighted = (weights[:, None, None] * section) @ rows
    flat = rows.shape[0] * rows.shape[1], rows.shape[2]
    result: Array = rows.reshape(flat).T @ weighted.reshape(flat)
    return (result + result.T) / 2.0


def _tip_mass(specimen: TwistedBeam) -> Array:
    """Mass matrix of what the tip carries for the fields there, (6, 6)."""
    moments = np.zeros((3, 3))
    moments[0, 0] = specimen.tip_mass
    face = _second_moments(specimen, np.array([specimen.length]))[0]
    moments[1:, 1:] = specimen.tip_mass / specimen.area * face
    if specimen.load_frame:
        moments += specimen.load_frame.moments()
    # Displacement (x, y, z) of a point of the face: 1, y and z times these rows of v, w, p_y, p_z, u, theta.
    shares = np.zeros((3, 3, _FIELDS))
    shares[0, [0, 1, 2], [4, 0, 1]] = 1.0
    shares[1, [0, 2], [2, 5]] = -1.0, 1.0
    shares[2, [0, 1], [3, 5]] = -1.0, -1.0
    return np.einsum("ij,ika,jkb->ab", moments, shares, shares)


def _frequency(turning: float, material: Material) -> float:
    """Frequency (Hz) with branches, of a mode with the angular frequency ``turning`` (rad/s) without them."""
    found, before = turning, 0.0
    while found - before > 1e-12 * found:
        shares = [(found * branch.time) ** 2 for branch in material.prony]
        stiffer = sum(branch.ratio * s / (1.0 + s) for branch, s in zip(material.prony, shares, strict=True))
        # All stiffness grows in the same proportion, so the shape stays; the rise is monotonous and bounded.
        before, found = found, turning * np.sqrt(1.0 + stiffer)
    return float(found / (2.0 * np.pi))


def _kind(specimen: TwistedBeam, basis: _Basis, stiffness: Array, shape: Array) -> Kind:
    """What holds most of the strain energy of a shape (6 n,)."""
    crosswise = slice(0, 4 * len(basis.tip))
    total = float(shape @ stiffness @ shape)
    bending = float(shape[crosswise] @ stiffness[crosswise, crosswise] @ shape[crosswise])
    twists = basis.slopes @ shape[5 * len(basis.tip) :] / specimen.length
    torsion = torsional_rigidity(specimen) * specimen.length * float(basis.weights @ twists**2)
    # What the fibres hold beyond torsion of the beam that may shorten freely is stretch of the whole section.
    parts: dict[Kind, float] = {"bending": bending, "torsion": torsion, "stretch": total - bending - torsion}
    largest = max(parts, key=lambda kind: parts[kind])
    return largest if parts[largest] >= _MOSTLY * total else "mixed"
