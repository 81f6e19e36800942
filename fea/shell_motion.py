"""Implicit motion of a clamped shell, every time step compiled: the fast counterpart of ``fea.dynamics``.

Displacements are relative to the clamp.  A moving clamp acts by its acceleration on the mass, -M a_base.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fea import banded, shell_geometry
from fea import shell_stepping as stepping
from fea.dynamics import Blend, axes_of
from fea.linear import make_solver
from fea.shell import Shell

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
#: Accelerations (m, 3), m/s^2, at times (m,), s.
Acceleration = Callable[[Array], Array]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a motion.

    Parameters
    ----------
    times
        (samples,), s; fewer than asked for where ``stopped`` says why.
    displacement
        Of the kept nodes, relative to the clamp (samples, kept, 3), m.
    kinetic, strain, work
        Energies of the relative motion, and the work of loads and inertia forces since the start (samples,), J.
    stopped
        Empty, or why the motion ended early.
    """

    times: Array
    displacement: Array
    kinetic: Array
    strain: Array
    work: Array
    stopped: str = ""


class ShellMotion:
    """Motion of a shell whose edge ``clamped`` is held, with what ``fea.dynamics.Dynamics`` offers and the same scheme.

    Parameters
    ----------
    shell
        Its material gives both kinds of damping; mass-proportional damping acts on the velocity relative to the clamp.
    on_boundary
        Masses, kg, spread over the faces of named edges.
    load
        Constant nodal forces (nodes, 3), N.
    clamped
        Name of the edge that is held.
    tolerance, rho
        Residual relative to the largest reaction so far; spectral radius at infinite frequency.
    shelf
        Tangents that are kept.
    """

    def __init__(
        self, shell: Shell, on_boundary: dict[str, float] | None = None, load: Array | None = None,
        clamped: str = "root", tolerance: float = 1e-5, rho: float = 0.9, shelf: int = 24,
    ) -> None:  # fmt: skip
        self.shell, self.on_boundary, self._shelf = shell, on_boundary, shelf
        blend, material = Blend(rho), shell.material
        self.scheme = stepping.Scheme(
            blend.alpha_m, blend.alpha_f, blend.beta, blend.gamma, material.viscous_time, material.mass_damping,
            tolerance,
        )  # fmt: skip
        held = shell.boundary(clamped)
        self.free = np.setdiff1d(np.arange(3 * shell.nodes), axes_of(held))
        self._pattern, taken = shell.pattern.restrict(self.free)
        data = shell.mass(on_boundary)
        self._mass_data = data[taken]
        self.mass = self._pattern.full(self._mass_data)
        self.system, self._width = _system(shell, held, data, load)
        self._floor = 1e-12 * material.youngs_modulus * float(shell.shares(clamped).sum())
        self.work = stepping.work(self.system, self._width, shelf)

    def run(
        self, interval: float, count: int, substeps: int = 1, base: Acceleration | None = None,
        u: Array | None = None, v: Array | None = None, kept: Ints | None = None,
    ) -> Trajectory:  # fmt: skip
        """The motion at 0, interval, ... (``count`` samples), each interval in ``substeps`` equal steps.

        Parameters
        ----------
        interval
            s.
        count, substeps
            Samples, and steps between them.
        base
            Acceleration of the clamp.
        u, v
            Displacement and velocity relative to the clamp at the start (nodes, 3), m and m/s; None: at rest.
        kept
            Nodes whose displacement is wanted; None: all.
        """
        pushed = np.zeros(3) if base is None else base(np.zeros(1))[0]
        state = self.begin(interval / substeps, pushed, u, v)
        return self.go_on(state, interval, count, substeps, base, kept)

    def go_on(
        self, state: stepping.State, interval: float, count: int, substeps: int = 1, base: Acceleration | None = None,
        kept: Ints | None = None, since: float = 0.0,
    ) -> Trajectory:  # fmt: skip
        """The motion from ``state`` at ``since``, s, as ``run``; the state is moved on to the last sample.

        Motions may be interrupted: what is learnt for the next steps is kept until another one begins.
        """
        step = interval / substeps
        instants = since + (step / stepping.INSTANTS) * np.arange(
            stepping.INSTANTS * substeps * (count - 1) + 1, dtype=np.float64
        )
        pushed = np.zeros((1, 3)) if base is None else np.ascontiguousarray(base(instants), dtype=np.float64)
        nodes = np.arange(self.shell.nodes) if kept is None else np.asarray(kept)
        displacement, energies = np.empty((count, 3 * len(nodes))), np.empty((count, 3))
        done = stepping.run(
            self.system, self.scheme, state, step, substeps, pushed, axes_of(nodes), self.work, displacement, energies
        )
        times = since + interval * np.arange(count, dtype=np.float64)
        stopped = "" if done == count else f"no equilibrium of forces after {times[done - 1]:.6g} s in halved steps"
        kinetic, strain, work = energies[:done].T.copy()
        return Trajectory(times[:done], displacement[:done].reshape(done, -1, 3), kinetic, strain, work, stopped)

    def begin(
        self, step: float, pushed: Array | None = None, u: Array | None = None, v: Array | None = None
    ) -> stepping.State:
        """State of a motion that begins: as ``run``, with the clamp's acceleration ``pushed`` (3,), m/s^2, there."""
        self.work = stepping.work(self.system, self._width, self._shelf)
        shell, system = self.shell, self.system
        nodal = [np.zeros((shell.nodes, 3)) if x is None else np.asarray(x, dtype=float) for x in (u, v)]
        start, speed = (x.reshape(-1)[system.unknowns] for x in nodal)
        momentum = float(np.linalg.norm(_mass(system) @ speed.reshape(-1, 3)))
        state = stepping.State(
            start, speed, np.zeros_like(start), np.zeros_like(start), np.zeros((len(shell.cells), 53)),
            np.zeros((len(shell.cells), 53)), np.array([np.inf, max(self._floor, momentum / step), 0.0]),
        )  # fmt: skip
        # E is quadratic in u, so this difference is the exact strain rate, whatever its 1 ms.
        ahead, behind = (shell.strains(nodal[0] + sense * nodal[1]) for sense in (1e-3, -1e-3))
        stepping.begin(system, state, self.scheme.viscous_time * (ahead - behind) / 2e-3, self.work)
        push = np.zeros((shell.nodes, 3))
        push.reshape(-1)[system.unknowns] = (
            system.load - state.force - system.carried @ (np.zeros(3) if pushed is None else pushed)
        )
        solver = make_solver("auto", self._pattern)
        solver.factorise(self._mass_data)
        a = np.zeros(3 * shell.nodes)
        a[self.free] = solver.solve(push.reshape(-1)[self.free])
        state.a[:] = a[system.unknowns] - self.scheme.mass_damping * speed
        return state


