"""Repair of the polygons in a file, which may cross themselves or each other."""

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.errors import MapError, format_area
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.polygons import list_polygons, make_valid, to_multipolygon

MAX_CRUMB_M2 = 1e-4
"""Obstacles and parts of the free space with a smaller area are rounding errors."""
_MIN_COORDINATE_M = 1e-100
"""Coordinates closer to zero become zero, as in map files. Otherwise GEOS might divide by zero."""


def build_valid_boundary(conversion: Conversion) -> MultiPolygon | None:
    """Return the parts of the boundary of a foreign map, m, without holes; None if it has no boundary."""
    boundary: BaseGeometry | None = conversion.foreign.boundary
    if boundary is None:
        return None
    if not boundary.is_valid:
        problem = "the boundary crossed or touched itself"
        conversion.repaired.append(f"{problem}: {_describe_invalidity(boundary)}")
        boundary = make_valid(boundary)
    parts = [Polygon(part.exterior) for part in list_polygons(boundary)]
    return MultiPolygon(parts) if parts else None


def build_valid_free_space(conversion: Conversion, boundary: MultiPolygon | None) -> MultiPolygon:
    """Build the free space of a foreign map.

    Parameters
    ----------
    conversion : Conversion
    boundary : MultiPolygon or None, m
        Free space outside the boundary is dropped, and reported.

    Returns
    -------
    MultiPolygon, m
        Disjoint valid polygons, the largest first.

    Raises
    ------
    MapError
        If a coordinate is not finite, or if nothing is free.
    """
    source_name = conversion.source_name
    free = conversion.foreign.free
    if not np.isfinite(shapely.get_coordinates(free)).all():
        raise MapError(f"{source_name}: expected finite coordinates")
    inside: BaseGeometry = shapely.transform(free, _round_to_zero)
    if not inside.is_valid:
        problem = "outlines crossed or touched themselves or each other"
        conversion.repaired.append(f"{problem}: {_describe_invalidity(inside)}")
        inside = make_valid(inside)
    if boundary is not None and not shapely.covers(boundary, inside):
        area_before = inside.area
        inside = shapely.intersection(inside, boundary)
        lost = area_before - inside.area
        if lost > MAX_CRUMB_M2:
            conversion.dropped.append(f"{format_area(lost, 3)} of free space outside the boundary")
    valid = to_multipolygon(inside)
    if valid.is_empty:
        raise MapError(f"{source_name}: there is no free space")
    return valid


def _round_to_zero(coordinates: np.ndarray) -> np.ndarray:
    return np.where(abs(coordinates) < _MIN_COORDINATE_M, 0.0, coordinates)


def _describe_invalidity(geometry: BaseGeometry) -> str:
    """Describe why a geometry is invalid, and where."""
    reason: str = shapely.is_valid_reason(geometry)
    # GEOS writes, for example, "Self-intersection[1 2]".
    problem, _, position = reason.partition("[")
    x, _, y = position.rstrip("]").partition(" ")
    if not y:
        return problem.lower()
    return f"{problem.lower()} at [{float(x):.6g}, {float(y):.6g}]"
