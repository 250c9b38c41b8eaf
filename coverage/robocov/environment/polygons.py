"""Operations on polygons that are robust against rounding."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.errors import MapError, quote, to_floats
from robocov.typing import FloatArray, Ring

GRID_M = 1e-6
"""Grid size to which coordinates of derived geometry are rounded. The grid makes unions and differences
robust: shapes that touch except for rounding errors touch exactly, and no slivers remain."""
_MIN_OVERLAP_M2 = 1e-6
"""Minimum area of an overlap. Smaller overlaps are rounding errors of shapes that touch."""

Name = TypeVar("Name", bound=Hashable)
"""Type of the names of shapes."""


def find_overlaps(
    shape: BaseGeometry, others: Mapping[Name, BaseGeometry], container: BaseGeometry | None = None
) -> tuple[dict[Name, BaseGeometry], BaseGeometry | None]:
    """Find the shapes that overlap another shape, and the part of this shape outside a container.

    Shapes that only touch do not overlap.

    Parameters
    ----------
    shape : geometry, m
        The shape to check.
    others : mapping of name to geometry, m
        Shapes that should not overlap it.
    container : geometry or None, m
        Shape that should contain it.

    Returns
    -------
    overlaps : dict of name to geometry, m
        Intersections of the shape with those that overlap it.
    excess : geometry or None, m
        The part of the shape that is not in `container`; None if there is no such part.
    """
    intersections = {name: shape.intersection(other) for name, other in others.items()}
    overlaps = {name: overlap for name, overlap in intersections.items() if overlap.area > _MIN_OVERLAP_M2}
    if container is None:
        return overlaps, None
    excess = shape.difference(container)
    if excess.area <= _MIN_OVERLAP_M2:
        return overlaps, None
    return overlaps, excess


def build_polygon(location: str, outline: Ring, holes: Sequence[Ring] = ()) -> Polygon:
    """Build a polygon from the vertices of its rings.

    Parameters
    ----------
    location : str
        What the polygon is, for messages.
    outline : (k, 2) sequence, m
        Vertices of the outer ring.
    holes : sequence of (k, 2) sequences, m
        Vertices of the inner rings.

    Returns
    -------
    Polygon
        Its edges may meet; see `require_valid_polygon`.

    Raises
    ------
    MapError
        If a ring is not a list of at least three finite points.
    """
    rings = []
    for ring in (outline, *holes):
        points = to_floats(location, ring, "at least 3 points [x, y] in meters", MapError)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
            raise MapError(
                f"{location}: expected at least 3 finite points [x, y], got {quote(points.tolist())}"
            )
        rings.append(points)
    return Polygon(rings[0], rings[1:])


def require_valid_polygon(location: str, polygon: Polygon) -> None:
    """Raise MapError if edges of a polygon cross or touch each other, or a hole is outside of it.

    Parameters
    ----------
    location : str
        What the polygon is, for the message.
    polygon : Polygon
    """
    if not polygon.is_valid:
        # The reason ends with the coordinates of a point, as in "Self-intersection[5 5]".
        reason = shapely.is_valid_reason(polygon)
        raise MapError(f"{location}: expected a polygon whose edges do not meet, got {reason}")


def unite_shapes(shapes: NDArray[np.object_]) -> BaseGeometry:
    """Compute the union of shapes, with coordinates on the grid of `GRID_M`.

    Parameters
    ----------
    shapes : (n,) array of geometries, m
        Shapes, which may overlap.

    Returns
    -------
    geometry, m
        Polygons that do not overlap.
    """
    pairs = STRtree(shapes).query(shapes, "dwithin", 2.0 * GRID_M)
    # Computing a union is slow, and only shapes that meet others need it. The query pairs every shape with
    # itself, so that shapes in one pair only meet no others.
    meets_others = np.bincount(pairs[0]) > 1
    separate = shapely.get_parts(shapely.set_precision(shapes[~meets_others], GRID_M))
    united = shapely.union_all(shapes[meets_others], grid_size=GRID_M)
    return shapely.multipolygons([*separate, *extract_polygons(united).geoms])


def extract_polygons(geometry: BaseGeometry) -> MultiPolygon:
    """Extract the polygons of a geometry, without lines and points.

    Parameters
    ----------
    geometry : geometry, m
        Geometry of any type, such as the result of an intersection.

    Returns
    -------
    MultiPolygon, m
        Counter-clockwise polygons, the largest first.
    """
    shapes = shapely.get_parts(geometry)
    polygons = [shape for shape in shapes if isinstance(shape, Polygon) and shape.area > 0.0]
    polygons.sort(key=lambda polygon: (-polygon.area, polygon.bounds))
    return MultiPolygon([shapely.orient_polygons(polygon) for polygon in polygons])


def find_nearest_inside(area: Any, positions: FloatArray) -> FloatArray:
    """Find the points of an area that are nearest to given positions.

    Parameters
    ----------
    area : geometry or (n,) array of geometries, m
        One area for all positions, or one area for each position.
    positions : (n, 2) array, m
        Positions, inside or outside.

    Returns
    -------
    (n, 2) array, m
        Nearest points. They are the same object as `positions` if all positions are inside.

    Examples
    --------
    >>> find_nearest_inside(shapely.box(0, 0, 1, 1), np.array([[0.5, 0.5], [2.0, 0.25]]))
    array([[0.5 , 0.5 ],
           [1.  , 0.25]])
    """
    points = shapely.points(positions)
    outside = np.flatnonzero(~shapely.intersects(area, points))
    if len(outside) == 0:
        return positions
    areas = np.broadcast_to(area, len(points))
    lines = shapely.shortest_line(areas[outside], points[outside])
    # Each line has two points, of which the first one is in the area.
    nearest_points = positions.copy()
    nearest_points[outside] = shapely.get_coordinates(lines)[::2]
    return nearest_points
