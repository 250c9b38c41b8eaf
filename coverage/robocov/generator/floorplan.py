"""Floor plans: a rectangle divided into rooms, and doors so that each leads to all others."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from robocov.environment import WallObstacle

if TYPE_CHECKING:
    from robocov.generator.request import Request

_CORRIDOR = 0.5
"""Chance of a corridor across a plan of at least `_MANY` rooms."""

_MANY = 5

_NARROWEST = 1.5
"""Least side of a room, in gaps."""

_UNEVEN = 0.3
"""A wall is off the even division by at most so much of one room's share."""

_DOORS = 1.06, 1.6
"""Least and largest width of a door, in gaps."""

_LOOPS = 0.3
"""Chance of a door that is not needed."""

_STUB = 0.05
"""Least length of a piece of wall beside a door, in sides of a usual room."""


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
    """A wall between rooms.

    Attributes
    ----------
    across : int
        The axis that it crosses: 0 for a vertical wall.
    at : float, m
        Its middle line, on that axis.
    begin, end : float, m
        On the other axis.
    """

    across: int
    at: float
    begin: float
    end: float


class Door(NamedTuple):
    """An opening in a wall, between two rooms by their numbers."""

    wall: Wall
    begin: float
    end: float
    rooms: tuple[int, int]

    def box(self, thickness: float) -> shapely.Polygon:
        """Return the opening as a polygon."""
        return _along(self.wall, self.begin, self.end, thickness)


@dataclass
class FloorPlan:
    """Rooms, up to the middle lines of their walls, and the walls and doors between them."""

    rooms: list[Box] = field(default_factory=list)
    walls: list[Wall] = field(default_factory=list)
    doors: list[Door] = field(default_factory=list)

    def solid(self, thickness: float) -> list[WallObstacle]:
        """Return the walls with their doors left out."""
        pieces = []
        for wall in self.walls:
            doors = sorted((door.begin, door.end) for door in self.doors if door.wall == wall)
            ends = [wall.begin, *itertools.chain.from_iterable(doors), wall.end]
            for begin, end in zip(ends[::2], ends[1::2], strict=True):
                points = ((wall.at, begin), (wall.at, end))
                pieces.append(
                    WallObstacle(points if wall.across == 0 else tuple((y, x) for x, y in points), thickness)
                )
        return pieces


def floor_plan(request: Request, thickness: float, rng: np.random.Generator) -> FloorPlan | None:
    """Return a plan with as many rooms as are wanted; None if they become too small."""
    plan = FloorPlan()
    waiting = [(Box(0.0, 0.0, float(request.width), float(request.height)), int(request.obstacles))]
    corridor = None
    if request.obstacles >= _MANY and rng.random() < _CORRIDOR:
        corridor = _with_corridor(request, plan, thickness, waiting, rng)
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
    return plan if _add_doors(request, plan, thickness, corridor, rng) else None


def _with_corridor(
    request: Request,
    plan: FloorPlan,
    thickness: float,
    waiting: list[tuple[Box, int]],
    rng: np.random.Generator,
) -> int | None:
    """Divide the plan by a corridor along its longer side; return its number, None if there is no room."""
    whole, count = waiting[0]
    across = int(whole.sides[0] >= whole.sides[1])
    wide = rng.uniform(1.6, 2.2) * request.gap + thickness
    begin = (whole.sides[across] - wide) * rng.uniform(0.38, 0.62)
    begin, end = round(begin, request.digits), round(begin + wide, request.digits)
    if begin < 2.0 * _NARROWEST * request.gap or whole.sides[across] - end < 2.0 * _NARROWEST * request.gap:
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


def _add_doors(
    request: Request, plan: FloorPlan, thickness: float, corridor: int | None, rng: np.random.Generator
) -> bool:
    """Add doors so that all rooms hang together, and some more; return whether that is possible."""
    group = list(range(len(plan.rooms)))
    stub = _STUB * request.unit + thickness / 2.0
    between = []
    for wall in plan.walls:
        before = [i for i, room in enumerate(plan.rooms) if room[wall.across + 2] == wall.at]
        behind = [j for j, room in enumerate(plan.rooms) if room[wall.across] == wall.at]
        between += [(wall, i, j) for i, j in itertools.product(before, behind)]
    key, loop, place = rng.random((3, len(between)))
    widths = request.gap * rng.uniform(*_DOORS, len(between))
    # doors to the corridor come first
    for k in sorted(range(len(between)), key=lambda k: (corridor not in between[k][1:], key[k])):
        wall, i, j = between[k]
        low, high = _shared(wall, plan.rooms[i], plan.rooms[j])
        wide = request.floor(min(float(widths[k]), high - low - 2.0 * stub))
        if wide < request.gap + request.step or (group[i] == group[j] and loop[k] > _LOOPS):
            continue
        begin = round(low + stub + (high - low - 2.0 * stub - wide) * float(place[k]), request.digits)
        plan.doors.append(Door(wall, begin, round(begin + wide, request.digits), (i, j)))
        group = [group[i] if number == group[j] else number for number in group]
    return len(set(group)) == 1


def _shared(wall: Wall, one: Box, other: Box) -> tuple[float, float]:
    """Return where a wall lies between two rooms; the end is before the begin where it does not."""
    side = 1 - wall.across
    return max(wall.begin, one[side], other[side]), min(wall.end, one[side + 2], other[side + 2])


def _along(wall: Wall, begin: float, end: float, thickness: float) -> shapely.Polygon:
    low, high = wall.at - thickness / 2.0, wall.at + thickness / 2.0
    return shapely.box(low, begin, high, end) if wall.across == 0 else shapely.box(begin, low, end, high)