def _system(shell: Shell, held: Ints, data: Array, load: Array | None) -> tuple[stepping.System, int]:
    """What ``fea.shell_stepping`` needs, and the width of the band; ``data`` is the mass on the shell's pattern."""
    mass = shell.pattern.full(data).tocsr()[::3, ::3]
    nodes = np.setdiff1d(np.arange(shell.nodes), held)
    between = csr_array(mass[nodes][:, nodes])
    nodes = nodes[reverse_cuthill_mckee(between, symmetric_mode=True)]
    between = csr_array(mass[nodes][:, nodes])
    between.sort_indices()
    unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
    number = np.full(3 * shell.nodes, -1)
    number[unknowns] = np.arange(len(unknowns))
    rows, columns = number[shell.pattern.rows], number[shell.pattern.indices]
    taken = np.flatnonzero((rows >= 0) & (columns >= 0))
    high, low = np.maximum(rows, columns)[taken], np.minimum(rows, columns)[taken]
    first, width = banded.envelope(high, low, len(unknowns))
    carried = np.zeros((len(unknowns), 3))
    for axis in range(3):
        carried[axis::3, axis] = np.asarray(mass[nodes].sum(axis=1)).ravel()
    system = stepping.System(
        *shell._law, shell._elements, shell_geometry.tables(), shell._assembly[1],
        taken, high * (width + 1) + width - (high - low), data[taken], unknowns, axes_of(held),
        between.indptr.astype(np.int64), between.indices.astype(np.int64), between.data, carried,
        np.zeros(len(unknowns)) if load is None else np.asarray(load, dtype=float).reshape(-1)[unknowns], first,
    )  # fmt: skip
    return system, width


def _mass(system: stepping.System) -> csr_array:
    """Mass between the nodes that move."""
    nodes = len(system.mass_rows) - 1
    return csr_array((system.mass, system.mass_columns, system.mass_rows), shape=(nodes, nodes))
