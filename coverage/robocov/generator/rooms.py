"""Maps of the kind `rooms`: a building, that is a rectangle divided into rooms, with doors and furniture."""

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import Polygon

from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, WallObstacle
from robocov.generator.request import Request

_CORRIDOR, _MANY = 0.5, 5  # chance of a corridor across a plan, and the least number of rooms for one
_NARROWEST = 1.5  # least side of a room, in gaps
_UNEVEN = 0.3  # a wall is off the even division by at most so much of one room's share
_DOORS = 1.06, 1.6  # least and largest width of a door, in gaps
_LOOPS = 0.3  # chance of a door that is not needed
_STUB = 0.05  # least length of a piece of wall beside a door, in sides of a usual room
# part of the blocked area that walls take: the least, the most, and the most where rooms are small
_WALLS = 0.3, 0.5, 0.9
_SMALL, _SMALLEST = 6.0, 3.0  # sides of usual rooms with little, and very little, room for furniture, in gaps
_LENGTH = 1.5  # of the walls of a room without doors, in its sides, each wall counted half for each room
_THICKEST = 0.06  # largest thickness of walls, in sides of a usual room
_PIECES = 2.2  # pieces of furniture in a room, on average
_TRIES = 32  # places that are tried for one piece, and pieces in a row that find none before that is given up
_SHRINKING, _SHRUNK = 0.92, 0.2  # a piece that finds no place makes the next so much smaller; the smallest
_DENSEST = 0.35  # part of the rooms that furniture fills at most: more finds no place
_ENOUGH = 0.001  # what is left to be blocked, as a part of the map, which is too little for a piece


class Box(NamedTuple):
    """A rectangle along the axes, m."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def sides(self) -> tuple[float, float]:
        """Its width and height."""
        return self.right - self.left, self.top - self.bottom


class Wall(NamedTuple):
    """A wall from `begin` to `end` on one axis, with its middle line `at` (m) on the axis that it crosses."""

    across: int
    at: float
    begin: float
    end: float

    def part(self, begin: float, end: float, thickness: float) -> WallObstacle:
        """Return a part of the wall."""
        upright, flat = ((self.at, begin), (self.at, end)), ((begin, self.at), (end, self.at))
        return WallObstacle(flat if self.across else upright, thickness)


class Door(NamedTuple):
    """An opening in a wall, between two rooms by their numbers."""

    wall: Wall
    begin: float
    end: float
    rooms: tuple[int, int]


@dataclass
class FloorPlan:
    """Rooms, up to the middle lines of their walls, and the walls and doors between them."""

    thickness: float
    rooms: list[Box] = field(default_factory=list)
    walls: list[Wall] = field(default_factory=list)
    doors: list[Door] = field(default_factory=list)

    def solid(self) -> list[WallObstacle]:
        """Return the walls with their doors left out."""
        openings: defaultdict[Wall, list[float]] = defaultdict(list)
        for door in sorted(self.doors):
            openings[door.wall] += door.begin, door.end
        pieces = []
        for wall in self.walls:
            ends = [wall.begin, *openings[wall], wall.end]
            for begin, end in zip(ends[::2], ends[1::2], strict=True):
                pieces.append(wall.part(begin, end, self.thickness))
        return pieces


def building(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return walls and furniture, against walls or with gaps around it; None if there is no room for it."""
    least, most, of_small = _WALLS
    small = min(max((_SMALL - request.unit / request.gap) / (_SMALL - _SMALLEST), 0.0), 1.0)
    part = rng.uniform(least, most + (of_small - most) * small)
    half = min(part * request.area / _LENGTH, _THICKEST) * request.unit / 2.0
    # so that the faces of walls have rounded coordinates
    thickness = 2.0 * max(request.round_down(half), request.step)
    plan = floor_plan(request, thickness, rng)
    if plan is None:
        return None
    walls: list[Obstacle] = [*plan.solid()]
    whole = shapely.box(0.0, 0.0, request.width, request.height)
    built = shapely.union_all([wall.polygon for wall in walls]).intersection(whole).area if walls else 0.0
    furniture = _furniture(request, corner, plan, request.blocked - built, rng)
    return None if furniture is None else [*walls, *furniture]


