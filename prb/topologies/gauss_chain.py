"""Rigid links joined at Gauss stations, where the continuum's curvatures are lumped into hinges."""

from collections.abc import Mapping

import numpy as np

from lab.specimens import TwistedBeam
from prb.mechanism import Hinge, Link, Mechanism
from prb.topologies.topology import Parameter, Topology

STATIONS = 3


def stations(length: float, count: int = STATIONS) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [0, length], both (count,), m."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1.0) * length / 2.0, weights * length / 2.0


def _joints(specimen: TwistedBeam, values: Mapping[str, float], index: int, angle: float, weight: float) -> list[Hinge]:
    """Slide, torsion, flat and edge joint of a station, whose section's width is at ``angle`` (rad)."""
    width, thickness = specimen.width, specimen.thickness
    modulus, tau, tau_t = values["E"], values["tau"], values["tau_t"]
    cosine, sine = float(np.cos(angle)), float(np.sin(angle))
    flat = modulus * width * thickness**3 / 12.0 / weight
    edge = modulus * thickness * width**3 / 12.0 / weight
    torsion = values["GJ"] / weight
    stretch = modulus * width * thickness / weight
    x = (1.0, 0.0, 0.0)
    return [
        Hinge(f"stretch{index}", x, stretch, tau * stretch, "slide", locked_in_motion=True),
        Hinge(f"torsion{index}", x, torsion, tau_t * torsion),
        Hinge(f"flat{index}", (0.0, cosine, sine), flat, tau * flat),
        Hinge(f"edge{index}", (0.0, -sine, cosine), edge, tau * edge),
    ]


def gauss_chain(specimen: TwistedBeam, values: Mapping[str, float], count: int = STATIONS) -> Mechanism:
    """Chain whose tip compliance is the Gauss quadrature of Kirchhoff beam theory.

    At the station s_i of weight w_i the section stands at a_i = root_angle + phi s_i / L.  Its joints
    have k = E W T^3 / (12 w_i) about the width (flat), E T W^3 / (12 w_i) about the thickness
    (edge), GJ / w_i about x and E W T / w_i along x, and b = tau k (tau_t k in torsion).

    The slide along x adds no free number.  Static experiments need it, since a tip that is held
    at x = L cannot move sideways on links of fixed length.  In motion it is locked: free, it would ring at
    some 2 kHz, lower the stable step where tau is small and cost a tenth to a half of the time, to
    move the markers of a ring-down by 0.02 to 0.2 % (E = 65 MPa, tau from 1 ms to 0.02 ms).

    Parameters
    ----------
    values
        E (Pa), GJ (N*m^2), tau and tau_t (s).
    count
        Stations; 3 is the declared topology, more serve convergence studies.
    """
    places, weights = stations(specimen.length, count)
    ends = np.array([0.0, *places, specimen.length])
    links = []
    for i, (start, end) in enumerate(zip(ends[:-1], ends[1:], strict=True)):
        angle = float(specimen.section_angle(start))
        hinges = tuple(_joints(specimen, values, i, angle, float(weights[i - 1]))) if i else ()
        mass = specimen.beam_mass * float(end - start) / specimen.length
        middle = float(specimen.section_angle((start + end) / 2.0))
        links.append(Link(f"link{i}", float(end - start), specimen.width, specimen.thickness, mass, middle, hinges))
    return Mechanism(tuple(links), specimen.tip_mass)


GAUSS_CHAIN = Topology(
    "gauss-chain",
    (
        Parameter("E", "Pa", "MPa", (1.0, "youngs_modulus"), 1e6, 1e9, "Young's modulus"),
        Parameter(
            "GJ", "N*m^2", "N*m^2", (1.0, "torsional_rigidity"), (0.05, "torsional_rigidity"),
            (20.0, "torsional_rigidity"), "torsional rigidity",
        ),
        Parameter("tau", "s", "ms", (1.0, "viscous_time"), 1e-5, 0.1, "damping over stiffness in bending"),
        Parameter("tau_t", "s", "ms", (1.0, "viscous_time"), 1e-5, 0.1, "damping over stiffness in torsion"),
    ),
    gauss_chain,
)  # fmt: skip
