"""Contact with rigid planes and between deformable surfaces; every class here is a ``fea.terms.Term``."""

from fea.contact.law import ContactLaw
from fea.contact.plane import CarriedPlane, Plane, PlaneContact
from fea.contact.surfaces import SurfaceContact

__all__ = ["CarriedPlane", "ContactLaw", "Plane", "PlaneContact", "SurfaceContact"]
