"""Where an obstacle with a path comes by, and what stands there."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import shapely

if TYPE_CHECKING:
    from shapely import Polygon
    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment.obstacle_path import ObstaclePath

Key = TypeVar("Key")

LEAST = 1e-6
"""Area in m² from which an obstacle is in the way: what is less is rounding, of obstacles that touch."""


def swept_area(polygon: Polygon, path: ObstaclePath) -> BaseGeometry:
    """Return all places that an obstacle comes by on its path: where it is, if that leads nowhere.

    Parameters
    ----------
    polygon : Polygon, m
        The obstacle at time zero.
    path : ObstaclePath

    Examples
    --------
    >>> from robocov.environment.obstacle_path import ObstaclePath
    >>> swept_area(shapely.box(0, 0, 1, 1), ObstaclePath(((0, 0), (2, 0)), 1.0)).area
    3.0
    """
    points = np.array([*path.points, *path.points[: path.repeat == "loop"]], dtype=float).reshape(-1, 2)
    shifts = points - points[:1]
    return shapely.union_all([polygon, *(_along(polygon, a, b) for a, b in pairwise(shifts))])


def in_the_way(
    area: BaseGeometry, others: Mapping[Key, BaseGeometry], inside: BaseGeometry | None = None
) -> tuple[dict[Key, BaseGeometry], BaseGeometry | None]:
    """Return what of an area the others take, by more than they touch it, and what of it is not inside.

    Parameters
    ----------
    area : geometry, m
    others : dict of name to geometry, m
    inside : geometry or None, m
        Of the boundary; None for no boundary.

    Returns
    -------
    dict of name to geometry, geometry or None
        Of those alone that are in the way.
    """
    shared = {name: area.intersection(shape) for name, shape in others.items()}
    beyond = None if inside is None else area.difference(inside)
    return (
        {name: part for name, part in shared.items() if part.area > LEAST},
        beyond if beyond is not None and beyond.area > LEAST else None,
    )


def _along(polygon: Polygon, begin: Array, end: Array) -> BaseGeometry:
    """Return the Minkowski sum of a polygon and a line: the polygon at both ends, and what each edge sweeps.

    Whoever gets outside of the polygon on the way does so through its rim.
    """
    parts: list[BaseGeometry] = []
    for ring in (polygon.exterior, *polygon.interiors):
        at = shapely.get_coordinates(ring)
        quads = np.stack([at[:-1] + begin, at[1:] + begin, at[1:] + end, at[:-1] + end], axis=1)
        one, other = at[1:] - at[:-1], end - begin
        flat = np.abs(one[:, 0] * other[1] - one[:, 1] * other[0]) < 1e-12
        parts += shapely.polygons(quads[~flat]).tolist()
    ends = [shapely.transform(polygon, lambda at, by=by: at + by) for by in (begin, end)]
    return shapely.union_all([*parts, *ends])
