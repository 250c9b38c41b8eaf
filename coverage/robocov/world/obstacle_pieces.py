"""Walls and obstacles as convex pieces, the only polygons that the physics engine supports.

Pymunk silently replaces a concave polygon by its convex hull. Therefore everything that is static and not
free is triangulated, and the triangles are merged into larger pieces as long as these are convex (Hertel and
Mehlhorn, 1983: at most four times as many pieces as in an optimal decomposition). Moving obstacles are split
in the same way, each on its own.
"""

import weakref
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, TypeAlias

import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import copy_read_only
from robocov.environment import Environment, ObstaclePath, Point
from robocov.typing import FloatArray

Ring: TypeAlias = list[Point]
"""Corners of a convex polygon, counter-clockwise, (x, y) m."""

FRAME_WIDTH_M = 2.0
"""Thickness of the solid frame around the region."""

_pieces_by_environment: dict[int, tuple[FloatArray, ...]] = {}
"""Pieces of each static environment that is in use, by the `id` of the environment."""


class MovingObstacle(NamedTuple):
    """A moving obstacle.

    Attributes
    ----------
    pieces : tuple of (k, 2) arrays, m
        Convex polygons that tile the obstacle at time zero.
    path : ObstaclePath
        Path along which the obstacle moves.
    """

    pieces: tuple[FloatArray, ...]
    path: ObstaclePath


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Everything that is solid except for the working robots.

    Attributes
    ----------
    walls : tuple of (k, 2) arrays, m
        Convex polygons that tile the static obstacles and the surroundings of the map; see
        `build_solid_pieces`.
    moving_obstacles : tuple of MovingObstacle
        Moving obstacles.
    failed_robots : (f, 3) array or None, m
        Center x, y and radius of robots that have failed.
    """

    walls: tuple[FloatArray, ...]
    moving_obstacles: tuple[MovingObstacle, ...] = ()
    failed_robots: FloatArray | None = None

    @property
    def max_speed(self) -> float:
        """Maximum speed of a moving obstacle, m/s."""
        return max((obstacle.path.speed for obstacle in self.moving_obstacles), default=0.0)


def build_obstacles(environment: Environment) -> Obstacles:
    """Build the walls and the moving obstacles of an environment.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    Obstacles
        Obstacles without failed robots.
    """
    return Obstacles(build_solid_pieces(environment), build_moving_obstacles(environment))


def build_solid_pieces(environment: Environment) -> tuple[FloatArray, ...]:
    """Build convex polygons that tile the static obstacles and the surroundings of the map.

    The surroundings extend `FRAME_WIDTH_M` beyond the bounding box of the region.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    tuple of (k, 2) arrays, m
        Counter-clockwise polygons. They are computed only once for each environment.
    """
    static = environment.static
    pieces = _pieces_by_environment.get(id(static))
    if pieces is None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        frame = shapely.box(
            low_x - FRAME_WIDTH_M,
            low_y - FRAME_WIDTH_M,
            high_x + FRAME_WIDTH_M,
            high_y + FRAME_WIDTH_M,
        )
        pieces = split_into_convex_pieces(shapely.difference(frame, static.free))
        _pieces_by_environment[id(static)] = pieces
        weakref.finalize(static, _pieces_by_environment.pop, id(static), None)
    return pieces


def build_moving_obstacles(environment: Environment) -> tuple[MovingObstacle, ...]:
    """Build the moving obstacles of an environment.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    tuple of MovingObstacle
        Moving obstacles, in the order of the obstacles in the map.
    """
    return tuple(
        MovingObstacle(split_into_convex_pieces(obstacle.polygon), obstacle.path)
        for obstacle in environment.obstacles
        if obstacle.path is not None
    )


def split_into_convex_pieces(geometry: BaseGeometry) -> tuple[FloatArray, ...]:
    """Split the polygons of a geometry into convex polygons.

    Parameters
    ----------
    geometry : geometry, m
        Geometry of any type. Lines and points are ignored.

    Returns
    -------
    tuple of (k, 2) arrays, m
        Counter-clockwise polygons that tile those of the geometry.
    """
    shapes = shapely.get_parts(geometry)
    polygons = [shape for shape in shapes if shape.geom_type == "Polygon" and shape.area > 0.0]
    rings = chain.from_iterable(_merge_rings(_triangulate(polygon)) for polygon in polygons)
    return tuple(copy_read_only(ring) for ring in rings)


def _triangulate(polygon: BaseGeometry) -> list[Ring]:
    """Triangulate a polygon; return counter-clockwise triangles, without those of area zero."""
    rings = shapely.get_coordinates(shapely.constrained_delaunay_triangles(polygon)).reshape(-1, 4, 2)
    triangles: list[Ring] = []
    for corners in rings[:, :3].tolist():
        a, b, c = map(tuple, corners)
        doubled_area = _compute_doubled_area(a, b, c)
        if doubled_area > 0.0:
            triangles.append([a, b, c])
        elif doubled_area < 0.0:
            triangles.append([a, c, b])
    return triangles


def _merge_rings(rings: list[Ring]) -> list[Ring]:
    """Merge triangles across their common edges, as long as the results are convex.

    An edge is a pair of points. All rings are counter-clockwise. If one piece has the edge from a to b, the
    piece on the other side of this edge therefore has the edge from b to a.
    """
    pieces = dict(enumerate(rings))
    piece_of_edge: dict[tuple[Point, Point], int] = {}
    for number, (a, b, c) in pieces.items():
        piece_of_edge[a, b] = number
        piece_of_edge[b, c] = number
        piece_of_edge[c, a] = number
    for a, b in list(piece_of_edge):
        first = piece_of_edge.get((a, b))
        second = piece_of_edge.get((b, a))
        if first is None or second is None or first == second:
            continue
        union = _unite_if_convex(pieces[first], pieces[second], a, b)
        if union is None:
            continue
        # The edges of the second piece now belong to the first one, except for the common edge.
        second_ring = pieces.pop(second)
        for k, corner in enumerate(second_ring):
            piece_of_edge[second_ring[k - 1], corner] = first
        del piece_of_edge[a, b]
        del piece_of_edge[b, a]
        pieces[first] = union
    return list(pieces.values())


def _unite_if_convex(first: Ring, second: Ring, a: Point, b: Point) -> Ring | None:
    """Unite two rings across the edge from a to b of the first; return None if the union is not convex."""
    # The corners of the first ring from b to a, followed by the corners of the second ring from a to b, go
    # once around the union.
    index_of_b = first.index(b)
    index_of_a = second.index(a)
    b_to_a = first[index_of_b:] + first[:index_of_b]
    a_to_b = second[index_of_a:] + second[:index_of_a]
    # The union can only be concave where the rings meet, at a and at b. Test the turn there.
    is_convex_at_a = _compute_doubled_area(b_to_a[-2], a, a_to_b[1]) > 0.0
    is_convex_at_b = _compute_doubled_area(a_to_b[-2], b, b_to_a[1]) > 0.0
    if is_convex_at_a and is_convex_at_b:
        return b_to_a + a_to_b[1:-1]
    return None


def _compute_doubled_area(a: Point, b: Point, c: Point) -> float:
    """Return twice the signed area of a triangle, m²; positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
