"""Walls and obstacles as convex pieces, the only polygons that the physics engine supports.

pymunk silently replaces a concave polygon by its convex hull. Therefore everything that is not free is
triangulated, and the triangles are merged into larger pieces as long as these stay convex (Hertel and
Mehlhorn 1983: at most four times as many pieces as in an optimal decomposition).
"""

import weakref
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, TypeAlias

import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, freeze
from robocov.environment import Environment, ObstaclePath, Point

Loop: TypeAlias = list[Point]
"""Corners of a convex polygon, counter-clockwise, (x, y) m."""

FRAME_WIDTH_M = 2.0
"""Thickness of the wall around the region."""

_pieces_by_environment: dict[int, tuple[Array, ...]] = {}
"""Pieces of the static environments that are in use, by `id`."""


class Mover(NamedTuple):
    """A moving obstacle.

    Attributes
    ----------
    pieces : tuple of (k, 2) arrays, m
        Convex polygons at time zero.
    path : ObstaclePath
    """

    pieces: tuple[Array, ...]
    path: ObstaclePath


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Everything that is solid except for the working robots.

    Attributes
    ----------
    walls : tuple of (k, 2) arrays, m
        Convex polygons that tile everything that is not free; see `build_solid_pieces`.
    movers : tuple of Mover
        Moving obstacles.
    failed_robots : (w, 3) array or None, m
        Center x, y and radius of robots that have failed.
    """

    walls: tuple[Array, ...]
    movers: tuple[Mover, ...] = ()
    failed_robots: Array | None = None

    @property
    def max_speed(self) -> float:
        """Largest speed of a moving obstacle, m/s."""
        return max((mover.path.speed for mover in self.movers), default=0.0)


def build_obstacles(environment: Environment) -> Obstacles:
    """Build the walls and the moving obstacles of an environment.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    Obstacles
    """
    return Obstacles(build_solid_pieces(environment), build_movers(environment))


def build_solid_pieces(environment: Environment) -> tuple[Array, ...]:
    """Build convex polygons that tile the static obstacles and the surroundings of the map.

    The surroundings extend `FRAME_WIDTH_M` beyond the bounding box of the region.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    tuple of (k, 2) arrays, m
        Counter-clockwise. Computed only once for each environment.
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


def build_movers(environment: Environment) -> tuple[Mover, ...]:
    """Build the moving obstacles of an environment.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    tuple of Mover
        In the order of the obstacles.
    """
    return tuple(
        Mover(split_into_convex_pieces(obstacle.polygon), obstacle.path)
        for obstacle in environment.obstacles
        if obstacle.path is not None
    )


def split_into_convex_pieces(geometry: BaseGeometry) -> tuple[Array, ...]:
    """Split the polygons of a geometry into convex ones.

    Parameters
    ----------
    geometry : geometry, m

    Returns
    -------
    tuple of (k, 2) arrays, m
        Counter-clockwise polygons that tile those of the geometry.
    """
    shapes = shapely.get_parts(geometry)
    polygons = [shape for shape in shapes if shape.geom_type == "Polygon" and shape.area > 0.0]
    loops = chain.from_iterable(_merge_loops(_triangulate(polygon)) for polygon in polygons)
    return tuple(freeze(loop) for loop in loops)


def _triangulate(polygon: BaseGeometry) -> list[Loop]:
    """Return counter-clockwise triangles that tile a polygon."""
    rings = shapely.get_coordinates(shapely.constrained_delaunay_triangles(polygon)).reshape(-1, 4, 2)
    triangles: list[Loop] = []
    for corners in rings[:, :3].tolist():
        a, b, c = map(tuple, corners)
        doubled_area = _compute_doubled_area(a, b, c)
        if doubled_area > 0.0:
            triangles.append([a, b, c])
        elif doubled_area < 0.0:
            triangles.append([a, c, b])
    return triangles


def _merge_loops(loops: list[Loop]) -> list[Loop]:
    """Merge triangles across their common edges as long as the result is convex.

    An edge is a pair of points. Since all loops are counter-clockwise, the edge from a to b of one piece is
    the edge from b to a of the piece on its other side.
    """
    pieces = dict(enumerate(loops))
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
        second_loop = pieces.pop(second)
        for k, corner in enumerate(second_loop):
            piece_of_edge[second_loop[k - 1], corner] = first
        del piece_of_edge[a, b]
        del piece_of_edge[b, a]
        pieces[first] = union
    return list(pieces.values())


def _unite_if_convex(first: Loop, second: Loop, a: Point, b: Point) -> Loop | None:
    """Return the union of two loops across the edge a→b of `first`, or None if it is not convex."""
    # The corners of the first loop from b to a, and those of the second one from a to b. Chained together,
    # they go once around the union.
    index_of_b = first.index(b)
    index_of_a = second.index(a)
    b_to_a = first[index_of_b:] + first[:index_of_b]
    a_to_b = second[index_of_a:] + second[:index_of_a]
    # The union can only be concave where the loops meet: at a, between its two neighbors, and at b.
    is_convex_at_a = _compute_doubled_area(b_to_a[-2], a, a_to_b[1]) > 0.0
    is_convex_at_b = _compute_doubled_area(a_to_b[-2], b, b_to_a[1]) > 0.0
    if is_convex_at_a and is_convex_at_b:
        return b_to_a + a_to_b[1:-1]
    return None


def _compute_doubled_area(a: Point, b: Point, c: Point) -> float:
    """Return twice the signed area of a triangle, m²; positive if it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
