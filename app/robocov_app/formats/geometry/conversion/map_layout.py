"""The boundary of a free space, and the obstacles between the two."""

from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M, PolygonObstacle, Ring, WallObstacle
from robocov.errors import format_count
from robocov.mapfile.models import MIN_SIZE_M
from robocov_app.formats.foreign_map import Primitive
from robocov_app.formats.geometry.conversion.cleaning import remove_slivers
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.conversion.deviation import Deviation, measure_deviation
from robocov_app.formats.geometry.polygons import (
    buffer_with_mitres,
    fill_holes,
    list_polygons,
    round_polygons,
    tidy_ring,
    to_multipolygon,
    unite,
)
from robocov_app.formats.geometry.simplification.simplify import SimplifiedSpace, simplify_free_space


class MapLayout(NamedTuple):
    """A boundary and the obstacles inside it.

    Attributes
    ----------
    boundary : Polygon, m
        Without holes.
    solid : list of Polygon, m
        Obstacles that are polygons.
    primitives : list of circles and walls
        Obstacles that are circles or walls.
    deviation : Deviation
        Distance by which walls have moved, and area that has changed.
    """

    boundary: Polygon
    solid: list[Polygon]
    primitives: list[Primitive]
    deviation: Deviation

    def compute_free(self) -> MultiPolygon:
        """Return the free space between the obstacles, m, computed as in `Environment`."""
        primitives = [primitive.polygon for primitive in self.primitives]
        blocked = shapely.union_all([*self.solid, *primitives], grid_size=GRID_M)
        return to_multipolygon(shapely.difference(self.boundary, blocked, grid_size=GRID_M))


def build_layout(
    simplified: SimplifiedSpace,
    outer: Polygon | None,
    unsimplified: MultiPolygon,
    original: MultiPolygon,
    conversion: Conversion,
) -> MapLayout:
    """Build the boundary and the obstacles around a simplified free space.

    Parameters
    ----------
    simplified : SimplifiedSpace
    outer : Polygon or None, m
        The boundary. None stands for the outline of the free space.
    unsimplified : MultiPolygon, m
        The free space before simplification.
    original : MultiPolygon, m
        The whole free space in the file.
    conversion : Conversion

    Returns
    -------
    MapLayout
    """
    free = simplified.free
    base = None
    if outer is not None:
        simple = simplify_free_space(
            MultiPolygon([outer]), conversion.tolerance, conversion.foreign.cell, conversion.radius
        )
        base = fill_holes(simple.free)
    elif len(free.geoms) == 1 and conversion.foreign.primitives:
        base = _fill_notches(free.geoms[0], conversion)
    boundary, solid = build_boundary(
        free,
        base,
        hull=conversion.shaping.hull,
        margin=conversion.shaping.margin,
        digits=conversion.digits,
    )
    if outer is not None:
        solid_before = shapely.difference(outer, original)
        solid = remove_slivers(solid, solid_before, boundary, simplified.tolerance)
    return MapLayout(boundary, solid, [], measure_deviation(unsimplified, free))


def build_boundary(
    free: MultiPolygon, base: Polygon | None, *, hull: bool, margin: float, digits: int
) -> tuple[Polygon, list[Polygon]]:
    """Build a boundary around a free space.

    Parameters
    ----------
    free : MultiPolygon, m
    base : Polygon or None, m
        The boundary; its holes are ignored. None stands for the outline of the free space, or for the convex
        hull of several parts.
    hull : bool
        Whether to replace the boundary by its convex hull.
    margin : float, m
        Thickness of the solid margin by which the boundary is extended.
    digits : int
        Number of decimals of coordinates.

    Returns
    -------
    boundary : Polygon, m
    solid : list of Polygon, m
        Solid areas inside the boundary.
    """
    parts = list(free.geoms)
    if base is None and len(parts) == 1 and not hull and margin == 0.0:
        return Polygon(parts[0].exterior), [Polygon(hole) for hole in parts[0].interiors]
    if base is not None:
        # The boundary is rounded first, so that it still coincides with the free space where it did before.
        rounded = fill_holes(round_polygons(base, digits))
        boundary = fill_holes(round_polygons(shapely.union(rounded, free), digits))
    elif len(parts) > 1:
        boundary = free.convex_hull
    else:
        boundary = Polygon(parts[0].exterior)
    if hull:
        boundary = boundary.convex_hull
    if margin > 0.0:
        boundary = fill_holes(boundary.buffer(margin, join_style="mitre", mitre_limit=2.0))
    boundary = fill_holes(round_polygons(boundary, digits))
    if not shapely.covers(boundary, free):  # A sliver of the free space was rounded away.
        boundary = fill_holes(round_polygons(shapely.union(boundary, free), digits))
    return boundary, list_polygons(round_polygons(shapely.difference(boundary, free), digits))


def build_polygon_obstacles(solid: list[Polygon], conversion: Conversion) -> list[PolygonObstacle]:
    """Build obstacles from polygons, the largest first; polygons too small for a map are dropped."""
    large = [part for part in solid if _measure_narrower_side(part) >= MIN_SIZE_M]
    if len(large) < len(solid):
        count = format_count(len(solid) - len(large), "obstacle")
        conversion.dropped.append(f"{count} thinner than {MIN_SIZE_M * 1000:g} mm")
    large.sort(key=lambda part: (-round(part.area, 6), part.bounds))
    obstacles = []
    for part in large:
        outer = normalize_ring(part.exterior, conversion.digits)
        holes = tuple(normalize_ring(hole, conversion.digits) for hole in part.interiors)
        obstacles.append(PolygonObstacle(outer, holes))
    return obstacles


def normalize_ring(ring: BaseGeometry, digits: int) -> Ring:
    """Return the rounded vertices of a ring in a canonical order: counter-clockwise from the leftmost one."""
    points = np.round(shapely.get_coordinates(ring)[:-1], digits) + 0.0
    points = tidy_ring(points, digits)
    if not shapely.is_ccw(ring):
        points = points[::-1]
    leftmost = int(np.lexsort((points[:, 1], points[:, 0]))[0])
    return tuple((float(x), float(y)) for x, y in np.roll(points, -leftmost, axis=0))


def _measure_narrower_side(part: Polygon) -> float:
    x, y, right, top = part.bounds
    return float(min(right - x, top - y))


def _fill_notches(outline: Polygon, conversion: Conversion) -> Polygon:
    """Fill the notches that walls of the file cut into the outline of a free space.

    The walls then become obstacles inside the outline. Only notches inside the convex hull are filled, so
    that the region that robots know stays the same.
    """
    outline = Polygon(outline.exterior)
    walls = [wall for wall in conversion.foreign.primitives if isinstance(wall, WallObstacle)]
    if not walls:
        return outline
    tolerance = conversion.tolerance
    reach = max(wall.width for wall in walls) / 2 + 2 * tolerance
    closed = buffer_with_mitres(buffer_with_mitres(outline, reach), -reach)
    gaps = shapely.difference(closed & outline.convex_hull, outline)
    notches = np.array(list_polygons(gaps), dtype=object)
    covered = shapely.union_all([wall.polygon for wall in walls]).buffer(2 * tolerance)
    notches = notches[shapely.covers(covered, notches)]
    return fill_holes(round_polygons(unite([outline, *notches.tolist()]), conversion.digits))
