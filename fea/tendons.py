"""What pulls and pushes a pinched tube: tendons between opposite pads, and a load or a pusher on the block."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fea.terms import Steady

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Ramp:
    """Piecewise-linear function of time that is written on while it is followed; level after its last corner."""

    def __init__(self, value: float = 0.0) -> None:
        self._times, self._values = [0.0], [value]

    def __call__(self, t: float) -> float:
        """Value at ``t``."""
        return float(np.interp(t, self._times, self._values))

    def goes(self, start: float, end: float, value: float) -> None:
        """Forget what was to come after ``start``; from there go straight to ``value`` at ``end``."""
        kept = [i for i, time in enumerate(self._times) if time < start]
        here = self(start)
        self._times = [*(self._times[i] for i in kept), start, end]
        self._values = [*(self._values[i] for i in kept), here, value]


@dataclass(frozen=True)
class Line:
    """From one pad to the opposite one: the vector ``weights`` @ positions of ``nodes`` - ``offset``.

    Parameters
    ----------
    nodes, weights
        (m,) each.
    offset
        (3,), m.
    """

    nodes: Ints
    weights: Array
    offset: Array


class Tendons(Steady):
    """Tendons along ``lines``, in one of two ways.

    Pulled together by F_p, whose travel Q is given: the forces are shares_i F_p with F_p = k f(Q - sum shares_i s_i)
    and the shortenings s_i of the lines.  Or each for itself by a given shortening c_i: F_i = k f(c_i - s_i).  Either
    derives from an energy.  Tendons cannot push: f(d) = 0 for d <= 0, d - w/2 for d >= w, a parabola between.

    Parameters
    ----------
    points
        Reference coordinates of all nodes (N, 3), m.
    lines
        One for each pair of pads.
    stiffness
        k, N/m: large, for what is moved is the travel.
    width
        w, m.
    part
        Share of the device that is modelled; forces on its nodes are so much smaller.
    """

    def __init__(self, points: Array, lines: Sequence[Line], stiffness: float, width: float, part: float = 1.0) -> None:
        self._points, self._lines, self._k, self._w, self._part = points, lines, stiffness, width, part
        self._nodes = np.concatenate([line.nodes for line in lines])
        ends = np.cumsum([0] + [len(line.nodes) for line in lines])
        self._places = [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        self._rest = np.linalg.norm(self._vectors(np.zeros_like(points)), axis=1)
        self.shares = np.zeros(len(lines))
        #: Q, while the tendons are pulled together.
        self.travel = Ramp()
        #: Factor on the shortenings that are held.
        self.slackening = Ramp(1.0)
        self._held: Array | None = None

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return self._nodes[None]

    def _vectors(self, x: Array) -> Array:
        return np.array([n.weights @ (self._points[n.nodes] + x[n.nodes]) - n.offset for n in self._lines])

    def shortening(self, x: Array) -> Array:
        """Of every line since rest (lines,), m."""
        return self._rest - np.linalg.norm(self._vectors(x), axis=1)

    def pull(self, x: Array, shares: Array, t: float, end: float, travel: float) -> None:
        """Pull with forces in the ratio of ``shares``: from where lines are at ``t`` to ``travel``, m, at ``end``."""
        self.shares, self._held = np.asarray(shares, dtype=float), None
        self.travel = Ramp(self.done(x))
        self.travel.goes(t, end, travel)

    def done(self, x: Array) -> float:
        """Travel that F_p has worked on, m."""
        return float(self.shares @ self.shortening(x))

    def hold(self, x: Array, t: float) -> None:
        """From here on keep every tendon's length; its force stays for now."""
        strain = self.forces(x, t) / self._k
        stretch = np.where(strain >= self._w / 2, strain + self._w / 2, np.sqrt(2 * self._w * strain))
        self._held = np.where(self.shares > 0, self.shortening(x) + stretch, -np.inf)
        self.slackening = Ramp(1.0)

    def release(self, t: float, end: float) -> None:
        """Pay out all held tendons from ``t`` on, in proportion, to their lengths at rest at ``end``."""
        self.slackening.goes(t, end, 0.0)

    @contextmanager
    def kept(self, x: Array, t: float) -> Iterator[None]:
        """Every tendon's length is held in between."""
        before = self._held, self.slackening
        self.hold(x, t)
        yield
        self._held, self.slackening = before

    def _pulls(self, x: Array, t: float) -> tuple[Array, Array, Array, float]:
        """Forces (lines,), N; shares (pulls, lines) and slopes (pulls,) of what is pulled; energy, J."""
        shorter = self.shortening(x)
        if self._held is None:
            ways, given = self.shares[None], np.array([self.travel(t)])
        else:
            ways, given = np.eye(len(self._lines)), self.slackening(t) * np.maximum(self._held, 0.0)
            given = np.where(np.isfinite(self._held), given, -np.inf)
        stretch = np.maximum(given - ways @ shorter, 0.0)
        curved = stretch < self._w
        tension = self._k * np.where(curved, stretch**2 / (2 * self._w), stretch - self._w / 2)
        slope = self._k * np.where(curved, stretch / self._w, 1.0)
        energy = np.where(curved, stretch**3 / (6 * self._w), 0.5 * stretch * (stretch - self._w) + self._w**2 / 6)
        return tension @ ways, ways, slope, self._k * float(energy.sum())

    def forces(self, x: Array, t: float) -> Array:
        """Of every tendon (lines,), N, on the whole device."""
        return self._pulls(x, t)[0]

    def joint_force(self, x: Array, t: float) -> float:
        """F_p, N; of held tendons the one that comes nearest to their forces."""
        square = float(self.shares @ self.shares)
        return float(self.forces(x, t) @ self.shares) / square if square else 0.0

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        result = np.zeros_like(x)
        for line, vector, pull in zip(self._lines, self._vectors(x), self.forces(x, t), strict=True):
            along = vector / np.linalg.norm(vector)
            np.add.at(result, line.nodes, self._part * pull * np.outer(line.weights, along))
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        pulls, ways, slopes, _ = self._pulls(x, t)
        size = len(self._nodes)
        gradients, turning = np.zeros((len(self._lines), size, 3)), np.zeros((size, 3, size, 3))
        for i, (line, vector, place) in enumerate(zip(self._lines, self._vectors(x), self._places, strict=True)):
            length = float(np.linalg.norm(vector))
            along = vector / length
            gradients[i, place] = np.outer(line.weights, along)
            across = (np.eye(3) - np.outer(along, along)) * pulls[i] / length
            turning[place, :, place] += np.einsum("i,j,kl->ikjl", line.weights, line.weights, across)
        ways_by_node = ways @ gradients.reshape(len(self._lines), -1)
        stiffness = turning.reshape(3 * size, -1) + (ways_by_node.T * slopes) @ ways_by_node
        return self._part * stiffness[None]

    def energy(self, x: Array, t: float) -> float:
        """See ``Term``."""
        return self._part * self._pulls(x, t)[3]


