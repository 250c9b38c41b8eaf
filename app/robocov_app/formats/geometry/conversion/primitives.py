"""Circles and walls of a file that remain circles and walls instead of polygons."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.arrays import Array, BoolArray, IntArray
from robocov.environment import (
    MAX_SAGITTA_M,
    CircleObstacle,
    Obstacle,
    PolygonObstacle,
    Ring,
    WallObstacle,
)
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M
from robocov_app.formats.foreign_map import Primitive
from robocov_app.formats.geometry.conversion.cleaning import measure_deviation
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.conversion.map_layout import MapLayout
from robocov_app.formats.geometry.conversion.starts import find_rooms
from robocov_app.formats.geometry.conversion.validity import MAX_CRUMB_M2
from robocov_app.formats.geometry.polygons import round_polygons
from robocov_app.formats.geometry.simplification.simplify import SimplifiedSpace

MAX_PRIMITIVES = 5_000
"""Of more circles and walls, to compare them takes seconds: then all of them become polygons."""
_MAX_POCKET_DISTANCE_M = 1e-3
"""Distance from a pocket to the primitives next to it."""
_MAX_ROUNDS = 5
"""Number of attempts to find primitives that leave no pockets."""
_Obstacle = TypeVar("_Obstacle", bound=Obstacle)


def restore_primitives(
    layout: MapLayout, drawing: SimplifiedSpace, before: MultiPolygon, conversion: Conversion
) -> MapLayout:
    """Replace polygons of a layout by the circles and walls that they consist of.

    Polygons stay where a pocket would be left between a primitive and its surroundings, and all of them stay
    if walls would have moved by more than the tolerance.

    Parameters
    ----------
    layout : MapLayout
    drawing : SimplifiedSpace
        The free space that the layout leaves.
    before : MultiPolygon, m
        The free space before it was simplified.
    conversion : Conversion

    Returns
    -------
    MapLayout
    """
    max_rooms = max(len(find_rooms(space, conversion.radius)) for space in (before, drawing.free))
    rejected: frozenset[Primitive] = frozenset()
    for _ in range(_MAX_ROUNDS):
        candidate = _match_primitives(layout, drawing.tolerance, max_rooms, rejected, conversion)
        if not candidate.primitives:
            return layout
        pockets = _find_pockets(candidate)
        next_to_pockets = {
            primitive
            for primitive in candidate.primitives
            if (shapely.distance(primitive.polygon, pockets) < _MAX_POCKET_DISTANCE_M).any()
        }
        if next_to_pockets:
            rejected |= next_to_pockets
            continue
        # Removes the vertices at which removed polygons started.
        boundary = round_polygons(candidate.boundary.simplify(0.0), conversion.digits).geoms[0]
        deviation = measure_deviation(before, candidate.compute_free())
        # A circle stays within its sagitta, for any number of sides.
        limit = conversion.tolerance + conversion.grid + MAX_SAGITTA_M
        if deviation.distance > max(limit, layout.deviation.distance):
            return layout
        return candidate._replace(boundary=boundary, deviation=deviation)
    return layout


def transform_numbers(obstacle: _Obstacle, function: Callable[[float], float]) -> _Obstacle:
    """Apply a function to all coordinates and sizes of an obstacle."""

    def transform_ring(points: Ring) -> Ring:
        return tuple((function(x), function(y)) for x, y in points)

    if isinstance(obstacle, CircleObstacle):
        center = transform_ring((obstacle.center,))[0]
        return replace(obstacle, center=center, radius=function(obstacle.radius))
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=transform_ring(obstacle.points), width=function(obstacle.width))
    assert isinstance(obstacle, PolygonObstacle)
    holes = tuple(transform_ring(hole) for hole in obstacle.holes)
    return replace(obstacle, vertices=transform_ring(obstacle.vertices), holes=holes)


def _match_primitives(
    layout: MapLayout,
    tolerance: float,
    max_rooms: int,
    rejected: frozenset[Primitive],
    conversion: Conversion,
) -> MapLayout:
    """Return a layout with primitives in place of the polygons that they consist of, in their order.

    Polygons that consist of several primitives stay, or all of them, if a robot would have more than
    `max_rooms` separate regions.
    """
    rounded_primitives = {
        transform_numbers(primitive, lambda value: round(value, conversion.digits) + 0.0): primitive
        for primitive in conversion.foreign.primitives
    }
    usable = [shape for shape in rounded_primitives if _fits_map(shape) and shape not in rejected]
    if not usable or len(usable) > MAX_PRIMITIVES:
        return layout
    # The exact primitives, as a circle of a slightly different radius may have another number of sides.
    exact = [rounded_primitives[primitive] for primitive in usable]
    slack = tolerance + conversion.grid
    matches = _find_matches(layout, exact, usable, slack)
    # Several primitives may have a gap among them that was filled.
    for max_count in (len(usable), 1):
        used = {index for match in matches if len(match) <= max_count for index in match}
        primitives = [usable[index] for index in sorted(used)]
        solid = [
            part for part, match in zip(layout.solid, matches, strict=True) if not 0 < len(match) <= max_count
        ]
        candidate = layout._replace(solid=solid, primitives=primitives)
        if len(find_rooms(candidate.compute_free(), conversion.radius)) <= max_rooms:
            return candidate
    return layout


def _find_matches(
    layout: MapLayout, exact: list[Primitive], usable: list[Primitive], slack: float
) -> list[set[int]]:
    """Return the primitives that each polygon of a layout consists of; none where they do not match.

    Inside the boundary, polygon and primitives must cover the same area: neither reaches farther than twice
    the slack beyond the other, as corners may, and their areas differ by no more than the slack all along the
    outline. The primitives must have fewer points.
    """
    covered = np.array([primitive.polygon for primitive in exact], dtype=object)
    shapely.prepare(layout.boundary)
    is_outside = ~shapely.covers(layout.boundary, covered)
    covered[is_outside] = shapely.intersection(covered[is_outside], layout.boundary)
    pieces, owner = shapely.get_parts(covered, return_index=True)
    tree = STRtree(pieces)
    matches: list[set[int]] = []
    for part in layout.solid:
        grown = part.buffer(2 * slack)
        inside: IntArray = np.sort(tree.query(grown, "covers"))
        match = set(owner[inside].tolist())
        union = shapely.union_all(pieces[inside])
        point_count = sum(len(_get_points(usable[index])) for index in match)
        is_match = (
            point_count < shapely.get_num_coordinates(part)
            and union.buffer(2 * slack).covers(part)
            and shapely.symmetric_difference(part, union).area <= slack * part.length
        )
        matches.append(match if is_match else set())
    return matches


def _find_pockets(layout: MapLayout) -> Array:
    """Return parts of the free space that are no larger than rounding errors."""
    parts = shapely.get_parts(layout.compute_free())
    area = shapely.area(parts)
    is_pocket: BoolArray = area < min(MAX_CRUMB_M2, area.max(initial=0.0))
    return np.asarray(parts[is_pocket])


def _get_points(primitive: Primitive) -> Array:
    """Return the center of a circle, or the vertices of a wall, (n, 2) m."""
    if isinstance(primitive, CircleObstacle):
        return np.array([primitive.center])
    return np.array(primitive.points)


def _fits_map(primitive: Primitive) -> bool:
    """Return whether a primitive is neither too small, nor too large, nor too far away for a map file."""
    points = _get_points(primitive)
    if isinstance(primitive, CircleObstacle):
        sizes = [primitive.radius]
    else:
        sizes = [primitive.width, np.ptp(points, axis=0).max()]
    has_valid_size = min(sizes) >= MIN_SIZE_M and max(sizes) <= MAX_SIZE_M
    return bool(has_valid_size and np.abs(points).max() <= MAX_COORDINATE_M)
