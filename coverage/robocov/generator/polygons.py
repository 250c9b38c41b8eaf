"""Maps of the kind `polygons`: scattered obstacles of all shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.environment import PolygonObstacle
from robocov.generator.outlines import convex, l_shape, u_shape

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from robocov.arrays import Array, BoolArray
    from robocov.environment import Obstacle
    from robocov.environment.starts import DiscStart
    from robocov.generator.request import Request

MIX = {"convex": 0.6, "L": 0.2, "U": 0.2}
"""Chances of the shapes. A U that would be too narrow for the gap becomes an L."""

_SPREAD = 0.5, 1.5
"""Least and largest area of an obstacle, as parts of the mean."""

_DENSEST = 0.7
"""Part of the map that obstacles fill at most, with the gaps around them counted half: more find no place."""

_MOVES = 12
"""Obstacles that are moved so that others find a place, before that is given up."""

_OUTLINES, _PLACES = 8, 128
"""Outlines that are tried for one obstacle, and places for each of them."""


def scattered(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return obstacles that keep `gap` from each other and from the boundary; None if they found no place.

    Their areas differ by up to a factor of three; the largest is placed first.
    """
    areas = np.sort(rng.uniform(*_SPREAD, request.obstacles))[::-1]
    areas *= request.blocked / areas.sum()
    # a disc takes the least
    filled = float((np.pi * (np.sqrt(areas / np.pi) + request.gap / 2.0) ** 2).sum())
    if filled > _DENSEST * (request.width - request.gap) * (request.height - request.gap):
        return None
    clear = shapely.Point(corner.center).buffer(corner.radius)
    shapes = rng.choice(list(MIX), size=request.obstacles, p=list(MIX.values()))
    waiting = list(zip(shapes.tolist(), areas.tolist(), strict=True))[::-1]
    placed: list[tuple[shapely.Polygon, tuple[str, float]]] = []
    moves = _MOVES
    while waiting:
        found = _placed(request, *waiting[-1], [outline for outline, _ in placed], clear, rng)
        if found is not None:
            placed.append((found, waiting.pop()))
        elif moves and placed:
            # another one makes room, and looks for a new place after it
            moves -= 1
            waiting.insert(-1, placed.pop(int(rng.integers(len(placed))))[1])
        else:
            return None
    return [PolygonObstacle(tuple(outline.exterior.coords[:-1])) for outline, _ in placed]


def _placed(
    request: Request,
    shape: str,
    area: float,
    others: list[shapely.Polygon],
    clear: shapely.Polygon,
    rng: np.random.Generator,
) -> shapely.Polygon | None:
    """Return an outline of a shape at the first of many places that is good, None for none."""
    size = np.array([request.width, request.height])
    taken = shapely.MultiPolygon(others)
    shapely.prepare(clear)
    for _ in range(_OUTLINES):
        outline = _outline(request, shape, area, rng)
        room = size - 2.0 * request.gap - np.ptp(outline, axis=0)
        if (room < 0.0).any():
            continue
        middle = size / 2.0 + (rng.random((_PLACES, 2)) - 0.5) * room
        candidates = shapely.polygons(request.rounded(middle[:, None] + outline))
        good = shapely.disjoint(candidates, clear) & shapely.is_valid(candidates)
        good &= _inside(candidates, request)
        if others:
            good &= shapely.distance(candidates, taken) >= request.gap
        if good.any():
            return candidates[int(good.argmax())]
    return None


def _outline(request: Request, shape: str, area: float, rng: np.random.Generator) -> Array:
    if shape == "convex":
        return convex(rng, area)
    # corners are rounded later: no opening may become narrower than the gap by that
    outline = u_shape(rng, area, request.gap + 3.0 * request.step) if shape == "U" else None
    return l_shape(rng, area) if outline is None else outline


def _inside(candidates: NDArray[np.object_], request: Request) -> BoolArray:
    """Return which candidates keep their distance from the boundary."""
    low_x, low_y, high_x, high_y = shapely.bounds(candidates).T
    gap = request.gap - 1e-9
    good = (low_x >= gap) & (low_y >= gap)
    return np.asarray(good & (high_x <= request.width - gap) & (high_y <= request.height - gap))
