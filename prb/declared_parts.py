"""Parts of a declared model: parameters, settings, and bodies with their joints.

Every number is a quantity with unit, or a formula in SI units of parameters, settings, numbers of the specimen and
of its material, and what ``define`` names.
"""

import re
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from lab.materials import Frozen
from prb.expressions import Written, read

Triple = tuple[Written, Written, Written]


def _coefficients(written: Any) -> Any:
    return (written, 0.0, 0.0) if isinstance(written, str | float | int) else written


#: Coefficients of x, x^2 and x^3; a number alone is the first.
Polynomial = Annotated[Triple, BeforeValidator(_coefficients, json_schema_input_type=Written | Triple)]
_SI = {"m", "kg", "s", "N", "Pa", "J", "W", "Hz", "K", "rad"}
#: SI units of a spring's k, k2, k3 and of a damper's b, b2, b3, for each kind of joint.
STIFFNESS = {"rotation": ("N*m/rad", "N*m/rad^2", "N*m/rad^3"), "slide": ("N/m", "N/m^2", "N/m^3")}
DAMPING = {
    "rotation": ("N*m*s/rad", "N*m*s^2/rad^2", "N*m*s^3/rad^3"),
    "slide": ("N*s/m", "N*s^2/m^2", "N*s^3/m^3"),
}
FRICTION = {"rotation": "N*m", "slide": "N"}
MOTION = {"rotation": "rad", "slide": "m"}


class Setting(Frozen):
    """Whole number that changes the structure, as the number of stations; ``value`` unless a study chooses."""

    value: int
    lower: int = 1
    upper: int = 100
    meaning: str = ""

    @model_validator(mode="after")
    def _within(self) -> Self:
        if not self.lower <= self.value <= self.upper:
            raise ValueError(f"{self.value} is out of bounds; allowed: {self.lower} to {self.upper}")
        return self


class ParameterSpec(Frozen):
    """Free number: SI unit of its values, unit that a person reads, nominal value, bounds (inclusive), meaning."""

    unit: str
    shown_in: str = ""
    nominal: Written
    lower: Written
    upper: Written
    meaning: str = ""

    @model_validator(mode="before")
    @classmethod
    def _has_a_unit(cls, data: Any) -> Any:
        if isinstance(data, dict) and "unit" not in data:
            raise ValueError("it has no unit; write one like 'unit: N*m/rad' ('1' for a plain number)")
        return data

    @field_validator("unit")
    @classmethod
    def _is_si(cls, unit: str) -> str:
        if unknown := set(re.findall(r"[^\W\d_]+", unit)) - _SI:
            raise ValueError(f"{unit!r} is not made of SI units ({', '.join(unknown)}); put it in 'shown_in'")
        return unit

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, nominal, high = (read(w, self.unit).value for w in (self.lower, self.nominal, self.upper))
        if low is not None and high is not None and not low < high:
            raise ValueError(f"lower {self.lower} is not below upper {self.upper}")
        if nominal is not None and ((low is not None and nominal < low) or (high is not None and nominal > high)):
            raise ValueError(f"nominal {self.nominal} is out of its bounds, {self.lower} to {self.upper}")
        return self


class KneeSpec(Frozen):
    """Beyond ``at`` (from the rest of the spring) its slope is ``stiffness``."""

    at: Written
    stiffness: Written


class SpringSpec(Frozen):
    """Spring: ``stiffness`` k, or ``polynomial`` [k, k2, k3] of x = q - rest; knees make it bilinear.

    ``above`` changes the slope for larger x (its ``at`` >= 0), ``below`` for smaller x (its ``at`` <= 0).  A number
    alone is k.
    """

    stiffness: Written | None = None
    polynomial: Triple | None = None
    rest: Written = 0.0
    above: KneeSpec | None = None
    below: KneeSpec | None = None

    @model_validator(mode="before")
    @classmethod
    def _in_full(cls, data: Any) -> Any:
        return {"stiffness": data} if isinstance(data, str | float | int) else data

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        if self.polynomial and (self.stiffness is not None or self.above or self.below):
            raise ValueError("a polynomial spring has neither 'stiffness' nor knees")
        return self

    @property
    def law(self) -> tuple[Written, ...]:
        """k, or k, k2 and k3."""
        return self.polynomial or ("0" if self.stiffness is None else self.stiffness,)


class BranchSpec(Frozen):
    """Maxwell branch: a spring that relaxes within ``time``."""

    stiffness: Written
    time: Written


class JointSpec(Frozen):
    """Joint at the proximal end of a body."""

    name: str
    kind: Literal["rotation", "slide"] = "rotation"
    axis: Triple
    spring: SpringSpec = SpringSpec()
    #: The polynomial [b, b2, b3] of b v + b2 v |v| + b3 v^3; a number alone is b.
    damper: Polynomial = (0.0, 0.0, 0.0)
    branches: tuple[BranchSpec, ...] = ()
    #: Dry friction: moment or force below which the joint sticks in motion.
    friction: Written = 0.0
    #: Gives way in static experiments only.
    locked_in_motion: bool = False