def floor_plan(request: Request, thickness: float, rng: np.random.Generator) -> FloorPlan | None:
    """Return a plan with as many rooms as are wanted; None if they become too small."""
    plan = FloorPlan(thickness)
    waiting = [(Box(0.0, 0.0, float(request.width), float(request.height)), int(request.obstacles))]
    corridor = None
    if request.obstacles >= _MANY and rng.random() < _CORRIDOR:
        corridor = _with_corridor(request, plan, waiting, rng)
    least = _NARROWEST * request.gap + thickness
    while waiting:
        box, count = waiting.pop()
        if count == 1:
            plan.rooms.append(box)
            continue
        across = int(box.sides[1] > box.sides[0])
        some = count // 2 if rng.random() < 0.5 else count - count // 2
        part = some / count + rng.uniform(-_UNEVEN, _UNEVEN) / count
        low, high = box[across] + least, box[across + 2] - least
        if low > high:
            return None
        at = round(min(max(box[across] + part * box.sides[across], low), high), request.digits)
        plan.walls.append(Wall(across, at, box[1 - across], box[3 - across]))
        first, second = list(box), list(box)
        first[across + 2] = second[across] = at
        waiting += [(Box(*first), some), (Box(*second), count - some)]
    return plan if _add_doors(request, plan, corridor, rng) else None


def _with_corridor(
    request: Request, plan: FloorPlan, waiting: list[tuple[Box, int]], rng: np.random.Generator
) -> int | None:
    """Divide the plan by a corridor along its longer side; return its number, None if there is no room."""
    whole, count = waiting[0]
    across = int(whole.sides[0] >= whole.sides[1])
    wide = rng.uniform(1.6, 2.2) * request.gap + plan.thickness
    begin = (whole.sides[across] - wide) * rng.uniform(0.38, 0.62)
    begin, end = round(begin, request.digits), round(begin + wide, request.digits)
    if min(begin, whole.sides[across] - end) < 2.0 * _NARROWEST * request.gap:
        return None
    below, above, middle = list(whole), list(whole), list(whole)
    below[across + 2] = middle[across] = begin
    above[across] = middle[across + 2] = end
    share = begin / (whole.sides[across] - wide)
    some = min(max(round((count - 1) * share), 1), count - 2)
    waiting[:] = [(Box(*below), some), (Box(*above), count - 1 - some)]
    plan.walls += [Wall(across, at, whole[1 - across], whole[3 - across]) for at in (begin, end)]
    plan.rooms.append(Box(*middle))
    return len(plan.rooms) - 1


def _add_doors(request: Request, plan: FloorPlan, corridor: int | None, rng: np.random.Generator) -> bool:
    """Add doors so that all rooms hang together, and some more; return whether that is possible."""
    joined = DisjointSet(range(len(plan.rooms)))
    stub = _STUB * request.unit + plan.thickness / 2.0
    # the rooms by each of their four edges: which, and where it is
    beside: defaultdict[tuple[int, float], list[int]] = defaultdict(list)
    for number, room in enumerate(plan.rooms):
        for edge, at in enumerate(room):
            beside[edge, at].append(number)
    between: list[tuple[Wall, int, int]] = []
    for wall in plan.walls:
        rooms = beside[wall.across + 2, wall.at], beside[wall.across, wall.at]
        between += [(wall, i, j) for i, j in itertools.product(*rooms)]
    key, loop, place = rng.random((3, len(between)))
    widths = request.gap * rng.uniform(*_DOORS, len(between))
    # doors to the corridor come first
    for k in sorted(range(len(between)), key=lambda k: (corridor not in between[k][1:], key[k])):
        wall, i, j = between[k]
        one, other, side = plan.rooms[i], plan.rooms[j], 1 - wall.across
        # the end is before the begin where the wall does not lie between the two
        low, high = max(wall.begin, one[side], other[side]), min(wall.end, one[side + 2], other[side + 2])
        wide = request.round_down(min(float(widths[k]), high - low - 2.0 * stub))
        if wide < request.gap + request.step or (joined.connected(i, j) and loop[k] > _LOOPS):
            continue
        begin = round(low + stub + (high - low - 2.0 * stub - wide) * float(place[k]), request.digits)
        plan.doors.append(Door(wall, begin, round(begin + wide, request.digits), (i, j)))
        joined.merge(i, j)
    return joined.n_subsets == 1


