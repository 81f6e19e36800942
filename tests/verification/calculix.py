"""CalculiX as a peer: input decks of our solids with the same nodes, its run, and what it printed."""

import os
import re
import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fea.body import Body

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

INSTALL = "apt-get install calculix-ccx"
#: Names that CalculiX gives to the elements on our nodes; R: reduced integration.
HEXAHEDRA, TETRAHEDRA = ("C3D20R", "C3D20"), ("C3D10",)


def program() -> str | None:
    """Path of CalculiX, None where it is not installed."""
    return shutil.which("ccx")


@dataclass(frozen=True)
class Deck:
    """A static, geometrically nonlinear job, Saint Venant-Kirchhoff as CalculiX reads ``*ELASTIC`` with NLGEOM.

    Parameters
    ----------
    body
        The solid.  Of 27 nodes a hexahedron keeps the 20 on its edges.
    element
        One of ``HEXAHEDRA`` or ``TETRAHEDRA``.
    motions
        Displacements at the end: unknown ``3 node + axis`` to value, m.
    forces
        Dead nodal forces at the end (nodes, 3), N; zero on nodes that the element has not.
    watched
        Nodes to report on.
    increment
        First increment as a share of all; CalculiX adapts the others.
    """

    body: Body
    element: str
    motions: dict[int, float]
    watched: Ints
    forces: Array | None = None
    increment: float = 0.1

    @property
    def cells(self) -> Ints:
        """Nodes of every element in CalculiX's order, which is VTK's."""
        _, cells, _, _ = self.body.picture()
        return cells[:, :20] if self.element in HEXAHEDRA else cells

    def text(self) -> str:
        """The input file; node n of ours is n + 1."""
        used = np.unique(self.cells)
        known = np.zeros(self.body.nodes, dtype=bool)
        known[used] = True
        material, points = self.body.material, self.body.points
        lines = ["*NODE, NSET=ALL"]
        lines += [f"{n + 1}, {points[n, 0]:.12e}, {points[n, 1]:.12e}, {points[n, 2]:.12e}" for n in used]
        lines += [f"*ELEMENT, TYPE={self.element}, ELSET=ALL"]
        for number, cell in enumerate((self.cells + 1).tolist(), start=1):
            words = [str(n) for n in [number, *cell]]
            lines += [", ".join(words[:11]) + ("," if words[11:] else ""), *filter(None, [", ".join(words[11:])])]
        watched = self.watched[known[self.watched]]
        lines += ["*NSET, NSET=WATCHED", *(f"{n + 1}," for n in watched)]
        lines += ["*MATERIAL, NAME=SOLID", "*ELASTIC", f"{material.youngs_modulus:.12e}, {material.poisson_ratio}"]
        lines += ["*SOLID SECTION, ELSET=ALL, MATERIAL=SOLID", "*STEP, NLGEOM, INC=1000", "*STATIC"]
        lines += [f"{self.increment}, 1.", "*BOUNDARY"]
        for unknown, value in sorted(self.motions.items()):
            node, axis = divmod(unknown, 3)
            if known[node]:
                lines.append(f"{node + 1}, {axis + 1}, {axis + 1}, {value:.12e}")
        if self.forces is not None:
            lines += ["*CLOAD"]
            lines += [f"{n + 1}, {a + 1}, {self.forces[n, a]:.12e}" for n, a in np.argwhere(self.forces).tolist()]
        lines += ["*NODE PRINT, NSET=WATCHED, FREQUENCY=1000", "U", "*NODE PRINT, NSET=WATCHED, TOTALS=ONLY", "RF"]
        return "\n".join([*lines, "*END STEP", ""])


@dataclass(frozen=True)
class Answer:
    """What CalculiX found.

    Parameters
    ----------
    displacements
        Of the watched nodes at the end, node number to (3,), m.
    times, reactions
        Pseudo-time of the increments and total force that the supports put on the watched nodes (increments, 3), N.
    iterations
        Of all increments.
    seconds, processor
        Wall time of the process, and processor time of all its threads.
    """

    displacements: dict[int, Array]
    times: Array
    reactions: Array
    iterations: int
    seconds: float = 0.0
    processor: float = 0.0


def solve(deck: Deck, folder: Path, threads: int = 2) -> Answer:
    """Let CalculiX solve a deck in ``folder``.

    Raises
    ------
    RuntimeError
        When it stops before the end.
    """
    ccx = program()
    if ccx is None:
        raise FileNotFoundError(f"CalculiX is not installed; {INSTALL}")
    (folder / "job.inp").write_text(deck.text(), encoding="ascii")
    begin, spent = perf_counter(), getrusage(RUSAGE_CHILDREN)
    done = subprocess.run(
        [ccx, "job"], cwd=folder, capture_output=True, text=True, check=False,
        env=os.environ | {"OMP_NUM_THREADS": str(threads)},
    )  # fmt: skip
    seconds, after = perf_counter() - begin, getrusage(RUSAGE_CHILDREN)
    answer = read(folder / "job.dat", folder / "job.sta") if (folder / "job.dat").exists() else None
    if done.returncode or answer is None or not len(answer.times) or abs(answer.times[-1] - 1.0) > 1e-6:
        raise RuntimeError(f"CalculiX did not reach the end:\n{done.stdout[-2000:]}{done.stderr[-500:]}")
    processor = after.ru_utime + after.ru_stime - spent.ru_utime - spent.ru_stime
    return replace(answer, seconds=seconds, processor=processor)


def read(printed: Path, status: Path) -> Answer:
    """Displacements and forces of the file of printed results; iterations of the status file."""
    displacements: dict[int, Array] = {}
    times, reactions, head = [], [], ""
    for line in printed.read_text(encoding="ascii").splitlines():
        numbers = line.split()
        if title := re.match(r"\s*(displacements|total force) .* and time\s+(\S+)", line):
            head = title[1]
            if head == "total force":
                times.append(float(title[2]))
            else:
                displacements = {}
        elif numbers and head == "displacements":
            displacements[int(numbers[0]) - 1] = np.array(numbers[1:], dtype=float)
        elif numbers and head == "total force":
            reactions.append(np.array(numbers, dtype=float))
    rows = [line.split() for line in status.read_text(encoding="ascii").splitlines()]
    iterations = sum(int(row[3]) for row in rows if row and row[0].isdigit())
    return Answer(displacements, np.array(times), np.reshape(reactions, (-1, 3)), iterations)
