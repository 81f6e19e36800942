"""What a pinched tube is to a rigid-link model: numbers of its hinge over pinch angle and travel of the tendons.

They are learned relative to the first-order theory (``lab.pinching.first_order``), which already knows the kink of
every curve at alpha = 0 and how steeply the axis turns at 60 deg: the axis counts from the theory's, forces are
multiplied by its strength, and travels divided by it.  Bending stiffness and flatness are tensors across the tube,
which stay smooth where an open tube has no axis.  Between fitted pinch angles each number follows a monotone cubic;
the symmetry of the device (``lab.pinching.distinct``) takes care of the rest of the turn.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from lab.materials import Frozen
from lab.pinching import Equivalent, FirstOrder, ForceLaw, distinct, first_order, pair_shares
from lab.specimens import PinchedTube

Array = NDArray[np.float64]
#: Columns of a table, what they mean, and their units.  ``bend``: mean and both parts of the tensor's deviation, the
#: first along the theory's axis; ``flat`` likewise.
COLUMNS: Mapping[str, str] = {
    "travel": "m", "force": "N", "contact": "N", "gap": "m", "strain": "1", "flat_along": "1", "flat_askew": "1",
    "bend_mean": "N*m/rad", "bend_along": "N*m/rad", "bend_askew": "N*m/rad", "torsion": "N*m/rad",
    "lever": "m", "shortening": "m", "give_across": "m/N", "give_along": "m/N",
}  # fmt: skip
#: Numbers of the closed tube whose tendons are held, and their units: as the columns, and how springs go on beyond a
#: knee, and ``twist``: twist over the turn about x and y that it comes with.
HELD: Mapping[str, str] = {
    **{name: COLUMNS[name] for name in (
        "bend_mean", "bend_along", "bend_askew", "torsion", "lever", "give_across", "give_along",
    )},
    "knee_soft": "rad", "knee_stiff": "rad", "beyond_soft": "1", "beyond_stiff": "1", "twist_x": "1", "twist_y": "1",
}  # fmt: skip
#: A spring without a knee: where it would be, rad, and the slope beyond over that before.
STRAIGHT = {
    "knee_soft": 0.1,
    "knee_stiff": 0.1,
    "beyond_soft": 1.0,
    "beyond_stiff": 1.0,
    "twist_x": 0.0,
    "twist_y": 0.0,
}
#: Share of the pinch at which walls or pads first touch: before it shares are even in the travel, and so are those
#: from there to the end, which is often but a hundredth of a millimetre away.
TOUCH = 0.9
#: What the gap is at the first touch and beyond, m: contact has begun between them.
_GAPS = (1e-12, -1e-9)
#: Slides give at least this share of what the hinge does, so that their stiffness exists.
_LEAST_GIVE = 1e-6


@dataclass(frozen=True)
class HingeState:
    """Numbers of a hinge at one pinch angle and share of the travel.

    Parameters
    ----------
    travel, force, contact, gap
        Of the tendons, m; F_p, N; between the walls, N and m (NaN: none yet).
    strain
        Largest of the wall, 1.
    flatness
        Share of the width that is gone, and the line of largest extent from +x, rad.
    bending
        Tensor of the stiffness against turning about x and y, (2, 2), N*m/rad.
    parameters
        By the names of the shipped topologies for tubes, SI.
    """

    travel: float
    force: float
    contact: float
    gap: float
    strain: float
    flatness: tuple[float, float]
    bending: Array
    parameters: Mapping[str, float]


class HingeTable(Frozen):
    """Curves at one distinct pinch angle over the share of the pinch, columns as ``COLUMNS``.

    Travel and forces are those of one pair alone by the first-order theory: travel over its strength, forces times it.
    Where walls and pads never touch, the pinch ends at the share ``TOUCH``, and nothing changes beyond.  ``held`` has
    numbers named in ``HELD`` of the closed tube at rest with its tendons held, which a moving pinch may not have
    reached; those left out are the last of the columns, and springs that are straight.
    """

    pinch_angle: float = Field(ge=0)
    touches: bool
    columns: dict[str, tuple[float, ...]]
    held: dict[str, float] = {}

    @property
    def closed(self) -> dict[str, float]:
        """All numbers in ``HELD``."""
        return {name: self.held.get(name, self.columns[name][-1] if name in COLUMNS else STRAIGHT[name])
                for name in HELD}  # fmt: skip


class HingeCurves(Frozen):
    """Curves of all fitted pinch angles, as a fit of kind ``hinge`` makes them."""

    pairs: int = Field(ge=1)
    law: ForceLaw = "published"
    #: Shares of the pinch at which the tables stand, from 0 to 1.
    shares: tuple[float, ...] = Field(min_length=2)
    tables: tuple[HingeTable, ...] = Field(min_length=1)
    #: Largest turn from which springs were learned, rad; 0: none was, and they are linear.
    turned: float = Field(0.0, ge=0)
    #: The specimen of the fit, as plain data.
    specimen: dict[str, Any]

    @model_validator(mode="after")
    def _tables_are_in_order(self) -> Self:
        angles = [table.pinch_angle for table in self.tables]
        if sorted(set(angles)) != angles:
            raise ValueError("tables: pinch angles must rise")
        for table in self.tables:
            if wrong := {n for n in (*COLUMNS, *table.columns)
                         if len(table.columns.get(n, ())) != len(self.shares) or n not in COLUMNS}:  # fmt: skip
                raise ValueError(f"tables: column {min(wrong)} must have one number for each of the shares")
            if unknown := set(table.held) - set(HELD):
                raise ValueError(f"tables: held has no number {min(unknown)!r}; it may have {', '.join(HELD)}")
        return self

    def doubts(self, specimen: PinchedTube) -> tuple[str, ...]:
        """In what a specimen differs from that of the fit."""
        own = specimen.model_dump(mode="json")
        return tuple(
            f"{k} is {own.get(k)}, but was {v} in the fit" for k, v in self.specimen.items() if own.get(k) != v
        )

    def refusal(self, pinch_angle: float) -> str:
        """Why there is no hinge at a pinch angle (rad); empty where there is one."""
        angle = distinct(pinch_angle, self.pairs).pinch_angle
        low, high = self.tables[0].pinch_angle, self.tables[-1].pinch_angle
        if low - 1e-9 <= angle <= high + 1e-9:
            return ""
        wanted, low, high = (float(np.rad2deg(a)) for a in (angle, low, high))
        return (
            f"pinch_angle is the image of {wanted:.4g} deg, and the hinge was fitted from {low:.4g} to {high:.4g} deg"
        )

    def touches(self, pinch_angle: float) -> bool:
        """Whether walls or pads touch at a pinch angle (rad): they do where they did at all fitted ones."""
        return self._at(pinch_angle).touches

    def state(self, pinch_angle: float, share: float, *, pinching: bool = False) -> HingeState:
        """The hinge at a pinch angle (rad) and share of the pinch (0 to 1, first touch at ``TOUCH``).

        Once it is closed its tendons are held, unless it is ``pinching`` still.
        """
        at, share = self._at(pinch_angle), float(np.clip(share, 0.0, 1.0))
        image, theory = at.image, at.theory
        found = {**STRAIGHT, **dict(zip(COLUMNS, at.columns(share).tolist(), strict=True))}
        if not pinching and (share > TOUCH or (share == TOUCH and not at.touches)):
            found |= at.held
        stiffer, bend = found["bend_mean"], complex(found["bend_along"], found["bend_askew"])
        flat = complex(found["flat_along"], found["flat_askew"])
        axis = image.axis(theory.axis + float(np.angle(bend)) / 2)
        cosine, sine = np.cos(2 * axis), np.sin(2 * axis)
        # Twist over turn goes like a vector: of what a mirror does to turns and to twists, one sign is left.
        [twist] = image.points(np.array([[found["twist_x"], found["twist_y"]]]))
        tensor = stiffer * np.eye(2) - abs(bend) * np.array([[cosine, sine], [sine, -cosine]])
        length = float(self.specimen["length"])
        least = _LEAST_GIVE * length**2 / abs(stiffer)
        closed = at.touches and share > TOUCH
        gap = min(found["gap"], _GAPS[1]) if closed else max(found["gap"], _GAPS[0])
        return HingeState(
            found["travel"] * theory.strength, found["force"] / theory.strength,
            found["contact"] / theory.strength if closed else 0.0, gap, found["strain"],
            (abs(flat), image.axis(theory.axis + float(np.angle(flat)) / 2)), tensor,
            {
                "axis": axis, "k_soft": stiffer - abs(bend), "k_stiff": stiffer + abs(bend),
                "k_torsion": found["torsion"],
                "place": float(np.clip(length - found["shortening"] - found["lever"], 0.05 * length, 0.8 * length)),
                "shortening": found["shortening"],
                "k_across": 1.0 / max(found["give_across"], least), "k_along": 1.0 / max(found["give_along"], least),
                **{name: found[name] for name in ("knee_soft", "knee_stiff", "beyond_soft", "beyond_stiff")},
                "twist_soft": float(twist @ [np.cos(axis), np.sin(axis)]),
                "twist_stiff": float(twist @ [-np.sin(axis), np.cos(axis)]),
            },
        )  # fmt: skip

    def _at(self, pinch_angle: float) -> "_AtAngle":
        if pinch_angle not in self._known:
            self._known[pinch_angle] = self._blended(pinch_angle)
        return self._known[pinch_angle]

    @cached_property
    def _known(self) -> dict[float, "_AtAngle"]:
        return {}

    def _blended(self, pinch_angle: float) -> "_AtAngle":
        """Curves between those of the fitted pinch angles."""
        from scipy.interpolate import PchipInterpolator  # 0.3 s, which only tubes need

        image = distinct(pinch_angle, self.pairs)
        theory = first_order(pair_shares(image.pinch_angle, self.pairs, self.law))
        angles = np.array([table.pinch_angle for table in self.tables])
        angle = float(np.clip(image.pinch_angle, angles[0], angles[-1]))

        def blend(values: Any) -> Any:
            values = np.array(values, dtype=float)
            return values[0] if len(angles) == 1 else PchipInterpolator(angles, values)(angle)

        columns = blend([[table.columns[name] for name in COLUMNS] for table in self.tables])
        held = blend([list(table.closed.values()) for table in self.tables])
        return _AtAngle(
            image, theory, all(table.touches for table in self.tables), PchipInterpolator(self.shares, columns.T),
            dict(zip(HELD, held.tolist(), strict=True)),
        )  # fmt: skip


@dataclass(frozen=True)
class _AtAngle:
    """At one pinch angle: its image, theory at that, whether walls touch, columns over the share, numbers held."""

    image: Equivalent
    theory: FirstOrder
    touches: bool
    columns: Callable[[float], Array]
    held: Mapping[str, float]
