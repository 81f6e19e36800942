"""From a declaration's bodies to a mechanism: structure once, numbers for every candidate."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from prb.declared_parts import (
    DAMPING,
    FRICTION,
    MOTION,
    STIFFNESS,
    BodySpec,
    JointSpec,
    KneeSpec,
    TieSpec,
    TipSpec,
    Triple,
    kind_of_tie,
)
from prb.expressions import Number, environment, read
from prb.mechanism import CLAMP, Ballast, Branch, Hinge, Knee, Link, Mechanism, Tie, Vector

_INDEX = re.compile(r"\{([^{}]*)\}")
_CLAMP_NAME = "clamp"
Known = dict[str, Any]


@dataclass(frozen=True)
class _Part:
    """One body of the tree: its name, parent and joints' names with indices filled in, and its numbers."""

    spec: BodySpec
    index: Mapping[str, float]
    name: str
    parent: int
    define: tuple[tuple[str, Number], ...]
    link: Callable[[Known], dict[str, Any]]
    hinges: tuple[Callable[[Known], Hinge], ...]
    ties: tuple[Callable[[Known], Tie], ...]


class Assembly:
    """Structure of a declared model for given settings.

    Parameters
    ----------
    bodies, tip
        As declared.
    settings
        Values by name.

    Raises
    ------
    ValueError
        In one line, for a parent that does not exist or a name that is used twice.
    """

    def __init__(self, bodies: Sequence[BodySpec], tip: TipSpec, settings: Mapping[str, int]) -> None:
        parts: list[_Part] = []
        for spec in bodies:
            for index in _indices(spec, settings):
                parts.append(_part(spec, index, settings, parts))
        order = _depth_first([part.parent for part in parts])
        place = {old: new for new, old in enumerate(order)} | {CLAMP: CLAMP}
        self.parts = [parts[old] for old in order]
        self.parents = [place[part.parent] for part in self.parts]
        names = [part.name for part in parts]
        if tip.body and tip.body not in names:
            raise ValueError(f"tip: there is no body {tip.body!r}; there are {', '.join(names)}")
        self.tip_link = place[names.index(tip.body) if tip.body else len(parts) - 1]
        self.tip_place = _triple(tip.place, "m") if tip.place else None
        self.tip_face = [read(text, unit) for text, unit in zip(tip.face, ("m", "m", "rad"), strict=True)]
        hinges = [_filled(joint.name, part.index, settings) for part in parts for joint in part.spec.joints]
        ties = [_filled(tie.name, part.index, settings) for part in parts for tie in part.spec.ties]
        tied = [_filled(j, part.index, settings) for part in parts for tie in part.spec.ties for j in tie.joints]
        if unknown := sorted(set(tied) - set(hinges)):
            raise ValueError(
                f"a tie holds the joint {unknown[0]!r}, which does not exist; there are {', '.join(hinges)}"
            )
        for kind, used in (("bodies", names), ("joints", hinges), ("ties", ties)):
            if twice := sorted({name for name in used if used.count(name) > 1}):
                raise ValueError(f"two {kind} are named {twice[0]!r}; put the index in braces, as in 'link{{i}}'")

    def build(self, numbers: Mapping[str, float], tip_mass: float, ballast: Ballast | None = None) -> Mechanism:
        """Mechanism for the values of all names, with a mass (kg) and a rigid body at its tip.

        Raises
        ------
        ValueError
            In one line, for a number that cannot be evaluated or is not possible.
        """
        links, ties, common = [], [], environment(numbers)
        for part, parent in zip(self.parts, self.parents, strict=True):
            known = {**common, **part.index}
            for name, number in part.define:
                known[name] = number(known)
            try:
                hinges = tuple(make(known) for make in part.hinges)
                links.append(Link(part.name, hinges=hinges, parent=parent, **part.link(known)))
                ties += [make(known) for make in part.ties]
            except ValueError as error:
                raise ValueError(f"body {part.name}: {error}") from None
            if not (links[-1].mass > 0 and links[-1].length > 0 and links[-1].width > 0 and links[-1].thickness > 0):
                raise ValueError(f"body {part.name}: {_not_positive(links[-1])} must be positive")
        place = self.tip_place(common) if self.tip_place else None
        width, thickness, angle = (number(common) for number in self.tip_face)
        return Mechanism(tuple(links), tip_mass, self.tip_link, place, tuple(ties), (width, thickness, angle), ballast)


def _not_positive(link: Link) -> str:
    sides = {"mass": "kg", "length": "m", "width": "m", "thickness": "m"}
    return next(f"{k} {getattr(link, k):g} {unit}" for k, unit in sides.items() if not getattr(link, k) > 0)


def _indices(spec: BodySpec, settings: Mapping[str, int]) -> Iterator[dict[str, float]]:
    if not spec.repeat:
        yield {}
    for name, count in spec.repeat.items():
        for i in range(round(read(count, "1")(environment(settings)))):
            yield {name: float(i)}


def _part(spec: BodySpec, index: dict[str, float], settings: Mapping[str, int], before: Sequence[_Part]) -> _Part:
    names = [part.name for part in before]
    name = _filled(spec.name, index, settings)
    parent = CLAMP if not before else len(before) - 1
    if spec.parent is not None:
        wanted = _filled(spec.parent, index, settings)
        if wanted != _CLAMP_NAME and wanted not in names:
            known = ", ".join([_CLAMP_NAME, *names])
            raise ValueError(f"body {name}: its parent {wanted!r} does not exist before it; there are {known}")
        parent = CLAMP if wanted == _CLAMP_NAME else names.index(wanted)
    define = tuple((key, read(text, "1")) for key, text in spec.define.items())
    hinges = tuple(_hinge_maker(joint, _filled(joint.name, index, settings)) for joint in spec.joints)
    ties = tuple(_tie_maker(tie, spec, lambda text: _filled(text, index, settings)) for tie in spec.ties)
    return _Part(spec, index, name, parent, define, _link_maker(spec), hinges, ties)


