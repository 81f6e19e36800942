"""Surfaces in two colours, with their sharp edges drawn: how tubes look in a scene."""

from typing import Any


def add_painted(
    plotter: Any, surface: Any, share: str, colours: tuple[str, str], sharp: float, edge: float, width: float
) -> None:
    """Add a surface that is coloured by its point data ``share``, from 0 to 1.

    Parameters
    ----------
    plotter
        A pyvista plotter at the subplot to draw in.
    colours
        Of 0 and of 1.
    sharp, edge
        Angles, deg, from which shading breaks, and from which edges are drawn.
    width
        Of the edges' lines.
    """
    from matplotlib.colors import LinearSegmentedColormap

    plotter.add_mesh(
        surface, scalars=share, cmap=LinearSegmentedColormap.from_list(share, list(colours)), clim=(0.0, 1.0),
        show_scalar_bar=False, smooth_shading=True, split_sharp_edges=True, feature_angle=sharp, ambient=0.25,
        specular=0.3,
    )  # fmt: skip
    plotter.add_mesh(surface.extract_feature_edges(edge, manifold_edges=False), color="#333333", line_width=width)
