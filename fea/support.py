"""Does everything hang together and on something? Rigid motions that nothing prevents are named before a solve."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fea.case import Case
from fea.links import ConstraintError
from fea.pressure import Pressure
from fea.problem import Problem

Array = NDArray[np.float64]
_MOTIONS = ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z")


def pieces(case: Case) -> list[NDArray[np.int64]]:
    """Nodes of every connected piece of the parts' meshes."""
    result = []
    for part, offset in zip(case.parts, case.offsets, strict=False):
        cells = part.cells
        first = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel()
        graph = coo_array((np.ones(len(first)), (first, cells[:, 1:].ravel())), shape=(part.nodes, part.nodes))
        count, label = connected_components(graph, directed=False)
        result += [np.flatnonzero(label == i) + offset for i in range(count)]
    return result


def require_support(case: Case, problem: Problem) -> None:
    """Refuse a case in which a piece can move as a rigid body and nothing resists.

    Contact is taken to hold whatever it may touch: it cannot be known beforehand.

    Raises
    ------
    ConstraintError
        Names the piece and the motion.
    """
    found, links = pieces(case), problem.links
    size = float(np.ptp(case.points, axis=0).max())
    width = 6 * (len(found) + len(links.rigid))
    motions = np.zeros((links.size, width))
    for number, nodes in enumerate(found):
        motions[:, 6 * number : 6 * number + 6] = _rigid_motions(case.points, nodes, size, links.size)
    rows = [motions[links.prescribed]]
    if links.ties is not None:
        rows.append((links.ties @ motions - motions)[links.ties.diagonal() == 0])
    for number, part in enumerate(links.rigid):
        pose = np.zeros((6, width))
        pose[:, 6 * (len(found) + number) :][:, :6] = np.diag([1.0] * 3 + [1 / size] * 3)
        carried = part.nodes < case.nodes
        unknowns = (3 * part.nodes[carried, None] + np.arange(3)).ravel()
        rows.append(motions[unknowns] - part.jacobian(np.zeros(6))[carried].reshape(-1, 6) @ pose)
        rows.append(pose[np.setdiff1d(np.arange(6), links.pose_free[number])])
        rows += [pose[spring.stiffness > 0] for spring in problem.springs if spring.part == number]
        rows += [pose for term in problem.terms if np.isin(part.nodes[0], term.cells)]
    rows += [_term_rows(term.cells, motions) for term in problem.terms if not isinstance(term, Pressure)]
    conditions = np.concatenate([row for row in rows if len(row)] or [np.zeros((1, width))])
    # Only the directions of the few rigid motions matter: the triangle of a QR decomposition has them all.
    free = null_space(np.linalg.qr(conditions / max(np.abs(conditions).max(), 1e-300), mode="r"), rcond=1e-8)
    if free.shape[1]:
        raise ConstraintError(_words(case, found, free))


def _rigid_motions(points: Array, nodes: NDArray[np.int64], size: float, rows: int) -> Array:
    """Displacements (rows, 6) of three translations and three turns about the nodes' middle."""
    result = np.zeros((rows, 6))
    arms = points[nodes] - points[nodes].mean(axis=0)
    for axis in range(3):
        result[3 * nodes + axis, axis] = 1.0
        turn = np.cross(np.eye(3)[axis], arms) / size
        for k in range(3):
            result[3 * nodes + k, 3 + axis] = turn[:, k]
    return result


def _term_rows(cells: NDArray[np.int64], motions: Array) -> Array:
    nodes = np.unique(cells[cells >= 0])
    return motions[(3 * nodes[:, None] + np.arange(3)).ravel()]


def _words(case: Case, found: list[NDArray[np.int64]], free: Array) -> str:
    strength = np.linalg.norm(free.reshape(-1, 6, free.shape[1]), axis=2)
    number = int(np.argmax(strength.max(axis=1)))
    motion = _MOTIONS[int(np.argmax(strength[number]))]
    if number >= len(found):
        return f"the rigid part {list(case.rigids)[number - len(found)]!r} can {motion} freely: hold it, or spring it"
    nodes = found[number]
    part = int(np.searchsorted(case.offsets, nodes[0], side="right")) - 1
    middle = ", ".join(f"{c:.4g}" for c in case.points[nodes].mean(axis=0))
    piece = "" if len(found) == len(case.parts) else f", piece of {len(nodes)} nodes around ({middle}) m"
    return f"part {part + 1} ({case.parts[part].kind}{piece}) can {motion} freely: fix it, tie it or spring it"
