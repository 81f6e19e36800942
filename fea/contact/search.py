"""Which facets may touch which."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from fea.contact import kernels
from fea.surface import Shapes, Surface

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def facet_sizes(surface: Surface, points: Array) -> Array:
    """Root of the area of every facet (facets,), m."""
    shapes = surface.shapes()
    tangents = np.einsum("qjk,fkc->fqjc", shapes.slopes, points[surface.facets])
    return np.sqrt(np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) @ shapes.weights)


def neighbours(slave: Surface, master: Surface, nodes: int, rings: int) -> csr_array:
    """Pairs of facets (slaves, masters) that share a node, or hang together by ``rings`` such steps."""
    result = _incidence(slave, nodes) @ _incidence(master, nodes).T
    step = _incidence(master, nodes) @ _incidence(master, nodes).T
    for _ in range(rings - 1):
        result = result @ step
    return csr_array(result)


def _incidence(surface: Surface, nodes: int) -> csr_array:
    facets, k = surface.facets.shape
    place = (np.repeat(np.arange(facets), k), surface.facets.ravel())
    return csr_array(coo_array((np.ones(facets * k), place), shape=(facets, nodes)))


@dataclass(frozen=True)
class NearPairs:
    """Finds pairs of facets that may come into contact.

    Parameters
    ----------
    facing, depth, reach
        See ``fea.contact.SurfaceContact``.
    apart
        Pairs (slaves, masters) that are neighbours and do not count.
    """

    facing: float
    depth: float
    reach: float
    apart: csr_array

    def find(
        self, positions: Array, kind: int, masters: Ints, slaves: Ints, shapes: Shapes, reach: float, margin: float
    ) -> tuple[Ints, NDArray[np.bool_]]:
        """Pairs (m, 2) of slave and master, ordered, and which of them are needed.

        Needed are those within ``reach``, m, and at most ``margin`` beyond a facet's edge, in its lengths; the
        others lie within half as much again, and a quarter of a facet farther.
        """
        wide = 1.5 * reach
        near = _near(*_spheres(positions[slaves]), *_spheres(positions[masters]), max(wide, self.depth))
        near = near[~self._neighbours(near)]
        level = kernels.facing_pairs(
            kind, positions, masters, slaves, shapes.values, shapes.slopes, near,
            self.facing, self.depth, np.array([wide, reach]), np.array([margin + 0.25, margin]),
        )  # fmt: skip
        return near[level > 0], level[level > 0] == 2

    def _neighbours(self, pairs: Ints) -> NDArray[np.bool_]:
        columns = self.apart.shape[1]
        return np.isin(pairs[:, 0] * columns + pairs[:, 1], self._apart_keys)

    @cached_property
    def _apart_keys(self) -> Ints:
        rows = np.repeat(np.arange(self.apart.shape[0]), np.diff(self.apart.indptr))
        return rows * self.apart.shape[1] + self.apart.indices


def _spheres(corners: Array) -> tuple[Array, Array]:
    """Middles (facets, 3) and radii (facets,), m, of facets with nodes at ``corners`` (facets, k, 3)."""
    middles = corners.mean(axis=1)
    return middles, np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1, initial=0.0)


def _near(middles: Array, radii: Array, others: Array, other_radii: Array, reach: float) -> Ints:
    """Pairs (m, 2), ordered, of spheres that come closer than ``reach``."""
    from scipy.spatial import cKDTree

    if not len(middles) or not len(others):
        return np.zeros((0, 2), dtype=np.int64)
    farthest = float(radii.max() + other_radii.max() + reach)
    found = cKDTree(middles).sparse_distance_matrix(cKDTree(others), farthest, output_type="ndarray")
    close = found["v"] <= radii[found["i"]] + other_radii[found["j"]] + reach
    pairs = np.stack([found["i"][close], found["j"][close]], axis=1).astype(np.int64)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
