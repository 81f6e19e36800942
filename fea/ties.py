"""Where nodes lie on a surface, for gluing them to it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fea.links import ConstraintError
from fea.surface import Surface, shape_functions

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
_CANDIDATES, _ITERATIONS = 6, 25


def closest_points(surface: Surface, points: Array, places: Array, reach: float) -> tuple[Ints, Array]:
    """Facet and shape functions of the surface's point nearest to every place.

    Parameters
    ----------
    surface
        What the places are to lie on.
    points
        Reference coordinates of all nodes (N, 3), m.
    places
        (m, 3), m.
    reach
        Farthest that a place may lie from the surface, m.

    Returns
    -------
    nodes, shares
        Nodes of the facet (m, k) and their weights (m, k), which sum to 1.

    Raises
    ------
    ConstraintError
        When a place is farther than ``reach``.
    """
    corners = points[surface.facets]
    tree = cKDTree(corners.mean(axis=1))
    _, candidates = tree.query(places, k=min(_CANDIDATES, len(surface.facets)))
    candidates = np.reshape(candidates, (len(places), -1))
    best = np.full(len(places), np.inf)
    facet = np.zeros(len(places), dtype=np.int64)
    shares = np.zeros((len(places), surface.facets.shape[1]))
    for column in candidates.T:
        weights = _project(surface.shape, corners[column], places)
        away = np.linalg.norm(np.einsum("mk,mkc->mc", weights, corners[column]) - places, axis=1)
        better = away < best
        best[better], facet[better], shares[better] = away[better], column[better], weights[better]
    if (best > reach).any():
        worst = int(np.argmax(best))
        raise ConstraintError(
            f"the node at {places[worst].round(9).tolist()} m lies {best[worst]:.3g} m off the surface that it is to "
            f"be tied to, more than {reach:.3g} m: move the edge to the surface, or allow it by 'reach'"
        )
    return surface.facets[facet], shares


def _project(shape: str, facets: Array, places: Array) -> Array:
    """Shape functions (m, k) at the nearest point inside each of ``facets`` (m, k, 3) (Gauss-Newton, kept inside)."""
    spot = np.full((2, len(places)), 0.5 if shape == "quad9" else 1 / 3)
    for _ in range(_ITERATIONS):
        values, slopes = shape_functions(shape, spot)
        off = places - np.einsum("mk,mkc->mc", values, facets)
        sides = np.einsum("mjk,mkc->mjc", slopes, facets)
        metric = np.einsum("mjc,mlc->mjl", sides, sides)
        step = np.linalg.solve(metric, np.einsum("mjc,mc->mj", sides, off)[:, :, None])[:, :, 0]
        spot = np.clip(spot + np.clip(step.T, -0.5, 0.5), 0.0, 1.0)
        if shape == "tri6":
            over = np.maximum(spot.sum(axis=0) - 1.0, 0.0)
            spot = np.clip(spot - over / 2, 0.0, 1.0)
        if np.abs(step).max() < 1e-13:
            break
    return shape_functions(shape, spot)[0]
