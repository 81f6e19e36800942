"""Parametric devices: one file each, immutable, validated when made."""

from typing import Annotated

from pydantic import Field

from lab.specimens.finned_tube import FinnedTube
from lab.specimens.pinched_tube import PinchedTube
from lab.specimens.twisted_beam import TwistedBeam

#: Any specimen.
Specimen = Annotated[TwistedBeam | PinchedTube | FinnedTube, Field(discriminator="kind")]

__all__ = ["FinnedTube", "PinchedTube", "Specimen", "TwistedBeam"]
