"""Parametric devices: one file each, immutable, validated when made."""

from lab.specimens.twisted_beam import TwistedBeam

#: Any specimen; a second device makes this a union discriminated by ``kind``.
Specimen = TwistedBeam

__all__ = ["Specimen", "TwistedBeam"]
