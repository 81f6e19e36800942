"""The public way to set up a case of one's own: parts, what holds them, what loads them; then solve and read."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fea.contact import CarriedPlane, ContactLaw, Plane, PlaneContact, SurfaceContact
from fea.links import Builder, ConstraintError
from fea.places import boundary_names, is_shell, stations, surface_names
from fea.pressure import Pressure, traction
from fea.problem import Load, Moment, Part, PoseSpring, Problem
from fea.rigid_part import RigidPart, mass_points
from fea.springs import Springs
from fea.surface import Surface
from fea.terms import Term
from fea.ties import closest_points

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Where something is: the name of a boundary, a test of reference positions (n, 3) -> (n,) bool, node numbers,
#: or a point (3,), which means the nearest node (of a shell: both nodes of the nearest place).
Where = str | Callable[[Array], NDArray[np.bool_]] | Ints | Sequence[float]
Ramp = Callable[[float], float]
_AXES = {"x": 0, "y": 1, "z": 2}
_POSE = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5}
#: Weight of a node in a tie that is rounding.
_NOTHING = 1e-9


def proportional(t: float) -> float:
    """Ramp of loads that grow with t."""
    return t


def constant(t: float) -> float:
    """Ramp of loads that are always there."""
    return 1.0


def stages(*corners: tuple[float, float]) -> Ramp:
    """Ramp with straight lines between corners (t, factor), level outside."""
    times, factors = np.array(corners, dtype=float).T
    if (np.diff(times) <= 0).any():
        raise ValueError(f"corners of a ramp must have growing t, not {times.tolist()}")
    return lambda t: float(np.interp(t, times, factors))


@dataclass
class Rigid:
    """A rigid part of a case, made by ``Case.rigid``; methods hold, move, load and spring it.

    Pose numbers are named x, y, z (translation of the reference point, m) and rx, ry, rz (rotation
    vector, rad).
    """

    name: str
    number: int
    nodes: Ints
    at: Array
    _held: dict[int, Ramp] = field(default_factory=dict)
    _moments: list[Moment] = field(default_factory=list)
    _springs: list[PoseSpring] = field(default_factory=list)

    def hold(self, *numbers: str) -> "Rigid":
        """Keep pose numbers at zero; all six when none is named."""
        return self.move(proportional, **dict.fromkeys(numbers or _POSE, 0.0))

    def move(self, ramp: Ramp = proportional, **numbers: float) -> "Rigid":
        """Prescribe pose numbers: ``move(z=-0.01)``, ``move(rx=np.pi)``, reached at ramp 1."""
        for name, value in numbers.items():
            if name not in _POSE:
                raise ConstraintError(f"rigid part {self.name}: no pose number {name!r}; there are {', '.join(_POSE)}")
            self._held[_POSE[name]] = _times(value, ramp)
        return self

    def moment(self, moment: Sequence[float], ramp: Ramp = proportional, follows: bool = False) -> "Rigid":
        """Apply a moment (3,), N m, about axes that stay, or that turn with the part."""
        self._moments.append(Moment(self.number, _vector(moment, "moment"), ramp, follows))
        return self

    def spring(
        self, stiffness: Sequence[float] | Array, motion: Sequence[float] | Callable[[float], Array] = (0.0,) * 6,
        ramp: Ramp = proportional,
    ) -> "Rigid":  # fmt: skip
        """Springs (6,), N/m and N m/rad, between the pose and the ground, or a rig that moves.

        ``motion`` (6,), m and rad, is reached at ramp 1; or it is the rig's pose as a function of t.
        """

        def rig(t: float) -> Array:
            return motion(t) if callable(motion) else ramp(t) * np.asarray(motion, dtype=float)

        self._springs.append(PoseSpring(self.number, np.asarray(stiffness, dtype=float), rig))
        return self


class Case:
    """Parts with constraints, loads and contact; ``static``, ``trace``, ``transient``, ``modes`` solve it.

    Parameters
    ----------
    parts
        ``Body`` and ``Shell`` objects, numbered one after the other.
    solver
        Linear solver: ``auto``, ``pardiso`` or ``superlu``.
    """

    def __init__(self, *parts: Part, solver: str = "auto") -> None:
        if not parts:
            raise ValueError("a case needs at least one part")
        self.parts, self.solver = parts, solver
        self.offsets = np.cumsum([0] + [part.nodes for part in parts])
        self.nodes = int(self.offsets[-1])
        self.points = np.concatenate([part.points for part in parts])
        self.rigids: dict[str, Rigid] = {}
        self.watched: dict[str, Ints] = {}
        self.masses: list[tuple[Ints, Array]] = []
        self._carried: list[Array] = []
        self._prescribed: list[tuple[Ints, Callable[[float], float], str]] = []
        self._middle: list[tuple[Ints, Ints, str]] = []
        self._ties: list[tuple[Ints, Ints, Array, str]] = []
        self._loads: list[tuple[Ints, Array, Ramp]] = []
        self._terms: list[Callable[[Array], Term]] = []
        self._bodily: list[tuple[Array, Ramp]] = []

    # -- where ---------------------------------------------------------------------------------------

    def select(self, where: Where, part: Part | None = None) -> Ints:
        """Node numbers in the case; ``part`` narrows names, tests and points to one part."""
        places = [i for i, p in enumerate(self.parts) if part is None or p is part]
        if isinstance(where, str):
            found = [self.parts[i].boundary(where) + self.offsets[i] for i in places if where in self.names(i)]
            if not found:
                known = sorted({name for i in places for name in self.names(i)})
                raise ConstraintError(f"no boundary {where!r}; there are {', '.join(known) or 'none'}")
            return np.concatenate(found)
        if callable(where):
            numbers = np.concatenate([np.arange(self.offsets[i], self.offsets[i + 1]) for i in places])
            found_here = numbers[np.asarray(where(self.points[numbers]), dtype=bool)]
            if not len(found_here):
                raise ConstraintError("no node lies where the given test looks for some")
            return found_here
        given = np.asarray(where)
        if given.dtype.kind in "iu":
            if given.size and (given.min() < 0 or given.max() >= len(self.points)):
                raise ConstraintError(f"node numbers must lie between 0 and {len(self.points) - 1}")
            return np.unique(given).astype(np.int64)
        return self._nearest(given.astype(float), places)

    def names(self, part: int) -> list[str]:
        """Names of the boundaries of a part."""
        return boundary_names(self.parts[part])

    def _nearest(self, point: Array, places: list[int]) -> Ints:
        if point.shape != (3,):
            raise ConstraintError(f"a place is a name, a test, node numbers or a point of three numbers, not {point}")
        best: tuple[float, Ints] = (np.inf, np.zeros(0, dtype=np.int64))
        for i in places:
            spots = stations(self.parts[i])
            centres = self.parts[i].points[spots].mean(axis=1)
            away = np.linalg.norm(centres - point, axis=1)
            near = int(np.argmin(away))
            if away[near] < best[0]:
                best = (float(away[near]), spots[near] + self.offsets[i])
        return best[1]

    def _surface(self, name: str, part: Part | None) -> Surface:
        owners = [i for i, p in enumerate(self.parts) if (part is None or p is part) and name in surface_names(p)]
        if len(owners) != 1:
            known = sorted({n for p in self.parts for n in surface_names(p)})
            what = "no surface" if not owners else "more than one part has a surface"
            raise ConstraintError(f"{what} {name!r}; there are {', '.join(known)}; name the part to choose")
        return self.parts[owners[0]].surface(name).shifted(int(self.offsets[owners[0]]))

    def _weights(self, where: Where, nodes: Ints) -> Array:
        """Share of every node in a load on ``where``: by area on a named boundary, else equal."""
        if isinstance(where, str):
            shares = [p.shares(where) if where in boundary_names(p) else np.zeros(p.nodes) for p in self.parts]
            area = np.concatenate(shares)[nodes]
            return area / area.sum()
        return np.full(len(nodes), 1.0 / len(nodes))

    # -- what holds ----------------------------------------------------------------------------------

    def fix(
        self, where: Where, axes: str = "xyz", to: float | Sequence[float] = 0.0, ramp: Ramp = proportional,
        part: Part | None = None, layer: Literal["all", "middle"] = "all",
    ) -> "Case":  # fmt: skip
        """Prescribe displacements.

        Parameters
        ----------
        where, part
            Nodes; see ``select``.
        axes
            Any of x, y, z.
        to
            Displacement, m, at ramp 1: one number, or one for each axis.
        layer
            ``middle`` holds the mid-surface of a shell and lets its edge turn: a hinge.
        """
        nodes = self.select(where, part)
        if not axes or set(axes) - set(_AXES):
            raise ConstraintError(f"axes must be some of x, y, z, not {axes!r}")
        values = np.broadcast_to(np.asarray(to, dtype=float), len(axes))
        for axis, value in zip(axes, values, strict=True):
            by = f"fix({_words(where)}, {axis!r})"
            if layer == "all":
                self._prescribed.append((3 * nodes + _AXES[axis], _times(float(value), ramp), by))
            elif value != 0.0:
                raise ConstraintError(f"{by}: a middle layer can be held but not moved; move a rigid part instead")
            else:
                pairs = self._pairs(nodes, by)
                self._middle.append((3 * pairs[:, 0] + _AXES[axis], 3 * pairs[:, 1] + _AXES[axis], by))
        return self

    def _pairs(self, nodes: Ints, by: str) -> Ints:
        """Lower and upper node of the shell places among ``nodes``, (pairs, 2)."""
        spots = [stations(p) + offset for p, offset in zip(self.parts, self.offsets, strict=False)]
        pairs = np.concatenate([s for s in spots if s.shape[1] == 2] or [np.zeros((0, 2), dtype=np.int64)])
        pairs = pairs[np.isin(pairs, nodes).all(axis=1)]
        if not len(pairs):
            raise ConstraintError(f"{by}: only shells have a middle layer")
        return pairs

    def symmetry(self, where: Where, axis: str, part: Part | None = None) -> "Case":
        """Plane of symmetry across ``axis``: no displacement along it, hence no turning out of the plane."""
        return self.fix(where, axis, part=part)

    def rigid(
        self, name: str, where: Where | None = None, at: Sequence[float] | None = None, mass: float = 0.0,
        inertia: Sequence[Sequence[float]] | None = None, part: Part | None = None,
    ) -> Rigid:  # fmt: skip
        """Make nodes move as a rigid part; hold, move, load or spring it by what comes back.

        Parameters
        ----------
        name
            For messages and results.
        where, part
            Nodes that it carries; None: a part of its own, for contact.
        at
            Reference point and centre of mass, m; default: the nodes' mean, weighted by area on named boundaries.
        mass, inertia
            kg, and (3, 3) kg m^2 about ``at``, for motions.
        """
        if name in self.rigids:
            raise ConstraintError(f"there is already a rigid part {name!r}")
        nodes = np.zeros(0, dtype=np.int64) if where is None else self.select(where, part)
        if at is None and where is None:
            raise ConstraintError(f"rigid part {name!r} carries no nodes, so that it needs a point 'at'")
        centre = self._weights(where, nodes) @ self.points[nodes] if at is None else _vector(at, "at")  # type: ignore[arg-type]
        extra = [centre, *(centre + np.eye(3) * max(float(np.ptp(self.points)), 1e-300) * 0.1)]
        if mass or inertia is not None:
            arms, masses = mass_points(mass, np.zeros((3, 3)) if inertia is None else np.asarray(inertia, dtype=float))
            first = len(self.points) + len(extra)
            self.masses.append((np.arange(first, first + 6), masses))
            extra += list(centre + arms)
        own = np.arange(len(self.points), len(self.points) + len(extra))
        self.points = np.concatenate([self.points, extra])
        rigid = Rigid(name, len(self.rigids), np.concatenate([own[:1], nodes, own[1:]]), centre)
        self.rigids[name] = rigid
        self.watched[name] = own[:1]
        return rigid

    def tie(
        self, where: Where, surface: str | Surface, part: Part | None = None, to: Part | None = None,
        reach: float | None = None,
    ) -> "Case":  # fmt: skip
        """Glue nodes to the nearest points of a surface.

        Both layers of a shell's edge that are tied carry moments over.

        Parameters
        ----------
        where, part
            Nodes to glue.
        surface, to
            Name of the surface, and whose it is; or some of its facets, in the case's node numbers.
        reach
            Farthest that a node may lie from it, m; default: 1 % of the surface's longest facet.  A gap does
            not turn with the surface.
        """
        nodes, target = (
            self.select(where, part),
            surface if isinstance(surface, Surface) else self._surface(surface, to),
        )
        nodes = np.setdiff1d(nodes, target.nodes)
        if reach is None:
            reach = 0.01 * float(np.ptp(self.points[target.facets], axis=1).max())
        facets, weights = closest_points(target, self.points, self.points[nodes], reach)
        by = f"tie({_words(where)}, {surface!r})" if isinstance(surface, str) else f"tie({_words(where)}, facets)"
        for node, facet, share in zip(nodes, facets, weights, strict=True):
            # Nodes on nodes of the surface follow them alone, not the rest of the facet too.
            kept = np.abs(share) > _NOTHING
            for axis in range(3):
                self._ties.append((3 * node + axis, 3 * facet[kept] + axis, share[kept], by))
        return self

    def spring(self, where: Where, stiffness: Sequence[float], part: Part | None = None) -> "Case":
        """Connect nodes to the ground by springs (3,), N/m in total along x, y, z."""
        nodes = self.select(where, part)
        share = self._weights(where, nodes)
        springs = Springs(nodes, share[:, None] * _vector(stiffness, "stiffness"))
        return self.add(lambda points: springs)

    # -- what loads ----------------------------------------------------------------------------------

    def force(
        self, where: Where, force: Sequence[float], ramp: Ramp = proportional, part: Part | None = None
    ) -> "Case":
        """Dead force (3,), N in total; spread over a named boundary by area, else equally over the nodes."""
        if isinstance(where, str) and where in self.rigids:
            nodes, share = self.rigids[where].nodes[:1], np.ones(1)
        else:
            nodes = self.select(where, part)
            share = self._weights(where, nodes)
        self._loads.append((nodes, np.outer(share, _vector(force, "force")), ramp))
        return self

    def traction(
        self, surface: str, traction_vector: Sequence[float], ramp: Ramp = proportional, part: Part | None = None
    ) -> "Case":
        """Dead force per reference area (3,), Pa, on a named surface."""
        forces = traction(self._surface(surface, part), self.points, _vector(traction_vector, "traction"))
        self._loads.append((np.arange(len(forces)), forces, ramp))
        return self

    def pressure(self, surface: str, pressure: float, ramp: Ramp = proportional, part: Part | None = None) -> "Case":
        """Pressure, Pa, that pushes on a named surface and follows its normal."""
        target = self._surface(surface, part)
        return self.add(lambda points: Pressure(target, points, pressure, ramp=ramp))

    def contact(
        self, one: str, other: str, part: Part | None = None, to: Part | None = None, friction: float = 0.0,
        **settings: Any,
    ) -> "Case":  # fmt: skip
        """Keep two named surfaces, or a surface and itself, from passing through one another.

        Parameters
        ----------
        one, part
            Surface whose points are held back: the softer or finer one.
        other, to
            Surface that holds them back; the same again for contact with itself.
        friction
            Coefficient of Coulomb friction.
        settings
            ``factor``, ``blend``, ``tolerance`` of ``ContactLaw``, or ``two_passes``, ``reach``, ``depth``, ``facing``,
            ``rings`` of ``SurfaceContact``.
        """
        slave, master = self._surface(one, part), self._surface(other, to if to is not None else part)
        owner = self._owner(one, part)
        law = self._law(owner, friction, settings)
        if owner is self._owner(other, to if to is not None else part) and one == other:
            master = slave
        return self.add(lambda points: SurfaceContact(slave, master, points, law, **settings))

    def ground(
        self, surface: str, point: Sequence[float], normal: Sequence[float], part: Part | None = None,
        offset: Ramp | None = None, friction: float = 0.0, **settings: Any,
    ) -> "Case":  # fmt: skip
        """Keep a named surface on one side of a rigid plane.

        Parameters
        ----------
        surface, part
            What may touch the plane.
        point, normal
            Of the plane (3,), m; the normal points at the part.
        offset
            Motion of the plane along its normal, m, as a function of t.
        friction
            Coefficient of Coulomb friction.
        settings
            ``factor``, ``blend``, ``tolerance`` of ``ContactLaw``.
        """
        target, law = self._surface(surface, part), self._law(self._owner(surface, part), friction, settings)
        plane = Plane(_vector(point, "point"), _vector(normal, "normal"), offset)
        return self.add(lambda points: PlaneContact(target, points, plane, law, **settings))

    def plate(
        self, surface: str, rigid: Rigid, normal: str, part: Part | None = None, friction: float = 0.0, **settings: Any
    ) -> "Case":
        """Keep a named surface on one side of a plane through the reference point of a rigid part, which rides on it.

        Parameters
        ----------
        surface, part
            What may touch the plate.
        rigid
            The part, as from ``Case.rigid``; ``Run.wrench`` gives the force on it.
        normal
            Axis at rest that points from the plate at ``surface``: ``x``, ``-x``, ``y``, ...
        friction, settings
            As in ``ground``.
        """
        axes = normal.lstrip("+-")
        if axes not in _AXES or len(normal) > 2:
            raise ConstraintError(f"the normal of a plate is one of x, -x, y, -y, z, -z, not {normal!r}")
        first = int(rigid.nodes[0])
        second, third = (first + 1 + (_AXES[axes] + k) % 3 for k in (1, 2))
        corners = (first, third, second) if normal.startswith("-") else (first, second, third)
        target, law = self._surface(surface, part), self._law(self._owner(surface, part), friction, settings)
        return self.add(lambda points: PlaneContact(target, points, CarriedPlane(corners), law, **settings))

    def _owner(self, surface: str, part: Part | None) -> Part:
        return part if part is not None else next(p for p in self.parts if surface in surface_names(p))

    @staticmethod
    def _law(part: Part, friction: float, settings: dict[str, Any]) -> ContactLaw:
        """Contact law of a part; takes its own words out of ``settings``."""
        own = {name: settings.pop(name) for name in ("factor", "blend", "tolerance") if name in settings}
        thickness = float(np.min(part.thickness)) if is_shell(part) else None  # type: ignore[attr-defined]
        return ContactLaw(part.material.youngs_modulus, thickness, friction, **own)

    def gravity(self, acceleration: Sequence[float], ramp: Ramp = proportional) -> "Case":
        """Weight of all parts, point masses and rigid parts under an acceleration (3,), m/s^2."""
        self._bodily.append((_vector(acceleration, "acceleration"), ramp))
        return self

    def mass(self, where: Where, mass: float, part: Part | None = None) -> "Case":
        """Extra mass, kg in total, on nodes."""
        nodes = self.select(where, part)
        self.masses.append((nodes, mass * self._weights(where, nodes)))
        return self

    def add(self, term: Callable[[Array], Term]) -> "Case":
        """Contact or any other ``Term``, as a function that makes it from the reference points (N, 3) of all nodes.

        Every solution makes its own, so that none starts with another's contact.
        """
        self._terms.append(term)
        return self

    def surface(self, name: str, part: Part | None = None) -> Surface:
        """A named surface in the case's node numbers, for contact."""
        return self._surface(name, part)

    def watch(self, name: str, where: Where, part: Part | None = None) -> "Case":
        """Name nodes whose mean displacement and total reaction are to be read."""
        self.watched[name] = self.select(where, part)
        return self

    # -- solutions -----------------------------------------------------------------------------------

    def problem(self, seconds: float = 0.0) -> Problem:
        """The equations, as ``fea.newton`` solves them; ``seconds`` as in ``fea.statics.static``.

        Raises
        ------
        ConstraintError
            When constraints contradict one another.
        """
        builder = Builder(len(self.points), self._name)
        for unknowns, value, by in self._prescribed:
            builder.prescribe(unknowns, value, by)
        for lower, upper, by in self._middle:
            self._hinge(builder, lower, upper, by)
        for unknown, others, weights, by in self._ties:
            builder.tie(int(unknown), others, weights, by)
        for rigid in self.rigids.values():
            arms = self.points[rigid.nodes] - rigid.at
            builder.carry(RigidPart(rigid.nodes, arms), rigid._held, rigid.name)
        size = self.points.shape
        loads = []
        for nodes, forces, ramp in self._loads:
            whole = np.zeros(size)
            np.add.at(whole, nodes, forces)
            loads.append(Load(whole, ramp))
        if self._bodily:
            mass = self.nodal_mass()
            loads += [Load(np.outer(mass, acceleration), ramp) for acceleration, ramp in self._bodily]
        moments = [m for r in self.rigids.values() for m in r._moments]
        springs = [s for r in self.rigids.values() for s in r._springs]
        terms = [make(self.points) for make in self._terms]
        return Problem(
            self.parts, self.points, builder.make(), loads, moments, springs, terms, self.solver, seconds=seconds
        )

    def _hinge(self, builder: Builder, lower: Ints, upper: Ints, by: str) -> None:
        held = {int(u) for unknowns, _, _ in self._prescribed for u in unknowns}
        for a, b in zip(lower.tolist(), upper.tolist(), strict=True):
            if a in held and b in held:
                continue
            if a in held or b in held:
                builder.prescribe(np.array([b if a in held else a]), _times(0.0, proportional), by)
            else:
                builder.tie(b, np.array([a]), np.array([-1.0]), by)

    def nodal_mass(self) -> Array:
        """Mass that every node carries (N,), kg: integrals of shape functions, point masses, rigid parts."""
        result = np.zeros(len(self.points))
        for part, offset in zip(self.parts, self.offsets, strict=False):
            ones = part.pattern.times(part.mass(), np.ones(3 * part.nodes))
            result[offset : offset + part.nodes] = ones.reshape(-1, 3)[:, 0]
        for nodes, masses in self.masses:
            np.add.at(result, nodes, masses)
        return result

    def _name(self, unknown: int) -> str:
        node, axis = divmod(unknown, 3)
        place = ", ".join(f"{c:.6g}" for c in self.points[node])
        return f"the displacement along {'xyz'[axis]} of node {node} at ({place}) m"


def _times(value: float, ramp: Ramp) -> Callable[[float], float]:
    return lambda t: value * ramp(t)


def _vector(value: Sequence[float], name: str) -> Array:
    result = np.asarray(value, dtype=float)
    if result.shape != (3,) or not np.isfinite(result).all():
        raise ValueError(f"{name} must be three finite numbers, not {value!r}")
    return result


def _words(where: Any) -> str:
    return repr(where) if isinstance(where, str) else "a test" if callable(where) else "nodes"
