"""Polygon obstacles of shapely's geometries, to the tenth of a millimetre and still valid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely
from shapely import Polygon

from robocov.environment import PolygonObstacle
from robocov.mapfile.models import SMALLEST
from robocov_app.editor.model.plane import DECIMALS, rounded

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry
    from shapely.geometry.polygon import LinearRing

    from robocov.environment import Ring


def outlines(geometry: BaseGeometry, name: str | None = None) -> tuple[PolygonObstacle, ...]:
    """Return the polygons of a valid geometry, the largest first, with their holes.

    Vertices come to lie on a grid of a tenth of a millimetre by shapely's snap rounding, so that no outline
    crosses itself afterwards; vertices in line with their neighbours go, and so do parts and holes
    smaller than a millimetre either way.
    """
    snapped = shapely.simplify(shapely.set_precision(geometry, 10.0**-DECIMALS), 0.0)
    parts = [part for part in shapely.get_parts(snapped) if isinstance(part, Polygon) and not _is_crumb(part)]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return tuple(
        PolygonObstacle(
            _ring(part.exterior), tuple(_ring(hole) for hole in part.interiors if not _is_crumb(hole)), name
        )
        for part in map(shapely.orient_polygons, parts)
    )


def _ring(ring: LinearRing) -> Ring:
    return tuple(rounded(point) for point in ring.coords[:-1])


def _is_crumb(part: BaseGeometry) -> bool:
    low_x, low_y, high_x, high_y = part.bounds
    # of what is empty these are no numbers
    return not min(high_x - low_x, high_y - low_y) >= SMALLEST
