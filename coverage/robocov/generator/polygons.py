"""Maps of the kind `polygons`: scattered obstacles, convex polygons, L and U shapes."""

import math

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.environment import DiscStart, Obstacle, PolygonObstacle
from robocov.generator.request import Request

MIX = {"convex": 0.6, "L": 0.2, "U": 0.2}
"""Chances of the shapes. A U that would be too narrow for the gap becomes an L."""

_SPREAD = 0.5, 1.5  # least and largest area of an obstacle, as parts of the mean
_DENSEST = 0.7  # part of the map that obstacles fill at most, with the gaps around them counted half
_MOVES = 12  # obstacles that are moved so that others find a place, before that is given up
_OUTLINES, _PLACES = 8, 128  # outlines that are tried for one obstacle, and places for each of them
_REDRAWS = 8  # draws of a shape that is better than the first, or possible at all
_ROUND = 0.52  # least area of a convex polygon, in circles of the same length; a regular triangle has 0.6


def scattered(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return obstacles that keep `gap` from each other and from the boundary; None if they found no place."""
    areas = np.sort(rng.uniform(*_SPREAD, request.obstacles))[::-1]  # the largest is placed first
    areas *= request.blocked / areas.sum()
    # a disc takes the least
    filled = float((np.pi * (np.sqrt(areas / np.pi) + request.gap / 2.0) ** 2).sum())
    if filled > _DENSEST * (request.width - request.gap) * (request.height - request.gap):
        return None
    clear = shapely.Point(corner.center).buffer(corner.radius)
    shapely.prepare(clear)
    shapes = rng.choice(list(MIX), size=request.obstacles, p=list(MIX.values()))
    waiting = list(zip(shapes.tolist(), areas.tolist(), strict=True))[::-1]
    placed: list[tuple[str, float]] = []
    outlines: list[shapely.Polygon] = []
    moves = _MOVES
    while waiting:
        found = _placed(request, *waiting[-1], np.array(outlines, dtype=object), clear, rng)
        if found is not None:
            outlines.append(found)
            placed.append(waiting.pop())
        elif moves and placed:
            # another one makes room, and looks for a new place after it
            moves -= 1
            other = int(rng.integers(len(placed)))
            waiting.insert(-1, placed.pop(other))
            outlines.pop(other)
        else:
            return None
    return [PolygonObstacle(tuple(outline.exterior.coords[:-1])) for outline in outlines]


def _placed(
    request: Request, shape: str, area: float, others: Array, clear: shapely.Polygon, rng: np.random.Generator
) -> shapely.Polygon | None:
    """Return an outline of a shape at the first of many places that is good, None for none."""
    size, gap = request.size, request.gap
    tree = shapely.STRtree(others)
    for _ in range(_OUTLINES):
        # corners are rounded later: no opening may become narrower than the gap by that
        outline = u_shape(rng, area, gap + 3.0 * request.step) if shape == "U" else None
        if outline is None:
            outline = convex(rng, area) if shape == "convex" else l_shape(rng, area)
        room = size - 2.0 * gap - np.ptp(outline, axis=0)
        if (room < 0.0).any():
            continue
        middle = size / 2.0 + (rng.random((_PLACES, 2)) - 0.5) * room
        candidates = shapely.polygons(request.rounded(middle[:, None] + outline))
        first, last = np.split(shapely.bounds(candidates), 2, axis=1)
        good = shapely.disjoint(candidates, clear) & shapely.is_valid(candidates)
        good &= ((first >= gap - 1e-9) & (last <= size - gap + 1e-9)).all(axis=1)
        one, other = tree.query(shapely.box(*(first - gap).T, *(last + gap).T))
        good[one[shapely.distance(candidates[one], others[other]) < gap]] = False
        if good.any():
            return candidates[int(good.argmax())]
    return None


def convex(rng: np.random.Generator, area: float) -> Array:
    """Return a convex polygon of 3 to 7 vertices on an ellipse, no needle, (k, 2) m."""
    for _ in range(_REDRAWS):
        count = int(rng.choice([3, 4, 5, 6, 7], p=[0.1, 0.25, 0.3, 0.2, 0.15]))
        between = 0.4 + rng.random(count)
        angle = np.cumsum(between) * (2.0 * np.pi / between.sum())
        stretch = rng.uniform(1.0, 1.7)
        outline = np.column_stack([stretch * np.cos(angle), np.sin(angle)])
        polygon = shapely.Polygon(outline)
        if 4.0 * math.pi * polygon.area >= _ROUND * polygon.length**2:
            break
    return _fitted(outline, area, rng)


def l_shape(rng: np.random.Generator, area: float) -> Array:
    """Return an L of two arms, 0.3 to 0.5 of its sides thick, (6, 2) m."""
    long = rng.uniform(1.0, 1.5)
    thick, top = rng.uniform(0.3, 0.5, 2)
    right = long * thick
    outline = [(0.0, 0.0), (long, 0.0), (long, top), (right, top), (right, 1.0), (0.0, 1.0)]
    return _fitted(np.array(outline), area, rng)


def u_shape(rng: np.random.Generator, area: float, opening: float) -> Array | None:
    """Return a U that is open by at least `opening` (m), (8, 2) m; None if that is too much for its area."""
    for _ in range(_REDRAWS):
        wide = rng.uniform(1.0, 1.6)
        left, right = rng.uniform(0.2, 0.3, 2)
        base = rng.uniform(0.22, 0.35)
        # arms may differ in length
        other = rng.uniform(0.7, 1.0)
        arms = (0.0, 0.0), (wide, 0.0), (wide, other), (wide - right, other)
        outline = np.array([*arms, (wide - right, base), (left, base), (left, 1.0), (0.0, 1.0)])
        scale = math.sqrt(area / shapely.Polygon(outline).area)
        if (wide - left - right) * scale >= opening:
            return _fitted(outline, area, rng)
    return None


def _fitted(outline: Array, area: float, rng: np.random.Generator) -> Array:
    """Return an outline scaled to its area, turned by some angle, its box around the origin."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    outline = outline @ turn * math.sqrt(area / shapely.Polygon(outline).area)
    return np.asarray(outline - (outline.min(axis=0) + outline.max(axis=0)) / 2.0)
