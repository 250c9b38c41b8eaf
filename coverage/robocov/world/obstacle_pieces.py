"""The solid part of the world as convex pieces, which is what the physics engine can hold.

pymunk silently replaces a concave polygon by its hull; therefore everything that is not free is
triangulated and the triangles are merged to larger convex pieces as long as they stay convex
(Hertel and Mehlhorn 1983: at most four times as many pieces as an optimal decomposition).
"""

from typing import NamedTuple, TypeAlias

import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, freeze
from robocov.environment import Environment, ObstaclePath

Corner: TypeAlias = tuple[float, float]
Loop: TypeAlias = list[Corner]

FRAME = 2.0
"""Thickness in metres of the wall that stands around the region."""


def build_solid_pieces(environment: Environment) -> tuple[Array, ...]:
    """Return convex counter-clockwise polygons, (k, 2) m each, that tile all that is not free.

    That are obstacles that stand still, the outside of the boundary, and a `FRAME` around the region.
    """
    static = environment.static
    # kept as a cached property would, which an environment, that knows of no engine, cannot have
    pieces: tuple[Array, ...] | None = vars(static).get("_solid_pieces")
    if pieces is None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        frame = shapely.box(low_x - FRAME, low_y - FRAME, high_x + FRAME, high_y + FRAME)
        pieces = vars(static)["_solid_pieces"] = split_into_convex_pieces(
            shapely.difference(frame, static.free)
        )
    return pieces


class Mover(NamedTuple):
    """An obstacle that moves: convex polygons, (k, 2) m each, where it is at time zero, and its path."""

    pieces: tuple[Array, ...]
    path: ObstaclePath


def build_movers(environment: Environment) -> tuple[Mover, ...]:
    """Return the obstacles that move."""
    moving = ((shape.polygon, shape.path) for shape in environment.obstacles)
    return tuple(
        Mover(split_into_convex_pieces(polygon), path) for polygon, path in moving if path is not None
    )


def split_into_convex_pieces(geometry: BaseGeometry) -> tuple[Array, ...]:
    """Return convex counter-clockwise polygons, (k, 2) m each, that tile the polygons of `geometry`."""
    parts = shapely.get_parts(geometry)
    polygons = (part for part in parts if part.geom_type == "Polygon" and part.area > 0.0)
    return tuple(freeze(loop) for polygon in polygons for loop in _merged(_triangles(polygon)))


def _triangles(polygon: BaseGeometry) -> list[Loop]:
    triangles = shapely.get_coordinates(shapely.constrained_delaunay_triangles(polygon)).reshape(-1, 4, 2)
    loops: list[Loop] = [[(x, y) for x, y in corners] for corners in triangles[:, :3].tolist()]
    turned = ((loop, _turn(*loop)) for loop in loops)
    return [loop if turn > 0.0 else [loop[0], loop[2], loop[1]] for loop, turn in turned if turn != 0.0]


def _merged(loops: list[Loop]) -> list[Loop]:
    """Remove the diagonals between convex loops as long as what remains is convex."""
    pieces: dict[int, Loop] = dict(enumerate(loops))
    owner = {(loop[k - 1], loop[k]): n for n, loop in pieces.items() for k in (1, 2, 0)}
    for a, b in list(owner):
        first, second = owner.get((a, b)), owner.get((b, a))
        if first is None or second is None or first == second:
            continue
        joined = _joined(pieces[first], pieces[second], a, b)
        if joined is not None:
            for k, corner in enumerate(pieces[second]):
                owner[pieces[second][k - 1], corner] = first
            del pieces[second], owner[a, b], owner[b, a]
            pieces[first] = joined
    return list(pieces.values())


def _joined(first: Loop, second: Loop, a: Corner, b: Corner) -> Loop | None:
    """Return the union of two loops across the edge a→b of `first`, or None when it is not convex."""
    start, other = first.index(b), second.index(a)
    around = first[start:] + first[:start]  # b … a
    beyond = second[other:] + second[:other]  # a … b
    joined = around + beyond[1:-1]
    convex = _turn(around[-2], a, beyond[1]) > 0.0 and _turn(beyond[-2], b, around[1]) > 0.0
    return joined if convex else None


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Return twice the signed area of the triangle; positive when counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
