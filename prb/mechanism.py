"""What a rigid-link model is made of: plain data, in SI units.

Links form a tree that hangs on the clamp.  A link's frame has its origin at its proximal end and its x-axis
towards its far end; the clamp's frame is the fixed one, x along the specimen.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
#: Parent of the links that hang on the clamp.
CLAMP = -1


@dataclass(frozen=True)
class Knee:
    """Where a spring's slope changes: beyond ``at`` (rad or m from its rest) it is ``stiffness``."""

    at: float
    stiffness: float


@dataclass(frozen=True)
class Branch:
    """Maxwell branch beside a spring: ``stiffness`` (as the spring's) that relaxes within ``time`` (s)."""

    stiffness: float
    time: float


@dataclass(frozen=True)
class Hinge:
    """Sprung and damped joint with one degree of freedom.

    At the coordinate q, x = q - rest, its spring resists with k x + k2 x^2 + k3 x^3, whose slope is changed
    beyond the knees, and its damper with b v + b2 v |v| + b3 v^3.

    Parameters
    ----------
    name
        Identifier, unique in the mechanism.
    axis
        Unit vector of the turn or of the slide, in the link's frame.
    stiffness, damping
        k in N*m/rad and b in N*m*s/rad of a rotation; N/m and N*s/m of a slide.
    kind
        ``rotation`` or ``slide``.
    locked_in_motion
        The joint gives way in static experiments only, see ``Mechanism.in_motion``.
    higher, higher_damping
        (k2, k3) and (b2, b3), in the same units over powers of rad or m and of rad/s or m/s.
    rest
        Coordinate at which the spring is slack, rad or m.
    above, below
        Knee at x >= 0 for larger x, and at x <= 0 for smaller x.
    branches
        Maxwell branches, relaxed in every static state.
    friction
        Dry friction: moment (N*m) or force (N) below which the joint sticks in motion; static states have none.
    """

    name: str
    axis: Vector
    stiffness: float
    damping: float
    kind: Literal["rotation", "slide"] = "rotation"
    locked_in_motion: bool = False
    higher: tuple[float, float] = (0.0, 0.0)
    higher_damping: tuple[float, float] = (0.0, 0.0)
    rest: float = 0.0
    above: Knee | None = None
    below: Knee | None = None
    branches: tuple[Branch, ...] = ()
    friction: float = 0.0

    @property
    def structure(self) -> Hashable:
        """What hinges share whose models differ in numbers alone."""
        return self.name, self.kind, self.above is None, self.below is None, len(self.branches)


@dataclass(frozen=True)
class Tie:
    """Spring and damper that resist a combination of joint coordinates, L = sum of share * q.

    Its energy k L^2 / 2 + k2 L^3 / 3 + k3 L^4 / 4 couples the joints: each feels share * (k L + k2 L^2 + k3 L^3).

    Parameters
    ----------
    name
        Identifier, unique among ties.
    shares
        Share of each joint by its name.
    stiffness, higher, damping
        k, (k2, k3), and b of b dL/dt.
    """

    name: str
    shares: tuple[tuple[str, float], ...]
    stiffness: float
    higher: tuple[float, float] = (0.0, 0.0)
    damping: float = 0.0


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
    parent
        Number of the link that this one hangs on, ``CLAMP``, or None: the link before (the clamp for the first).
    place
        Of the proximal end in the parent's frame, m.  None: the parent's far end.
    rotation
        Rotation vector from the parent's frame to this one, rad.
    """

    name: str
    length: float
    width: float
    thickness: float
    mass: float
    angle: float = 0.0
    hinges: tuple[Hinge, ...] = ()
    parent: int | None = None
    place: Vector | None = None
    rotation: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Ballast:
    """Rigid body that a mechanism carries at its tip.

    Parameters
    ----------
    mass
        kg.
    centre
        Of its mass, from the tip in the fixed axes with slack springs, m.
    inertia
        About that centre along the same axes, (3, 3), kg*m^2.
    """

    mass: float
    centre: Vector
    inertia: tuple[Vector, Vector, Vector]


@dataclass(frozen=True)
class Mechanism:
    """Tree of links on the clamp, which is at the origin.

    Parameters
    ----------
    links
        Every link after its parent, branch by branch: a link hangs on the one before or on one of that one's
        ancestors, which is the order of the simulator.
    tip_mass
        Mass at the tip, kg.
    tip_face
        Rectangle over which the tip's mass is spread, square to x: width and thickness (m), and the angle of the
        width from +y about +x in the frame of the tip's link (rad).  A point unless given.
    ballast
        What the tip's link carries beside that mass, such as a load frame; None: nothing.
    ties
        Springs between joints.
    tip_link, tip_place
        Link that carries the tip (None: the last), and the tip's place in its frame, m (None: its far end).
    """

    links: tuple[Link, ...]
    tip_mass: float = 0.0
    tip_link: int | None = None
    tip_place: Vector | None = None
    ties: tuple[Tie, ...] = ()
    tip_face: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ballast: Ballast | None = None

    @property
    def hinges(self) -> tuple[Hinge, ...]:
        """Every joint in the order of the links: the order of the joint coordinates."""
        return tuple(hinge for link in self.links for hinge in link.hinges)

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Linear stiffnesses in the order of ``hinges``, (joints,), N*m/rad or N/m."""
        return np.array([hinge.stiffness for hinge in self.hinges])

    def parent(self, number: int) -> int:
        """Number of the link that link ``number`` hangs on, or ``CLAMP``."""
        declared = self.links[number].parent
        return number - 1 if declared is None else declared

    def place(self, number: int) -> Vector:
        """Proximal end of link ``number`` in its parent's frame, m."""
        link, parent = self.links[number], self.parent(number)
        if link.place is not None:
            return link.place
        return (0.0, 0.0, 0.0) if parent == CLAMP else (self.links[parent].length, 0.0, 0.0)

    @property
    def tip(self) -> tuple[int, Vector]:
        """Number of the link that carries the tip, and the tip's place in its frame, m."""
        number = len(self.links) - 1 if self.tip_link is None else self.tip_link
        return number, (self.links[number].length, 0.0, 0.0) if self.tip_place is None else self.tip_place

    @property
    def in_motion(self) -> "Mechanism":
        """The mechanism without the joints that are locked in dynamic experiments, and without their ties."""
        locked = {hinge.name for hinge in self.hinges if hinge.locked_in_motion}
        if not locked:
            return self
        links = tuple(replace(k, hinges=tuple(h for h in k.hinges if h.name not in locked)) for k in self.links)
        ties = tuple(tie for tie in self.ties if not locked.intersection(name for name, _ in tie.shares))
        return replace(self, links=links, ties=ties)

    @property
    def structure(self) -> Hashable:
        """What mechanisms share whose models differ in numbers alone."""
        links = tuple((k.name, k.parent, tuple(h.structure for h in k.hinges)) for k in self.links)
        return links, self.tip_link, tuple((tie.name, *(name for name, _ in tie.shares)) for tie in self.ties)