class TieSpec(Frozen):
    """Spring between joints: it resists L, the sum of each joint's share times its coordinate.

    ``spring`` is the polynomial [k, k2, k3] of L, a number alone is k; it is in the unit of rotations unless a joint
    is a slide.
    """

    name: str
    joints: dict[str, Written] = Field(min_length=1)
    spring: Polynomial
    damper: Written = 0.0


class ShapeSpec(Frozen):
    """Box of a body: sides along x, and along y and z turned by ``angle`` about x."""

    length: Written
    width: Written
    thickness: Written
    angle: Written = 0.0


class BodySpec(Frozen):
    """Rigid body, or a row of them with ``repeat``.

    ``repeat: {i: stations}`` makes one body for each i = 0, 1, ..., stations - 1; names may hold ``{i}``.
    ``define`` names numbers for this body.  A body hangs on ``parent`` (the one before when left out; the first on
    the ``clamp``) at ``place`` in its frame (its far end when left out), turned by the vector ``rotation``.
    """

    name: str
    repeat: dict[str, Written] = Field(default_factory=dict, max_length=1)
    define: dict[str, Written] = Field(default_factory=dict)
    parent: str | None = None
    place: Triple | None = None
    rotation: Triple = (0.0, 0.0, 0.0)
    shape: ShapeSpec
    mass: Written
    joints: tuple[JointSpec, ...] = ()
    ties: tuple[TieSpec, ...] = ()


class TipSpec(Frozen):
    """Body that ends in the specimen's tip (the last one when left out), and where (its far end); tip_mass sits there.

    The mass is glued to the tip face, a rectangle of these sides whose width stands at ``angle`` from +y about +x in
    the body's frame, and so is the specimen's load frame; unless ``carries`` is false, for a declaration that has
    ``tip_mass`` in a body of its own and takes no load frame.
    """

    body: str = ""
    place: Triple | None = None
    width: Written = "width"
    thickness: Written = "thickness"
    angle: Written = "root_angle + twist"
    carries: bool = True

    @property
    def face(self) -> Triple:
        """Width, thickness and angle."""
        return self.width, self.thickness, self.angle


def written_numbers(body: BodySpec) -> list[tuple[str, Written, str]]:
    """Every number of a body: where it stands, what is written, and its SI unit."""
    found = [(f"define.{name}", text, "1") for name, text in body.define.items()]
    found += [(f"place.{i}", text, "m") for i, text in enumerate(body.place or ())]
    found += [(f"rotation.{i}", text, "rad") for i, text in enumerate(body.rotation)]
    found += [(f"shape.{side}", getattr(body.shape, side), "m") for side in ("length", "width", "thickness")]
    found += [("shape.angle", body.shape.angle, "rad"), ("mass", body.mass, "kg")]
    for joint in body.joints:
        found += [(f"joints.{joint.name}.{where}", text, unit) for where, text, unit in _joint_numbers(joint)]
    for tie in body.ties:
        kind = kind_of_tie(tie, body)
        found += [(f"ties.{tie.name}.joints.{joint}", text, "1") for joint, text in tie.joints.items()]
        found += [(f"ties.{tie.name}.spring", t, unit) for t, unit in zip(tie.spring, STIFFNESS[kind], strict=True)]
        found += [(f"ties.{tie.name}.damper", tie.damper, DAMPING[kind][0])]
    return found


def kind_of_tie(tie: TieSpec, body: BodySpec) -> Literal["rotation", "slide"]:
    """Whose units a tie's spring has: those of slides when it holds one of the body's slides."""
    slides = {joint.name for joint in body.joints if joint.kind == "slide"}
    return "slide" if slides.intersection(tie.joints) else "rotation"


def _joint_numbers(joint: JointSpec) -> list[tuple[str, Written, str]]:
    law, stiffness, motion = joint.spring, STIFFNESS[joint.kind], MOTION[joint.kind]
    found = [(f"axis.{i}", text, "1") for i, text in enumerate(joint.axis)]
    found += [("spring", text, unit) for text, unit in zip(law.law, stiffness, strict=False)]
    found += [("spring.rest", law.rest, motion)]
    found += [("damper", text, unit) for text, unit in zip(joint.damper, DAMPING[joint.kind], strict=True)]
    found += [("friction", joint.friction, FRICTION[joint.kind])]
    for name, knee in (("above", law.above), ("below", law.below)):
        if knee:
            found += [
                (f"spring.{name}.at", knee.at, motion),
                (f"spring.{name}.stiffness", knee.stiffness, stiffness[0]),
            ]
    for branch in joint.branches:
        found += [("branches.stiffness", branch.stiffness, stiffness[0]), ("branches.time", branch.time, "s")]
    return found
