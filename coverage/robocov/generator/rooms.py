"""Maps of the kind `rooms`: a building with doors and furniture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.environment import CircleObstacle, PolygonObstacle
from robocov.generator.floorplan import Box, floor_plan

if TYPE_CHECKING:
    from robocov.environment import Obstacle
    from robocov.environment.starts import DiscStart
    from robocov.generator.floorplan import FloorPlan
    from robocov.generator.request import Request

_WALLS = 0.3, 0.5, 0.9
"""Part of the blocked area that walls take: the least, the most, and the most where rooms are small."""

_SMALL, _SMALLEST = 6.0, 3.0
"""Sides of usual rooms that are small, and very small, in gaps: furniture finds less and less room there."""

_LENGTH = 1.5
"""Length of the walls of a room, about, in its sides: without doors, each wall counted half for each room."""

_THICKEST = 0.06
"""Largest thickness of walls, in sides of a usual room."""

_PIECES = 2.2
"""Pieces of furniture in a room, on average."""

_TRIES = 32
"""Places that are tried for one piece, and pieces in a row that find none before that is given up."""

_SHRINKING, _SHRUNK = 0.92, 0.2
"""Each piece that finds no place makes the next smaller by this factor, down to the smallest."""

_DENSEST = 0.35
"""Part of the rooms that furniture fills at most: more finds no place."""

_ENOUGH = 0.001
"""What is left to be blocked, as a part of the map, which is too little for a piece."""


def building(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return walls and furniture; None if there is no room for so much of it.

    Furniture stands against walls, or at least `gap` away from them; from doors and other furniture
    it keeps that in any case.
    """
    thickness = _thickness(request, rng)
    plan = floor_plan(request, thickness, rng)
    if plan is None:
        return None
    walls: list[Obstacle] = [*plan.solid(thickness)]
    whole = shapely.box(0.0, 0.0, request.width, request.height)
    built = shapely.union_all([wall.polygon for wall in walls]).intersection(whole).area if walls else 0.0
    furniture = _furniture(request, corner, plan, thickness, request.blocked - built, rng)
    return None if furniture is None else [*walls, *furniture]


def _thickness(request: Request, rng: np.random.Generator) -> float:
    """Return how thick walls are, m, so that their faces have rounded coordinates."""
    least, most, of_small = _WALLS
    small = min(max((_SMALL - request.unit / request.gap) / (_SMALL - _SMALLEST), 0.0), 1.0)
    part = rng.uniform(least, most + (of_small - most) * small)
    half = min(part * request.area / _LENGTH, _THICKEST) * request.unit / 2.0
    return 2.0 * max(request.floor(half), request.step)


def _furniture(
    request: Request,
    corner: DiscStart,
    plan: FloorPlan,
    thickness: float,
    area: float,
    rng: np.random.Generator,
) -> list[Obstacle] | None:
    """Return furniture that blocks so much, None if it finds no place."""
    enough = _ENOUGH * request.width * request.height
    if area < -enough:
        return None
    clear = shapely.Point(corner.center).buffer(corner.radius)
    inner = [_inner(request, box, thickness) for box in plan.rooms]
    sizes = np.array([box.sides[0] * box.sides[1] for box in inner])
    kept: list[list[shapely.Polygon]] = [
        [door.box(thickness) for door in plan.doors if k in door.rooms] for k in range(len(inner))
    ]
    if area > _DENSEST * sizes.sum():
        return None
    # pieces are as large as a few of them for each room must be
    usual = area / (_PIECES * len(inner))
    furniture: list[Obstacle] = []
    missed = 0
    while area > enough:
        room = int(rng.choice(len(inner), p=sizes / sizes.sum()))
        wanted = min(area, usual * rng.uniform(0.5, 1.5) * max(_SHRUNK, _SHRINKING**missed))
        piece = _piece(request, inner[room], kept[room], clear, wanted, rng)
        if piece is None:
            missed += 1
            if missed == _TRIES:
                return None
            continue
        missed = 0
        kept[room].append(piece.polygon)
        furniture.append(piece)
        area -= piece.polygon.area
    return furniture


def _inner(request: Request, room: Box, thickness: float) -> Box:
    """Return a room up to the faces of its walls; the boundary has none."""
    low = [0.0 if edge == 0.0 else edge + thickness / 2.0 for edge in room[:2]]
    ends = zip(room[2:], (request.width, request.height), strict=True)
    high = [edge if edge == end else edge - thickness / 2.0 for edge, end in ends]
    return Box(*(round(edge, request.digits) for edge in (*low, *high)))


def _piece(
    request: Request,
    room: Box,
    others: list[shapely.Polygon],
    clear: shapely.Polygon,
    area: float,
    rng: np.random.Generator,
) -> CircleObstacle | PolygonObstacle | None:
    """Return a piece of furniture of about that area at a free place of a room, None if there is none."""
    kind = str(rng.choice(["cabinet", "table", "round table"], p=[0.5, 0.3, 0.2]))
    stretch = rng.uniform(1.6, 3.5) if kind == "cabinet" else rng.uniform(1.0, 2.0)
    long, deep = math.sqrt(area * stretch), math.sqrt(area / stretch)
    size = np.array([long, deep] if rng.random() < 0.5 else [deep, long])
    if kind == "round table":
        size = np.full(2, 2.0 * math.sqrt(area / math.pi))
    size = np.maximum(request.rounded(size), 4.0 * request.step)
    space = np.array(room.sides) - size
    if (space < 0.0).any():
        return None
    off = rng.random((_TRIES, 2)) * space
    if kind == "cabinet":
        # with its back to the wall
        side = int(size[0] > size[1])
        off[:, side] = space[side] * rng.integers(0, 2, _TRIES)
    low = request.rounded(off + room[:2])
    free = np.column_stack([low - room[:2], np.array(room[2:]) - low - size])
    # what is round would touch a wall in a point
    against = (free < request.step / 2.0) & (kind != "round table")
    low = low[(against | (free >= request.gap)).all(axis=1)]
    high, middle = request.rounded(low + size), request.rounded(low + size / 2.0)
    radius = request.floor(size[0] / 2.0 - request.step / 2.0) if kind == "round table" else 0.0
    shapes = shapely.points(middle) if radius else shapely.box(*low.T, *high.T)
    good = shapely.distance(shapes, clear) > radius
    if others:
        good &= shapely.distance(shapes, shapely.MultiPolygon(others)) >= request.gap + radius
    if not good.any():
        return None
    first = int(good.argmax())
    if radius:
        x, y = middle[first].tolist()
        return CircleObstacle((x, y), radius, kind)
    (left, bottom), (right, top) = low[first].tolist(), high[first].tolist()
    return PolygonObstacle(((left, bottom), (right, bottom), (right, top), (left, top)), name=kind)
