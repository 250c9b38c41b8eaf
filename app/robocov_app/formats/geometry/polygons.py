"""Operations on polygons: union, buffering and rounding; and formatting of coordinates."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov.typing import FloatArray

DEFAULT_DIGITS = 6
"""Decimals of coordinates in meters: they are rounded to a micrometer."""
_MITRE_LIMIT = 5.0
"""Mitre limit of buffers: sharper corners are cut off."""


def unite(areas: Sequence[BaseGeometry]) -> BaseGeometry:
    """Return the union of areas, m.

    Notes
    -----
    Without a precision grid, GEOS is ten times as fast, but may silently lose a part where edges almost
    coincide. So the union is checked to contain every corner, and computed on a grid if it does not.
    """
    union = shapely.union_all(areas)
    corners = shapely.points(shapely.get_coordinates(areas))
    shapely.prepare(union)
    if shapely.dwithin(union, corners, GRID_M).all():
        return union
    return shapely.union_all(areas, grid_size=GRID_M)


def buffer_with_mitres(geometry: Any, distance: float) -> Any:
    """Grow areas by a distance, or shrink them if it is negative, without rounding their corners.

    Parameters
    ----------
    geometry : shapely geometry, or array of geometries
    distance : float, m

    Returns
    -------
    shapely geometry, or array of geometries

    Notes
    -----
    Warnings are suppressed: GEOS divides by the length of an edge even where points are repeated, and drops
    such edges afterwards.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return shapely.buffer(geometry, distance, join_style="mitre", mitre_limit=_MITRE_LIMIT)


def make_valid(area: BaseGeometry) -> BaseGeometry:
    """Make an area valid; parts that collapse to lines or points are dropped."""
    valid: BaseGeometry = shapely.make_valid(area, method="structure", keep_collapsed=False)
    return valid


def list_polygons(geometry: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a geometry, the largest first, oriented counter-clockwise.

    Lines and points in the geometry are dropped.
    """
    # Twice, because a collection may contain multipolygons.
    flat = shapely.get_parts(shapely.get_parts(geometry))
    parts = [part for part in flat if isinstance(part, Polygon) and part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return [shapely.orient_polygons(part) for part in parts]


def to_multipolygon(geometry: BaseGeometry) -> MultiPolygon:
    """Return the polygons of a geometry as a multipolygon; see `list_polygons`."""
    return MultiPolygon(list_polygons(geometry))


def fill_holes(geometry: BaseGeometry) -> Polygon:
    """Return the largest polygon of a geometry without its holes."""
    return Polygon(list_polygons(geometry)[0].exterior)


def round_polygons(geometry: BaseGeometry, digits: int) -> MultiPolygon:
    """Round the coordinates of polygons, and keep them valid.

    Vertices that coincide after rounding, or lie on the line between their neighbors, are dropped.

    Parameters
    ----------
    geometry : shapely geometry
    digits : int
        Number of decimals.

    Returns
    -------
    MultiPolygon
        The largest part first.
    """

    def round_points(points: FloatArray) -> FloatArray:
        return np.round(points, digits) + 0.0  # without negative zeros

    rounded = shapely.transform(geometry, round_points)
    if not rounded.is_valid:
        # A simplified wall may cross the boundary next to it, and GEOS cannot round invalid geometries.
        precise = shapely.set_precision(make_valid(geometry), 10.0**-digits)
        rounded = shapely.transform(precise, round_points)
    parts = list_polygons(rounded)
    tidy = [_tidy_polygon(part, digits) for part in parts]
    if not all(part.is_valid for part in tidy):
        # Rings touched at a vertex that was dropped.
        tidy = parts
    return to_multipolygon(MultiPolygon(tidy))


def _tidy_polygon(polygon: Polygon, digits: int) -> Polygon:
    lines = (polygon.exterior, *polygon.interiors)
    outer, *holes = [tidy_ring(shapely.get_coordinates(line)[:-1], digits) for line in lines]
    return Polygon(outer, holes)


def tidy_ring(points: FloatArray, digits: int) -> FloatArray:
    """Drop redundant vertices of a ring: repeated ones, and those on a straight line.

    Parameters
    ----------
    points : (k, 2) array
        Vertices, rounded to `digits` decimals; the first one is not repeated.
    digits : int

    Returns
    -------
    (m, 2) array
        The remaining vertices, in the same order. The enclosed area does not change.
    """
    # Products of integers are exact.
    positions = [tuple(point) for point in np.rint(points * 10.0**digits).astype(np.int64).tolist()]
    kept: list[int] = []
    for k in range(len(positions)):
        while len(kept) > 1 and _is_straight(positions[kept[-2]], positions[kept[-1]], positions[k]):
            kept.pop()
        if kept and positions[kept[-1]] == positions[k]:
            continue
        kept.append(k)
    # The same check where the ring closes.
    while len(kept) > 2:
        if _is_straight(positions[kept[-2]], positions[kept[-1]], positions[kept[0]]):
            kept.pop()
        elif _is_straight(positions[kept[-1]], positions[kept[0]], positions[kept[1]]):
            kept.pop(0)
        else:
            break
    return points[kept]


def _is_straight(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
    """Return whether b is on the line through a and c."""
    return (b[0] - a[0]) * (c[1] - b[1]) == (b[1] - a[1]) * (c[0] - b[0])


def snap_to_grid(geometry: BaseGeometry, digits: int) -> list[Polygon]:
    """Round the coordinates of a valid geometry and return its polygons, still valid; see `list_polygons`."""
    precise = shapely.set_precision(geometry, 10.0**-digits)
    return list_polygons(shapely.transform(precise, lambda points: np.round(points, digits)))


def format_decimal(value: float, digits: int) -> str:
    """Format a number with at most `digits` decimals and without trailing zeros.

    Examples
    --------
    >>> format_decimal(1.50, 3)
    '1.5'
    """
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def list_rings(polygon: Polygon) -> list[list[tuple[float, float]]]:
    """Return the closed rings of a polygon, the outer one first."""
    return [[(x, y) for x, y in ring.coords] for ring in (polygon.exterior, *polygon.interiors)]


def compute_free_area(boundary: BaseGeometry, obstacles: Iterable[BaseGeometry]) -> float:
    """Return the area inside a boundary and outside obstacles, m², computed as for `Environment.free`."""
    blocked = shapely.union_all(list(obstacles), grid_size=GRID_M)
    return float(shapely.difference(boundary, blocked, grid_size=GRID_M).area)
