"""Coordinates as text, and areas that are still valid with so many decimals."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID, Environment

DIGITS = 6
"""Decimals of metres by default: the free space is known to a micrometre."""


def decimal(value: float, digits: int) -> str:
    """Return a number with at most so many decimals, and none that say nothing.

    >>> decimal(1.5, 3), decimal(-0.0001, 3), decimal(1200.0, 0)
    ('1.5', '0', '1200')
    """
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def on_grid(geometry: BaseGeometry, digits: int) -> list[Polygon]:
    """Return the polygons of a geometry with coordinates of so many decimals, valid, the largest first.

    Outer rings run counter-clockwise, holes clockwise. What has no area any more is not there.
    """
    rounded = shapely.set_precision(geometry, 10.0**-digits)
    rounded = shapely.transform(rounded, lambda points: np.round(points, digits))
    parts = [part for part in shapely.get_parts(rounded) if isinstance(part, Polygon) and part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return [shapely.orient_polygons(part) for part in parts]


def free_area(boundary: BaseGeometry, obstacles: Iterable[BaseGeometry]) -> float:
    """Return the area inside of a boundary and outside of obstacles, as `Environment.free` has it, m²."""
    blocked = shapely.union_all(list(obstacles), grid_size=GRID)
    return float(shapely.difference(boundary, blocked, grid_size=GRID).area)


def free_on_grid(environment: Environment, digits: int) -> MultiPolygon:
    """Return the free space with coordinates of so many decimals."""
    return MultiPolygon(on_grid(environment.free, digits))


def rings(polygon: Polygon) -> list[list[tuple[float, float]]]:
    """Return the rings of a polygon, the outer one first; their last point is the first."""
    return [[(x, y) for x, y in ring.coords] for ring in (polygon.exterior, *polygon.interiors)]