class BlockLoad(Steady):
    """A force along a direction on a point of a rigid block: dead, or of a spring whose other end is moved.

    Parameters
    ----------
    nodes, weights
        The point is the sum of ``weights`` times the ``nodes`` (m,).
    direction
        Unit vector (3,).
    stiffness
        Of the spring, N/m.
    """

    def __init__(self, nodes: Ints, weights: Array, direction: Array, stiffness: float) -> None:
        self._nodes, self._weights, self._direction, self._k = nodes, weights, direction, stiffness
        #: Dead load, N.
        self.load = Ramp()
        #: Where the spring's other end is along the direction, m; None: not attached.
        self.pusher: Ramp | None = None

    @property
    def cells(self) -> Ints:
        """See ``Term``."""
        return self._nodes[None]

    def moved(self, x: Array) -> float:
        """Motion of the point along the direction, m."""
        return float(self._weights @ x[self._nodes] @ self._direction)

    def push(self, x: Array, t: float, end: float, by: float) -> None:
        """From ``t`` to ``end`` move the spring's other end by ``by``, m; attached without force if it was not."""
        if self.pusher is None:
            self.pusher = Ramp(self.moved(x))
        self.pusher.goes(t, end, self.pusher(t) + by)

    @contextmanager
    def loose(self) -> Iterator[None]:
        """The spring is not there in between."""
        before, self.pusher = self.pusher, None
        yield
        self.pusher = before

    def total(self, x: Array, t: float) -> float:
        """Force on the point along the direction, N."""
        spring = self._k * (self.pusher(t) - self.moved(x)) if self.pusher is not None else 0.0
        return self.load(t) + spring

    def force(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        result = np.zeros_like(x)
        result[self._nodes] = -self.total(x, t) * np.outer(self._weights, self._direction)
        return result

    def tangent(self, x: Array, t: float) -> Array:
        """See ``Term``."""
        pull = np.outer(self._weights, self._direction).ravel()
        return (self._k if self.pusher is not None else 0.0) * np.outer(pull, pull)[None]

    def energy(self, x: Array, t: float) -> float:
        """In the spring, J."""
        return 0.5 * self._k * (self.pusher(t) - self.moved(x)) ** 2 if self.pusher is not None else 0.0