def _filled(name: str, index: Mapping[str, float], settings: Mapping[str, int]) -> str:
    """A name with ``{i}`` or ``{i + 1}`` replaced by the number."""
    return _INDEX.sub(lambda found: str(round(read(found[1], "1")(environment(settings, index)))), name)


def _depth_first(parents: Sequence[int]) -> list[int]:
    """Numbers of the bodies in the simulator's order."""
    children: dict[int, list[int]] = {}
    for number, parent in enumerate(parents):
        children.setdefault(parent, []).append(number)
    order: list[int] = []
    waiting = [CLAMP]
    while waiting:
        number = waiting.pop()
        if number != CLAMP:
            order.append(number)
        waiting += reversed(children.get(number, []))
    return order


def _triple(written: Triple, unit: str) -> Callable[[Known], Vector]:
    x, y, z = (read(text, unit) for text in written)
    return lambda known: (x(known), y(known), z(known))


def _link_maker(spec: BodySpec) -> Callable[[Known], dict[str, Any]]:
    shape = spec.shape
    length, width, thickness = (read(side, "m") for side in (shape.length, shape.width, shape.thickness))
    mass, angle = read(spec.mass, "kg"), read(shape.angle, "rad")
    rotation = _triple(spec.rotation, "rad")
    place = _triple(spec.place, "m") if spec.place else None

    def link(known: Known) -> dict[str, Any]:
        return {
            "length": length(known), "width": width(known), "thickness": thickness(known), "mass": mass(known),
            "angle": angle(known), "place": place(known) if place else None, "rotation": rotation(known),
        }  # fmt: skip

    return link


def _hinge_maker(joint: JointSpec, name: str) -> Callable[[Known], Hinge]:
    law, stiffness_units = joint.spring, STIFFNESS[joint.kind]
    axis = _triple(joint.axis, "1")
    stiffness = [read(text, unit) for text, unit in zip(law.law, stiffness_units, strict=False)]
    damping = [read(text, unit) for text, unit in zip(joint.damper, DAMPING[joint.kind], strict=True)]
    rest = read(law.rest, MOTION[joint.kind])
    above, below = (_knee_maker(knee, joint) for knee in (law.above, law.below))
    friction = read(joint.friction, FRICTION[joint.kind])
    branches = [(read(b.stiffness, stiffness_units[0]), read(b.time, "s")) for b in joint.branches]

    def hinge(known: Known) -> Hinge:
        k, *higher = (number(known) for number in stiffness)
        b, *higher_damping = (number(known) for number in damping)
        made = Hinge(
            name, _unit(axis(known), name), k, b, joint.kind, joint.locked_in_motion,
            (higher[0], higher[1]) if higher else (0.0, 0.0), (higher_damping[0], higher_damping[1]), rest(known),
            above(known) if above else None, below(known) if below else None,
            tuple(Branch(share(known), time(known)) for share, time in branches), friction(known),
        )  # fmt: skip
        _check(made)
        return made

    return hinge


def _tie_maker(tie: TieSpec, body: BodySpec, filled: Callable[[str], str]) -> Callable[[Known], Tie]:
    kind, name = kind_of_tie(tie, body), filled(tie.name)
    springs = [read(text, unit) for text, unit in zip(tie.spring, STIFFNESS[kind], strict=True)]
    shares = [(filled(joint), read(text, "1")) for joint, text in tie.joints.items()]
    damper = read(tie.damper, DAMPING[kind][0])

    def make(known: Known) -> Tie:
        k, k2, k3 = (number(known) for number in springs)
        held = tuple((joint, share(known)) for joint, share in shares)
        return Tie(name, held, k, (k2, k3), damper(known))

    return make


def _knee_maker(knee: KneeSpec | None, joint: JointSpec) -> Callable[[Known], Knee] | None:
    if knee is None:
        return None
    at, stiffness = read(knee.at, MOTION[joint.kind]), read(knee.stiffness, STIFFNESS[joint.kind][0])
    return lambda known: Knee(at(known), stiffness(known))


def _check(hinge: Hinge) -> None:
    for name, value in (("damper", hinge.damping), ("friction", hinge.friction)):
        if value < 0:
            raise ValueError(f"joint {hinge.name}: its {name} is negative, {value:g}")
    if hinge.above and hinge.above.at < 0:
        raise ValueError(f"joint {hinge.name}: 'above' begins at {hinge.above.at:g}; it must not be negative")
    if hinge.below and hinge.below.at > 0:
        raise ValueError(f"joint {hinge.name}: 'below' begins at {hinge.below.at:g}; it must not be positive")
    for branch in hinge.branches:
        if not (branch.stiffness > 0 and branch.time > 0):
            raise ValueError(f"joint {hinge.name}: stiffness and time of a branch must be positive")


def _unit(axis: Vector, name: str) -> Vector:
    """The axis with length 1; untouched where it has that up to rounding."""
    square = axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2
    if square == 0.0:
        raise ValueError(f"joint {name}: its axis has no direction")
    if abs(square - 1.0) < 1e-12:
        return axis
    length = float(np.sqrt(square))
    return axis[0] / length, axis[1] / length, axis[2] / length