def _furniture(
    request: Request, corner: DiscStart, plan: FloorPlan, area: float, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Return furniture that blocks so much, None if it finds no place."""
    enough = _ENOUGH * request.width * request.height
    if area < -enough:
        return None
    clear = shapely.Point(corner.center).buffer(corner.radius)
    inner = [_inner(request, box, plan.thickness) for box in plan.rooms]
    sizes = np.array([math.prod(box.sides) for box in inner])
    if area > _DENSEST * sizes.sum():
        return None
    kept: list[list[Polygon]] = [[] for _ in inner]
    for door in plan.doors:
        for number in door.rooms:
            kept[number].append(door.wall.part(door.begin, door.end, plan.thickness).polygon)
    chances = np.cumsum(sizes / sizes.sum())
    # pieces are as large as a few of them for each room must be
    usual, missed = area / (_PIECES * len(inner)), 0
    furniture: list[Obstacle] = []
    while area > enough:
        room = int(np.searchsorted(chances / chances[-1], rng.random(), side="right"))
        wanted = min(area, usual * rng.uniform(0.5, 1.5) * max(_SHRUNK, _SHRINKING**missed))
        piece = _piece(request, inner[room], kept[room], clear, wanted, rng)
        if piece is not None:
            kept[room].append(piece.polygon)
            furniture.append(piece)
            area -= piece.polygon.area
        missed = missed + 1 if piece is None else 0
        if missed == _TRIES:
            return None
    return furniture


def _inner(request: Request, room: Box, thickness: float) -> Box:
    """Return a room up to the faces of its walls; the boundary has none."""
    half, bounds = thickness / 2.0, (0.0, 0.0, request.width, request.height)
    inward = [half * (edge != bound) for edge, bound in zip(room, bounds, strict=True)]
    faces = np.array(room) + inward * np.array([1.0, 1.0, -1.0, -1.0])
    return Box(*(round(face, request.digits) for face in faces.tolist()))


def _piece(
    request: Request, room: Box, others: list[Polygon], clear: Polygon, area: float, rng: np.random.Generator
) -> CircleObstacle | PolygonObstacle | None:
    """Return a piece of furniture of about that area at a free place of a room, None if there is none."""
    kind = str(rng.choice(["cabinet", "table", "round table"], p=[0.5, 0.3, 0.2]))
    stretch = rng.uniform(*((1.6, 3.5) if kind == "cabinet" else (1.0, 2.0)))
    long, deep = math.sqrt(area * stretch), math.sqrt(area / stretch)
    size = np.array([long, deep] if rng.random() < 0.5 else [deep, long])
    if kind == "round table":
        size = np.full(2, 2.0 * math.sqrt(area / math.pi))
    size = np.maximum(request.round_points(size), 4.0 * request.step)
    space = np.array(room.sides) - size
    if (space < 0.0).any():
        return None
    off = rng.random((_TRIES, 2)) * space
    if kind == "cabinet":
        # with its back to the wall
        side = int(size[0] > size[1])
        off[:, side] = space[side] * rng.integers(0, 2, _TRIES)
    low = request.round_points(off + room[:2])
    free = np.column_stack([low - room[:2], np.array(room[2:]) - low - size])
    # what is round would touch a wall in a point
    against = (free < request.step / 2.0) & (kind != "round table")
    low = low[(against | (free >= request.gap)).all(axis=1)]
    high, middle = request.round_points(low + size), request.round_points(low + size / 2.0)
    radius = request.round_down(size[0] / 2.0 - request.step / 2.0) if kind == "round table" else 0.0
    shapes = shapely.points(middle) if radius else shapely.box(*low.T, *high.T)
    good = shapely.distance(shapes, clear) > radius
    if others:
        good &= shapely.distance(shapes, shapely.MultiPolygon(others)) >= request.gap + radius
    if not good.any():
        return None
    (left, bottom), (right, top), (x, y) = (at[int(good.argmax())].tolist() for at in (low, high, middle))
    if radius:
        return CircleObstacle((x, y), radius, kind)
    return PolygonObstacle(((left, bottom), (right, bottom), (right, top), (left, top)), name=kind)
