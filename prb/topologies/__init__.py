"""Declared topologies: one file each, data only."""

from collections.abc import Mapping

from prb.topologies.five_hinge import FIVE_HINGE, FIVE_HINGE_ANISOTROPIC
from prb.topologies.gauss_chain import GAUSS_CHAIN
from prb.topologies.topology import Parameter, Topology

#: Every topology by the name that a study uses.
TOPOLOGIES: Mapping[str, Topology] = {item.name: item for item in (FIVE_HINGE, FIVE_HINGE_ANISOTROPIC, GAUSS_CHAIN)}

__all__ = ["TOPOLOGIES", "Parameter", "Topology"]
