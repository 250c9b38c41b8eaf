"""Circles and walls of a drawing that stay what they are, instead of the polygons that they cover."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

import numpy as np
import shapely
from shapely import Polygon, STRtree

from robocov.environment import CircleObstacle, Obstacle, PolygonObstacle, Ring, WallObstacle
from robocov.mapfile.models import FARTHEST, LARGEST, SMALLEST
from robocov_app.formats.geometry.passages import rooms

Primitive: TypeAlias = CircleObstacle | WallObstacle
_Obstacle = TypeVar("_Obstacle", bound=Obstacle)

MOST = 5_000
"""Circles and walls of a drawing that stay such; with more, all become polygons: to compare takes seconds."""


def with_primitives(
    solid: Sequence[Polygon],
    primitives: Iterable[Primitive],
    boundary: Polygon,
    tolerance: float,
    digits: int,
    places: int,
    radius: float,
) -> tuple[list[Primitive], list[Polygon]]:
    """Return the primitives that make up polygons of `solid`, in their order, and the polygons that stay.

    A polygon goes where the primitives on it cover the same inside the boundary: neither reaches further than
    twice the tolerance beyond the other, as corners may, their areas differ by no more than the tolerance all
    along the outline, and the primitives have fewer points. Those of several primitives stay, or all of them,
    where a robot of that radius would have more than so many `places`, apart from each other.

    >>> wall = WallObstacle(((1.0, 2.0), (3.0, 2.0)), 0.2)
    >>> desk, drawn = shapely.box(5, 1, 6, 2), shapely.box(1, 1.9, 3, 2.1)
    >>> kept, rest = with_primitives([drawn, desk], [wall], shapely.box(0, 0, 8, 4), 0.02, 4, 1, 0.1)
    >>> kept == [wall], rest == [desk]
    (True, True)
    """
    rounded = {with_numbers(each, lambda value: round(value, digits) + 0.0): each for each in primitives}
    usable = [primitive for primitive in rounded if _fits(primitive)]
    if not usable or len(usable) > MOST:
        return [], list(solid)
    # of another radius, however near, a circle may be drawn with another number of sides
    covered = np.array([rounded[primitive].polygon for primitive in usable], dtype=object)
    shapely.prepare(boundary)
    outside = ~shapely.covers(boundary, covered)
    covered[outside] = shapely.intersection(covered[outside], boundary)
    piece, source = shapely.get_parts(covered, return_index=True)
    tree = STRtree(piece)
    hair = 10.0**-digits
    made: list[set[int]] = []
    for part in solid:
        found = np.sort(tree.query(part.buffer(2 * (tolerance + hair)), "covers"))
        own = set(source[found].tolist())
        union = shapely.union_all(piece[found])
        same = (
            sum(len(_points(usable[k])) for k in own) < shapely.get_num_coordinates(part)
            and union.buffer(2 * (tolerance + hair)).covers(part)
            and shapely.symmetric_difference(part, union).area <= (tolerance + hair) * part.length
        )
        made.append(own if same else set())
    # several may have a gap among them that was filled
    for most in (len(usable), 1):
        kept = [usable[k] for k in sorted(set().union(*(own for own in made if len(own) <= most)))]
        rest = [part for part, own in zip(solid, made, strict=True) if not 0 < len(own) <= most]
        obstacles = [*rest, *(primitive.polygon for primitive in kept)]
        if len(rooms(shapely.difference(boundary, shapely.union_all(obstacles)), radius)) <= places:
            return kept, rest
    return [], list(solid)


def with_numbers(obstacle: _Obstacle, number: Callable[[float], float]) -> _Obstacle:
    """Return an obstacle with other numbers for all that it has."""

    def ring(points: Ring) -> Ring:
        return tuple((number(x), number(y)) for x, y in points)

    if isinstance(obstacle, CircleObstacle):
        return replace(obstacle, center=ring((obstacle.center,))[0], radius=number(obstacle.radius))
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=ring(obstacle.points), width=number(obstacle.width))
    assert isinstance(obstacle, PolygonObstacle)
    return replace(obstacle, vertices=ring(obstacle.vertices), holes=tuple(map(ring, obstacle.holes)))


def _points(primitive: Primitive) -> np.ndarray:
    return np.array([primitive.center] if isinstance(primitive, CircleObstacle) else primitive.points)


def _fits(primitive: Primitive) -> bool:
    points = _points(primitive)
    if isinstance(primitive, CircleObstacle):
        sizes = [primitive.radius]
    else:
        sizes = [primitive.width, np.ptp(points, axis=0).max()]
    return bool(min(sizes) >= SMALLEST and max(sizes) <= LARGEST and np.abs(points).max() <= FARTHEST)
