"""Which way of reading table 5.1 fits best.

The table does not say how each beam was clamped, which sense of twist its axes imply, nor how
stiff the rig was.  Each reading is fitted with its own Young's modulus, and its own rig stiffness where
the rig may give way, and they are ranked by what is left over.

With the beam's modulus E and a rig of stiffness c, dimensional analysis gives exactly
K'(E, c) = (E / E0) K'(E0, c E0 / E), so that a table at E0 over some rig stiffnesses covers all.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar

from calibrate.modulus import Row, best_factor, row_scales
from calibrate.spec import FORCE_ENTRIES
from lab.experiments import KPRIME_ENTRIES

Array = NDArray[np.float64]
#: (twist in deg, root angle in deg, rig stiffness in N/m or None for a rigid one).
Key = tuple[float, float, float | None]
Table = Mapping[Key, Row]
#: Twist magnitude, in deg, of the rows whose clamp may have been turned.
TURNED_ROWS = 45.0
_GRID = 200
#: Images of (F_y, F_z, M_x), and of the motions alike: turned by 90 deg about x; mirrored in y.
_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
#: Quarter turns about x, by angle (deg).
_TURNS = {0.0: np.eye(3), 90.0: _TURN, -90.0: _TURN.T}
_MIRROR = np.diag([-1.0, 1.0, -1.0])


@dataclass(frozen=True)
class RankedReading:
    """One way of reading the table, fitted.

    Parameters
    ----------
    mount_angle
        Root angle of the +-45 deg rows, deg; the others have 0.
    twist_sense
        +1: the published twist is right-handed about +x; -1: left-handed.
    youngs_modulus
        Pa.
    rig_stiffness
        N/m; None for a rigid rig, given or found.
    misfit
        Root mean square of (model - lab) / scale over all entries.
    row_misfits
        The same per row, by published twist in deg.
    at_edge
        Whether the optimum lies at an end of the computed rig stiffnesses.
    """

    mount_angle: float
    twist_sense: int
    compliant_rig: bool
    youngs_modulus: float
    rig_stiffness: float | None
    misfit: float
    row_misfits: Mapping[float, float]
    at_edge: bool


def rank_readings(
    table: Table, lab: Mapping[float, Row], youngs_modulus: float, entries: Sequence[str] = FORCE_ENTRIES
) -> list[RankedReading]:
    """Fit every reading and sort by misfit, the best one first.

    Readings: mount angle of the +-45 deg rows 0 or 90 deg, twist sense +-1, rig rigid or compliant (the
    latter when the table has rigs that give way).

    Parameters
    ----------
    table
        Computed K' at ``youngs_modulus`` (Pa), rigid rig included.  Beams with the root at 90 deg or
        with the opposite twist follow by symmetry where they are missing.
    lab
        Measured rows by published twist, deg; SI.
    """
    rigs = sorted({key[2] for key in table if key[2] is not None})
    kinds = (False, True) if rigs else (False,)
    found = []
    for mount, sense, compliant in product((0.0, 90.0), (1, -1), kinds):
        beams = {phi: (sense * phi, mount if math.isclose(abs(phi), TURNED_ROWS) else 0.0) for phi in lab}
        case = _Case(table, lab, beams, tuple(entries), youngs_modulus)
        found.append(_ranked(case, case.fit(rigs if compliant else []), mount, sense, compliant))
    return sorted(found, key=lambda reading: reading.misfit)


def look_up(table: Table, twist: float, root_angle: float, rig: float | None) -> Row:
    """K' of a beam from the table, by symmetry where it is not there.

    Turning the whole beam by 90 deg about x exchanges y and z and the sign of the coupling; a mirror
    image reverses the twist and the sign of the coupling.  Both hold for a rig that is alike in y and z.

    Raises
    ------
    ValueError
        Naming the beam, when neither it nor an image of it is in the table.
    """
    names = [name for name, _ in KPRIME_ENTRIES]
    for turn, mirrored in product(_TURNS, (False, True)):
        key = (-twist if mirrored else twist, root_angle - turn, rig)
        match = next((k for k in table if _same(k, key)), None)
        # A mirror plane negates the root angle: only a section along y or z stays as it is.
        if match is None or (mirrored and not math.isclose(key[1] % 90.0, 0.0, abs_tol=1e-6)):
            continue
        change = _TURNS[turn] @ (_MIRROR if mirrored else np.eye(3))
        matrix = np.array([table[match].get(name, 0.0) for name in names]).reshape(3, 3)
        return dict(zip(names, (change @ matrix @ change.T).ravel().tolist(), strict=True))
    rig_text = "a rigid rig" if rig is None else f"a rig of {rig:g} N/m"
    raise ValueError(f"no computed K' for a twist of {twist:g} deg, a root angle of {root_angle:g} deg and {rig_text}")


def _same(one: Key, other: Key) -> bool:
    if (one[2] is None) != (other[2] is None):
        return False
    return bool(np.allclose([x or 0.0 for x in one], [x or 0.0 for x in other], rtol=1e-9, atol=1e-6))


@dataclass(frozen=True)
class _Optimum:
    misfit: float
    modulus: float
    rig: float | None
    at_edge: bool
    residuals: Array


@dataclass(frozen=True)
class _Case:
    """A reading before its numbers are fitted; ``beams`` maps published twist to (twist, root angle), deg."""

    table: Table
    lab: Mapping[float, Row]
    beams: Mapping[float, tuple[float, float]]
    entries: tuple[str, ...]
    reference_modulus: float

    def computed(self, rig: float | None) -> Array:
        """Entries at E0 row after row, (rows * entries,)."""
        rows = (look_up(self.table, *self.beams[phi], rig) for phi in self.lab)
        return np.array([row[entry] for row in rows for entry in self.entries])

    def fit(self, rigs: Sequence[float]) -> _Optimum:
        """Best modulus, and best rig stiffness among and between ``rigs`` and a rigid one.

        At a fixed ratio of rig to beam, the modulus is a linear least squares; what remains is a search
        along one line: log(rig stiffness) between the computed values, and 1 / rig stiffness,
        in which K' is smooth, from the stiffest of them to the rigid rig.
        """
        rigid = self.computed(None)
        if not rigs:
            return self._at(rigid, None, False)
        logs = np.log(rigs)
        rows = np.array([self.computed(rig) for rig in rigs])
        curve = PchipInterpolator(logs, rows) if len(rigs) > 1 else (lambda _: rows[0])

        def at(place: float) -> _Optimum:
            # 0 .. 1 runs through the computed stiffnesses, 1 .. 2 on to the rigid rig.
            if place >= 2.0:
                return self._at(rigid, None, True)
            edge = place <= 1e-6
            if place <= 1.0:
                scaled = float(np.exp(logs[0] + place * (logs[-1] - logs[0])))
                return self._at(np.asarray(curve(np.log(scaled))), scaled, edge)
            scaled = rigs[-1] / (2.0 - place)
            return self._at(rigid + (2.0 - place) * (rows[-1] - rigid), scaled, edge)

        places = np.linspace(0.0, 2.0, 2 * _GRID + 1)
        best = int(np.argmin([at(place).misfit for place in places]))
        low, high = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
        refined = minimize_scalar(
            lambda place: at(place).misfit, bounds=(low, high), method="bounded", options={"xatol": 1e-9}
        )
        return min((at(float(places[best])), at(float(refined.x))), key=lambda optimum: optimum.misfit)

    def _at(self, computed: Array, scaled_rig: float | None, at_edge: bool) -> _Optimum:
        measured = np.array([row[entry] for row in self.lab.values() for entry in self.entries])
        scales = np.concatenate([row_scales(row, self.entries) for row in self.lab.values()])
        factor = best_factor(computed, measured, scales)
        residuals = (factor * computed - measured) / scales
        rig = None if scaled_rig is None else scaled_rig * factor
        misfit = float(np.sqrt(np.mean(residuals**2)))
        return _Optimum(misfit, factor * self.reference_modulus, rig, at_edge, residuals)


def _ranked(case: _Case, optimum: _Optimum, mount: float, sense: int, compliant: bool) -> RankedReading:
    per_row = np.sqrt(np.mean(optimum.residuals.reshape(len(case.lab), -1) ** 2, axis=1))
    return RankedReading(
        mount, sense, compliant, optimum.modulus, optimum.rig, optimum.misfit,
        dict(zip(case.lab, per_row.tolist(), strict=True)), optimum.at_edge,
    )  # fmt: skip
