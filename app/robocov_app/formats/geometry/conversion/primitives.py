"""Circles and walls in a file that stay circles and walls instead of becoming polygons."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.environment import (
    MAX_SAGITTA_M,
    CircleObstacle,
    Obstacle,
    PolygonObstacle,
    Ring,
    WallObstacle,
)
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.foreign_map import Primitive
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.conversion.deviation import find_moved_walls, measure_deviation
from robocov_app.formats.geometry.conversion.map_layout import MapLayout
from robocov_app.formats.geometry.conversion.starts import find_center_regions
from robocov_app.formats.geometry.conversion.validity import MAX_CRUMB_M2
from robocov_app.formats.geometry.polygons import round_polygons
from robocov_app.formats.geometry.simplification.simplify import SimplifiedSpace

MAX_PRIMITIVES = 5_000
"""With more circles and walls, all become polygons, because comparing them would take seconds."""
_MAX_POCKET_DISTANCE_M = 1e-3
"""Primitives within this distance of a pocket are next to it."""
_MAX_ROUNDS = 5
"""Number of attempts to find primitives that leave no pockets."""
_Obstacle = TypeVar("_Obstacle", bound=Obstacle)


def restore_primitives(
    layout: MapLayout, simplified: SimplifiedSpace, unsimplified: MultiPolygon, conversion: Conversion
) -> MapLayout:
    """Replace polygons of a layout by the circles and walls of which they consist.

    A polygon stays if its primitives would leave a pocket next to them: an enclosed piece of free space that
    is tiny, or that was solid. It also stays if walls would have moved by more than the tolerance.

    Parameters
    ----------
    layout : MapLayout
    simplified : SimplifiedSpace
        The simplified free space, which the layout surrounds.
    unsimplified : MultiPolygon, m
        The free space before simplification.
    conversion : Conversion

    Returns
    -------
    MapLayout
    """
    max_regions = max(
        len(find_center_regions(space, conversion.radius)) for space in (unsimplified, simplified.free)
    )
    free_before = layout.compute_free()
    rejected: frozenset[Primitive] = frozenset()
    for _ in range(_MAX_ROUNDS):
        candidate = _match_primitives(layout, simplified.tolerance, max_regions, rejected, conversion)
        if not candidate.primitives:
            return layout
        pockets = _find_pockets(candidate, free_before)
        next_to_pockets = {
            primitive
            for primitive in candidate.primitives
            if (shapely.distance(primitive.polygon, pockets) < _MAX_POCKET_DISTANCE_M).any()
        }
        if next_to_pockets:
            rejected |= next_to_pockets
            continue
        # Removes the vertices where the boundary met polygons that are gone now.
        boundary = round_polygons(candidate.boundary.simplify(0.0), conversion.digits).geoms[0]
        deviation = measure_deviation(unsimplified, candidate.compute_free())
        # A circle and its polygon may differ by the sagitta of the polygon's sides.
        limit = conversion.tolerance + conversion.grid + MAX_SAGITTA_M
        limit = max(limit, layout.deviation.distance)
        if deviation.distance > limit:
            moved = find_moved_walls(unsimplified, candidate.compute_free(), limit)
            nearest = STRtree([primitive.polygon for primitive in candidate.primitives]).nearest(moved)
            rejected |= {candidate.primitives[index] for index in nearest}
            continue
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
    max_regions: int,
    rejected: frozenset[Primitive],
    conversion: Conversion,
) -> MapLayout:
    """Return a layout in which primitives replace the polygons that consist of them.

    The replacement must not divide the free space into more than `max_regions` regions between which a robot
    cannot move. If it does, only polygons that are a single primitive are replaced; if that does not help
    either, the layout is returned unchanged. Primitives in `rejected` are not used.
    """
    rounded_primitives = {
        transform_numbers(primitive, lambda value: round(value, conversion.digits) + 0.0): primitive
        for primitive in conversion.foreign.primitives
    }
    usable = [shape for shape in rounded_primitives if _fits_map(shape) and shape not in rejected]
    if not usable or len(usable) > MAX_PRIMITIVES:
        return layout
    # Polygons are compared with the exact primitives: a rounded circle may have another number of sides.
    exact = [rounded_primitives[primitive] for primitive in usable]
    slack = tolerance + conversion.grid
    matches = _find_matches(layout, exact, usable, slack)
    # Second attempt: only polygons that are one primitive, because gaps between several may have been filled.
    for max_count in (len(usable), 1):
        used = {index for match in matches if len(match) <= max_count for index in match}
        primitives = [usable[index] for index in sorted(used)]
        solid = [
            part for part, match in zip(layout.solid, matches, strict=True) if not 0 < len(match) <= max_count
        ]
        candidate = layout._replace(solid=solid, primitives=primitives)
        if len(find_center_regions(candidate.compute_free(), conversion.radius)) <= max_regions:
            return candidate
    return layout


def _find_matches(
    layout: MapLayout, exact: list[Primitive], usable: list[Primitive], slack: float
) -> list[set[int]]:
    """Return, for each polygon of a layout, the indices of the primitives that it consists of.

    The set is empty if the polygon does not consist of primitives. Inside the boundary, polygon and
    primitives must cover the same area: neither extends beyond the other by more than twice the slack, as
    may happen at corners, and the area in only one of them is at most the slack times the outline's length.
    The primitives must have fewer points than the polygon.
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


def _find_pockets(layout: MapLayout, free_before: MultiPolygon) -> FloatArray:
    """Return the parts of the free space that are due to rounding, or that mostly were solid before."""
    parts = shapely.get_parts(layout.compute_free())
    area = shapely.area(parts)
    is_pocket: BoolArray = area < min(MAX_CRUMB_M2, area.max(initial=0.0))
    # The largest part is the free space of the map itself.
    others = np.flatnonzero(~is_pocket & (area < area.max(initial=0.0)))
    area_before = shapely.area(shapely.intersection(parts[others], free_before))
    is_pocket[others] = area_before < area[others] / 2
    return np.asarray(parts[is_pocket])


def _get_points(primitive: Primitive) -> FloatArray:
    """Return the center of a circle, or the vertices of a wall, (n, 2) m."""
    if isinstance(primitive, CircleObstacle):
        return np.array([primitive.center])
    return np.array(primitive.points)


def _fits_map(primitive: Primitive) -> bool:
    """Return whether the size and the position of a primitive are within the limits of map files."""
    points = _get_points(primitive)
    if isinstance(primitive, CircleObstacle):
        sizes = [primitive.radius]
    else:
        sizes = [primitive.width, np.ptp(points, axis=0).max()]
    has_valid_size = min(sizes) >= MIN_SIZE_M and max(sizes) <= MAX_SIZE_M
    return bool(has_valid_size and np.abs(points).max() <= MAX_COORDINATE_M)
