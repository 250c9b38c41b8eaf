"""The boundary around a free space, and the obstacles that fill the rest of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

CRUMB = 1e-4
"""Obstacles and parts that are smaller, in m², come of rounding."""


def polygons(geometry: BaseGeometry) -> list[Polygon]:
    """Return the polygons in `geometry`, counter-clockwise, the largest first; lines and points go."""
    flat = shapely.get_parts(shapely.get_parts(geometry))
    parts = [shapely.orient_polygons(part) for part in flat if isinstance(part, Polygon) and part.area > 0.0]
    return sorted(parts, key=lambda part: (-part.area, part.bounds))


def filled(geometry: BaseGeometry) -> Polygon:
    """Return the largest polygon in `geometry`, without its holes."""
    return Polygon(polygons(geometry)[0].exterior)


def rounded(geometry: BaseGeometry, digits: int) -> MultiPolygon:
    """Return the polygons of `geometry` with rounded coordinates, valid; the largest first."""

    def decimal(points: np.ndarray) -> np.ndarray:
        # no negative zero
        return np.round(points, digits) + 0.0

    plain = shapely.transform(geometry, decimal)
    if not plain.is_valid:
        # simplified walls may cross a boundary that was simplified beside them, which GEOS refuses to round
        valid = shapely.make_valid(geometry, method="structure", keep_collapsed=False)
        plain = shapely.transform(shapely.set_precision(valid, 10.0**-digits), decimal)
    return MultiPolygon(polygons(plain))


def bounded(
    free: MultiPolygon, given: Polygon | None, *, hull: bool, margin: float, digits: int
) -> tuple[Polygon, list[Polygon]]:
    """Return a boundary around `free`, and what is solid in it.

    Parameters
    ----------
    free : MultiPolygon, m
        With coordinates of so many `digits`.
    given : Polygon or None, m
        A boundary without holes, which may run along the free space as it was before walls moved.
        None: the outline of the free space, or its convex hull where it is of several parts.
    hull : bool
        Whether the convex hull of that is wanted.
    margin : float, m
        So much is solid around it.
    digits : int
        Decimals of the coordinates.

    Examples
    --------
    >>> room = shapely.box(0, 0, 4, 3) - shapely.box(1, 1, 2, 2)
    >>> boundary, solid = bounded(MultiPolygon([room]), None, hull=False, margin=0.0, digits=4)
    >>> boundary.area, [part.area for part in solid]
    (12.0, [1.0])
    """
    parts = list(free.geoms)
    if given is not None:
        base = filled(rounded(shapely.union(given, free), digits))
    elif len(parts) > 1:
        base = free.convex_hull
    else:
        base = Polygon(parts[0].exterior)
    if hull:
        base = base.convex_hull
    if margin > 0.0:
        base = filled(base.buffer(margin, join_style="mitre", mitre_limit=2.0))
    if given is None and not hull and margin == 0.0 and len(parts) == 1:
        return base, [Polygon(hole) for hole in parts[0].interiors]
    base = filled(rounded(base, digits))
    if not shapely.covers(base, free):  # by a rounded hair
        base = filled(shapely.union(base, free))
    return base, polygons(rounded(shapely.difference(base, free), digits))
