"""What a rigid-link model is made of: plain data, in SI units and in the fixed axes at rest.

The chain runs from the clamp at the origin along +x.  All axes are given in the fixed axes, which
every link shares at rest.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Hinge:
    """Sprung and damped joint with one degree of freedom, at rest when its spring is slack.

    Parameters
    ----------
    name
        Identifier, unique in the mechanism.
    axis
        Unit vector of the turn or of the slide.
    stiffness, damping
        N*m/rad and N*m*s/rad of a rotation; N/m and N*s/m of a slide.
    kind
        ``rotation`` or ``slide``.
    locked_in_motion
        The joint gives way in static experiments only, see ``Mechanism.in_motion``.
    """

    name: str
    axis: Vector
    stiffness: float
    damping: float
    kind: Literal["rotation", "slide"] = "rotation"
    locked_in_motion: bool = False


@dataclass(frozen=True)
class Link:
    """Rigid box whose hinges sit at its proximal end.

    Parameters
    ----------
    name
        Identifier, unique in the mechanism.
    length, width, thickness
        Sides of the box along x, and along y and z turned by ``angle``, m.
    mass
        Spread evenly over the box, kg.
    angle
        Turn of the width about +x from +y, rad.
    hinges
        From the proximal to the distal one, all through the proximal end.  None: welded.
    """

    name: str
    length: float
    width: float
    thickness: float
    mass: float
    angle: float = 0.0
    hinges: tuple[Hinge, ...] = ()


@dataclass(frozen=True)
class Mechanism:
    """Serial chain of links, clamped at the origin.

    Parameters
    ----------
    links
        From the clamp to the tip.
    tip_mass
        Point mass at the far end of the last link, kg.
    """

    links: tuple[Link, ...]
    tip_mass: float = 0.0

    @property
    def hinges(self) -> tuple[Hinge, ...]:
        """Every joint, from the clamp to the tip: the order of the joint coordinates."""
        return tuple(hinge for link in self.links for hinge in link.hinges)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Joint stiffnesses in the order of ``hinges``, (joints,), N*m/rad or N/m."""
        return np.array([hinge.stiffness for hinge in self.hinges])

    @property
    def nodes(self) -> NDArray[np.float64]:
        """Ends of the links at rest, (links + 1, 3), m; the last one is the tip's centre."""
        nodes = np.zeros((len(self.links) + 1, 3))
        nodes[1:, 0] = np.cumsum([link.length for link in self.links])
        return nodes

    @property
    def in_motion(self) -> "Mechanism":
        """The mechanism without the joints that are locked in dynamic experiments."""
        links = (replace(k, hinges=tuple(h for h in k.hinges if not h.locked_in_motion)) for k in self.links)
        return replace(self, links=tuple(links))
