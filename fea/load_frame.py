"""The load frame of a specimen in elements: a stiff block holds the tip face, on which the frame's mass rides.

Without the block the mass follows the face's own strain: the shear of the last millimetres of a thin beam is soft
enough to lower the second to fourth frequency of the default beam by 4 to 13 % and to add slow vibrations of its own.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fea.coupled_mass import CoupledMass
from fea.stiff_block import with_block
from lab.specimens import TwistedBeam
from lab.specimens.load_frame import LoadFrame

Array = NDArray[np.float64]

#: Stiffness of the block over that of the beam, and its length over the beam's thickness.
STIFFENING, _LENGTH = 1000.0, 1.0
#: Share of the frame's mass that the block has, so that none of its nodes is without.
_SHARE = 1e-3
_NAME = "frame"


@dataclass(frozen=True)
class FramedMesh:
    """Mesh of a specimen with its load frame, and what its elements have.

    Parameters
    ----------
    mesh
        Elements of the block behind those of the beam.
    density, stiffening
        Of every element (elements,), kg/m^3 and 1.
    mass
        What rides on the tip face.
    """

    mesh: Any
    density: Array
    stiffening: Array
    mass: CoupledMass


def framed(specimen: TwistedBeam, frame: LoadFrame, mesh: Any) -> FramedMesh:
    """Put the frame on the boundary ``tip`` of a mesh of the specimen, whose axis is x."""
    length = _LENGTH * specimen.thickness
    longer = with_block(mesh, "tip", np.array([length, 0.0, 0.0]), _NAME)
    block = longer.subdomains[_NAME]
    density, stiffening = np.full(longer.nelements, specimen.effective_density), np.ones(longer.nelements)
    density[block], stiffening[block] = _SHARE * frame.total_mass / (specimen.area * length), STIFFENING
    moments, known = np.zeros((4, 4)), [0, 2, 3]
    moments[np.ix_(known, known)] = (1.0 - _SHARE) * frame.moments()
    return FramedMesh(longer, density, stiffening, CoupledMass("tip", moments))
