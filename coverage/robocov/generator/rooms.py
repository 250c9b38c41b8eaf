"""Maps of the kind `rooms`: a rectangular building with rooms, doors and furniture."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet
from shapely import Polygon

from robocov.arrays import Array
from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, WallObstacle
from robocov.generator.request import Request

# A unit is the side of a room of mean area, `Request.unit`. Lengths in gaps are multiples of `Request.gap`.
_CORRIDOR_PROBABILITY = 0.5
_MIN_CORRIDOR_ROOMS = 5
"""Smallest number of rooms of a building with a corridor."""
_MIN_CORRIDOR_WIDTH_GAPS = 1.6
_MAX_CORRIDOR_WIDTH_GAPS = 2.2
"""Smallest and largest width of a corridor."""
_MIN_CORRIDOR_OFFSET = 0.38
_MAX_CORRIDOR_OFFSET = 0.62
"""Minimum and maximum fraction of the remaining space that is to the left of or below a corridor."""
_MIN_CORRIDOR_DEPTH_GAPS = 3.0
"""Smallest depth of the rooms on either side of a corridor."""
_MIN_ROOM_SIDE_GAPS = 1.5
"""Smallest side of a room."""
_MAX_UNEVENNESS = 0.3
"""Largest offset of a wall from an even division, relative to the width of one room."""
_MIN_DOOR_WIDTH_GAPS = 1.06
_MAX_DOOR_WIDTH_GAPS = 1.6
"""Smallest and largest width of a door."""
_LOOP_PROBABILITY = 0.3
"""Probability of a door between rooms that are already connected."""
_MIN_WALL_PIECE_UNITS = 0.05
"""Smallest length of a wall next to a door."""
_MIN_WALL_FRACTION = 0.3
_MAX_WALL_FRACTION = 0.5
_MAX_WALL_FRACTION_OF_SMALL_ROOMS = 0.9
"""Smallest and largest fraction of the blocked area that walls take; small rooms have less furniture."""
_SMALL_ROOM_SIDE_GAPS = 6.0
_SMALLEST_ROOM_SIDE_GAPS = 3.0
"""Sides of the mean room between which the largest fraction rises to that of small rooms."""
_WALL_LENGTH_UNITS = 1.5
"""Length of the walls of a room without doors; half of each wall counts for each of its rooms."""
_MAX_THICKNESS_UNITS = 0.06
_PIECES_PER_ROOM = 2.2
_MIN_PIECE_AREA_RATIO = 0.5
_MAX_PIECE_AREA_RATIO = 1.5
"""Smallest and largest area of a piece of furniture, relative to the mean."""
_CANDIDATES_PER_PIECE = 32
"""Positions that are compared for one piece of furniture."""
_MAX_FAILURES = 32
"""Number of consecutive pieces without a free position after which the layout is abandoned."""
_FAILURE_SHRINKAGE = 0.92
_MIN_SHRINKAGE = 0.2
"""Factor by which a piece shrinks for each consecutive failure before it, and the smallest product."""
_MAX_FURNITURE_FRACTION = 0.35
"""Largest fraction of the rooms that furniture may fill; more does not fit."""
_AREA_TOLERANCE = 0.001
"""Largest difference between the blocked area and the requested one, as a fraction of the map's area."""
_PIECE_PROBABILITIES = {"cabinet": 0.5, "table": 0.3, "round table": 0.2}
_CABINET_STRETCH = (1.6, 3.5)
_TABLE_STRETCH = (1.0, 2.0)
"""Smallest and largest ratio of the sides of a piece of furniture."""
_MIN_PIECE_STEPS = 4.0
"""Smallest side of a piece of furniture, in rounding steps."""


class Box(NamedTuple):
    """A rectangle along the axes.

    Attributes
    ----------
    left, bottom, right, top : float, m
    """

    left: float
    bottom: float
    right: float
    top: float

    @property
    def sides(self) -> tuple[float, float]:
        """Width and height, m."""
        return self.right - self.left, self.top - self.bottom

    @property
    def area(self) -> float:
        """Area, m²."""
        width, height = self.sides
        return width * height

    def get_range(self, axis: int) -> tuple[float, float]:
        """Return the lowest and the highest coordinate on an axis.

        Parameters
        ----------
        axis : int
            0 for x, 1 for y.

        Returns
        -------
        low, high : float, m
        """
        if axis == 0:
            return self.left, self.right
        return self.bottom, self.top

    def crop(self, axis: int, low: float | None = None, high: float | None = None) -> Box:
        """Return the part of the rectangle between two coordinates on an axis.

        Parameters
        ----------
        axis : int
            0 for x, 1 for y.
        low, high : float or None, m
            The edges of the rectangle by default.

        Returns
        -------
        Box
        """
        default_low, default_high = self.get_range(axis)
        new_low = default_low if low is None else low
        new_high = default_high if high is None else high
        if axis == 0:
            return self._replace(left=new_low, right=new_high)
        return self._replace(bottom=new_low, top=new_high)


class Wall(NamedTuple):
    """A wall along one of the axes.

    Attributes
    ----------
    axis : int
        Axis that the wall crosses: 0 for a vertical wall, 1 for a horizontal one.
    position : float, m
        Coordinate of its middle line on that axis.
    start, end : float, m
        Coordinates of its ends on the other axis.
    """

    axis: int
    position: float
    start: float
    end: float

    def build_piece(self, start: float, end: float, thickness: float) -> WallObstacle:
        """Build a piece of the wall.

        Parameters
        ----------
        start, end : float, m
        thickness : float, m

        Returns
        -------
        WallObstacle
        """
        if self.axis == 0:
            return WallObstacle(((self.position, start), (self.position, end)), thickness)
        return WallObstacle(((start, self.position), (end, self.position)), thickness)


class Door(NamedTuple):
    """An opening in a wall.

    Attributes
    ----------
    wall : Wall
    start, end : float, m
        Its ends along the wall.
    rooms : pair of int
        Indices of the rooms that it connects.
    """

    wall: Wall
    start: float
    end: float
    rooms: tuple[int, int]


@dataclass
class FloorPlan:
    """Rooms, and the walls and doors between them.

    Attributes
    ----------
    thickness : float, m
        Thickness of the walls.
    rooms : list of Box
        Rooms up to the middle lines of their walls.
    walls : list of Wall
    doors : list of Door
    corridor : int or None
        Index of the room that is a corridor.
    """

    thickness: float
    rooms: list[Box] = field(default_factory=list)
    walls: list[Wall] = field(default_factory=list)
    doors: list[Door] = field(default_factory=list)
    corridor: int | None = None

    def build_walls(self) -> list[WallObstacle]:
        """Build the pieces of the walls between their doors.

        Returns
        -------
        list of WallObstacle
        """
        openings: defaultdict[Wall, list[float]] = defaultdict(list)
        for door in sorted(self.doors):
            openings[door.wall] += [door.start, door.end]
        pieces = []
        for wall in self.walls:
            # Pieces start at the start of the wall and at the ends of doors, and end at the starts of doors
            # and at the end of the wall.
            ends = [wall.start, *openings[wall], wall.end]
            for start, end in zip(ends[::2], ends[1::2], strict=True):
                pieces.append(wall.build_piece(start, end, self.thickness))
        return pieces


def build_building(
    request: Request, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Build walls, and furniture that touches walls or is at least the requested gap away from them.

    Parameters
    ----------
    request : Request
    corner_disc : DiscStart
        Disc that stays free of furniture.
    rng : numpy.random.Generator

    Returns
    -------
    list of Obstacle or None
        None if rooms would be too small, or the furniture does not fit.
    """
    plan = draw_floor_plan(request, _draw_thickness(request, rng), rng)
    if plan is None:
        return None
    walls: list[Obstacle] = [*plan.build_walls()]
    map_area = shapely.box(0.0, 0.0, request.width, request.height)
    wall_area = 0.0
    if walls:
        wall_area = shapely.union_all([wall.polygon for wall in walls]).intersection(map_area).area
    furniture = _place_furniture(request, corner_disc, plan, request.blocked_area - wall_area, rng)
    return None if furniture is None else [*walls, *furniture]


def _draw_thickness(request: Request, rng: np.random.Generator) -> float:
    """Return a random thickness of walls, m."""
    # Interpolate the largest fraction of walls between that of other rooms and that of the smallest ones.
    room_side_gaps = request.unit / request.gap
    weight = (_SMALL_ROOM_SIDE_GAPS - room_side_gaps) / (_SMALL_ROOM_SIDE_GAPS - _SMALLEST_ROOM_SIDE_GAPS)
    weight = min(max(weight, 0.0), 1.0)
    max_fraction = _MAX_WALL_FRACTION + (_MAX_WALL_FRACTION_OF_SMALL_ROOMS - _MAX_WALL_FRACTION) * weight
    fraction = rng.uniform(_MIN_WALL_FRACTION, max_fraction)
    # In units, the walls of a mean room block their length times their thickness; the room's area is 1.
    thickness_units = min(fraction * request.area / _WALL_LENGTH_UNITS, _MAX_THICKNESS_UNITS)
    # Half of the thickness is rounded, so that the faces of walls have rounded coordinates.
    half_thickness = thickness_units * request.unit / 2.0
    return 2.0 * max(request.round_down(half_thickness), request.step)


def draw_floor_plan(request: Request, thickness: float, rng: np.random.Generator) -> FloorPlan | None:
    """Draw a plan with the requested number of rooms.

    Parameters
    ----------
    request : Request
    thickness : float, m
        Thickness of the walls.
    rng : numpy.random.Generator

    Returns
    -------
    FloorPlan or None
        None if rooms would be too small, or cannot be connected by doors.
    """
    plan = FloorPlan(thickness)
    # Rectangles to divide, and the number of rooms in each.
    waiting = [(Box(0.0, 0.0, float(request.width), float(request.height)), int(request.count))]
    if request.count >= _MIN_CORRIDOR_ROOMS and rng.random() < _CORRIDOR_PROBABILITY:
        box, count = waiting[0]
        waiting = _divide_by_corridor(request, plan, box, count, rng)
    while waiting:
        box, count = waiting.pop()
        if count == 1:
            plan.rooms.append(box)
            continue
        halves = _divide_by_wall(request, plan, box, count, rng)
        if halves is None:
            return None
        waiting += halves
    return plan if _add_doors(request, plan, rng) else None


def _divide_by_wall(
    request: Request, plan: FloorPlan, box: Box, count: int, rng: np.random.Generator
) -> list[tuple[Box, int]] | None:
    """Divide a rectangle by a wall across its longer side, and add the wall to the plan.

    Each part will contain about half of the `count` rooms, and gets a similar share of the rectangle. Return
    the two parts, each with its number of rooms; None if they would be too small.
    """
    width, height = box.sides
    # The axis that the wall crosses.
    axis = 1 if height > width else 0
    # If the number of rooms is odd, either part may get one more.
    first_count = count // 2 if rng.random() < 0.5 else count - count // 2
    fraction = first_count / count + rng.uniform(-_MAX_UNEVENNESS, _MAX_UNEVENNESS) / count
    low, high = box.get_range(axis)
    min_side = _MIN_ROOM_SIDE_GAPS * request.gap + plan.thickness
    min_position = low + min_side
    max_position = high - min_side
    if min_position > max_position:
        return None
    position = min(max(low + fraction * (high - low), min_position), max_position)
    position = round(position, request.digits)
    plan.walls.append(Wall(axis, position, *box.get_range(1 - axis)))
    return [
        (box.crop(axis, high=position), first_count),
        (box.crop(axis, low=position), count - first_count),
    ]


def _divide_by_corridor(
    request: Request, plan: FloorPlan, box: Box, count: int, rng: np.random.Generator
) -> list[tuple[Box, int]]:
    """Add a corridor to the plan along the longer side of a rectangle, between two parts of it.

    The corridor is itself one of the `count` rooms. Return the two parts, each with its number of rooms; the
    whole rectangle if a corridor does not fit.
    """
    # `axis` is the one that the corridor's walls cross, and `extent` the side of the rectangle along it.
    width, height = box.sides
    axis = 1 if width >= height else 0
    extent = box.sides[axis]
    corridor_width = (
        rng.uniform(_MIN_CORRIDOR_WIDTH_GAPS, _MAX_CORRIDOR_WIDTH_GAPS) * request.gap + plan.thickness
    )
    offset = (extent - corridor_width) * rng.uniform(_MIN_CORRIDOR_OFFSET, _MAX_CORRIDOR_OFFSET)
    start = round(offset, request.digits)
    end = round(offset + corridor_width, request.digits)
    if min(start, extent - end) < _MIN_CORRIDOR_DEPTH_GAPS * request.gap:
        return [(box, count)]
    wall_range = box.get_range(1 - axis)
    plan.walls.append(Wall(axis, start, *wall_range))
    plan.walls.append(Wall(axis, end, *wall_range))
    plan.corridor = len(plan.rooms)
    plan.rooms.append(box.crop(axis, low=start, high=end))
    # The other rooms are divided in proportion to the depth of the parts, with at least one in each.
    first_share = start / (extent - corridor_width)
    first_count = min(max(round((count - 1) * first_share), 1), count - 2)
    return [
        (box.crop(axis, high=start), first_count),
        (box.crop(axis, low=end), count - 1 - first_count),
    ]


class _SharedWall(NamedTuple):
    """The section of a wall between two rooms, where a door may be.

    Attributes
    ----------
    wall : Wall
    rooms : pair of int
        Indices of the rooms on its two sides.
    low, high : float, m
        Ends of the section; `high` is below `low` if the wall does not separate these rooms.
    """

    wall: Wall
    rooms: tuple[int, int]
    low: float
    high: float


def _add_doors(request: Request, plan: FloorPlan, rng: np.random.Generator) -> bool:
    """Add doors until all rooms are connected, and a few more; return whether all rooms are connected.

    The shared walls are processed in random order, the walls of the corridor before all others. A wall gets a
    door if the rooms on its two sides are not connected yet, directly or via other rooms. Other walls get a
    door at random, which closes a loop of rooms. A piece of wall remains on both sides of each door.
    """
    room_groups = DisjointSet(range(len(plan.rooms)))
    min_piece = _MIN_WALL_PIECE_UNITS * request.unit + plan.thickness / 2.0
    shared_walls = _find_shared_walls(plan)
    # Random numbers for each wall: its place in the order, whether it closes a loop, and where the door is.
    order_keys, loop_draws, relative_positions = rng.random((3, len(shared_walls)))
    widths = request.gap * rng.uniform(_MIN_DOOR_WIDTH_GAPS, _MAX_DOOR_WIDTH_GAPS, len(shared_walls))

    def compute_sort_key(k: int) -> tuple[bool, float]:
        """Return a key that sorts the walls of the corridor first, and is random otherwise."""
        return plan.corridor not in shared_walls[k].rooms, float(order_keys[k])

    for k in sorted(range(len(shared_walls)), key=compute_sort_key):
        shared_wall = shared_walls[k]
        max_width = shared_wall.high - shared_wall.low - 2.0 * min_piece
        width = request.round_down(min(float(widths[k]), max_width))
        is_unneeded = room_groups.connected(*shared_wall.rooms) and loop_draws[k] > _LOOP_PROBABILITY
        if width < request.gap + request.step or is_unneeded:
            continue
        free_length = max_width - width
        start = shared_wall.low + min_piece + free_length * float(relative_positions[k])
        start = round(start, request.digits)
        end = round(start + width, request.digits)
        plan.doors.append(Door(shared_wall.wall, start, end, shared_wall.rooms))
        room_groups.merge(*shared_wall.rooms)
    return room_groups.n_subsets == 1


def _find_shared_walls(plan: FloorPlan) -> list[_SharedWall]:
    """Return the section of each wall between each pair of rooms on its two sides.

    `axis` is the axis that a wall crosses. A room on its lower side ends at the position of the wall on this
    axis, and a room on its upper side begins there.
    """
    # The rooms that begin, and those that end, at each coordinate on each axis.
    rooms_by_low: defaultdict[tuple[int, float], list[int]] = defaultdict(list)
    rooms_by_high: defaultdict[tuple[int, float], list[int]] = defaultdict(list)
    for index, room in enumerate(plan.rooms):
        for axis in (0, 1):
            low, high = room.get_range(axis)
            rooms_by_low[axis, low].append(index)
            rooms_by_high[axis, high].append(index)
    shared_walls = []
    for wall in plan.walls:
        lower_rooms = rooms_by_high[wall.axis, wall.position]
        upper_rooms = rooms_by_low[wall.axis, wall.position]
        for first, second in itertools.product(lower_rooms, upper_rooms):
            first_low, first_high = plan.rooms[first].get_range(1 - wall.axis)
            second_low, second_high = plan.rooms[second].get_range(1 - wall.axis)
            low = max(wall.start, first_low, second_low)
            high = min(wall.end, first_high, second_high)
            shared_walls.append(_SharedWall(wall, (first, second), low, high))
    return shared_walls


def _place_furniture(
    request: Request, corner_disc: DiscStart, plan: FloorPlan, area: float, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Return furniture that blocks the given area, m²; None if it does not fit.

    Pieces of random size are placed at random, one after another, until their areas add up to the given one.
    After a piece that does not fit, smaller ones are tried.
    """
    min_area = _AREA_TOLERANCE * request.width * request.height
    if area < -min_area:
        return None
    inner_rooms = [_find_inner_room(request, room, plan.thickness) for room in plan.rooms]
    room_areas = np.array([room.area for room in inner_rooms])
    if area > _MAX_FURNITURE_FRACTION * room_areas.sum():
        return None
    start_disc = shapely.Point(corner_disc.center).buffer(corner_disc.radius)
    # The polygons of the doors and of the furniture in each room. More furniture must keep the gap from them.
    occupied = _list_door_openings(plan)
    # A room is drawn with a probability that is proportional to its area. Dividing by the last sum makes the
    # largest cumulative probability exactly 1; because of rounding, it might be a little less.
    cumulative_areas = np.cumsum(room_areas / room_areas.sum())
    cumulative_probabilities = cumulative_areas / cumulative_areas[-1]
    mean_piece_area = area / (_PIECES_PER_ROOM * len(inner_rooms))
    failures = 0
    furniture: list[Obstacle] = []
    # `area` is the area that is still to be blocked.
    while area > min_area:
        room = int(np.searchsorted(cumulative_probabilities, rng.random(), side="right"))
        shrinkage = max(_MIN_SHRINKAGE, _FAILURE_SHRINKAGE**failures)
        area_ratio = rng.uniform(_MIN_PIECE_AREA_RATIO, _MAX_PIECE_AREA_RATIO)
        piece = _draw_piece(request, min(area, mean_piece_area * area_ratio * shrinkage), rng)
        obstacle = _place_piece(request, piece, inner_rooms[room], occupied[room], start_disc, rng)
        if obstacle is None:
            failures += 1
            if failures == _MAX_FAILURES:
                return None
        else:
            failures = 0
            occupied[room].append(obstacle.polygon)
            furniture.append(obstacle)
            area -= obstacle.polygon.area
    return furniture


def _list_door_openings(plan: FloorPlan) -> list[list[Polygon]]:
    """List the openings of the doors of each room; that of a door is listed for both of its rooms."""
    openings: list[list[Polygon]] = [[] for _ in plan.rooms]
    for door in plan.doors:
        opening = door.wall.build_piece(door.start, door.end, plan.thickness)
        for room in door.rooms:
            openings[room].append(opening.polygon)
    return openings


def _find_inner_room(request: Request, room: Box, thickness: float) -> Box:
    """Return the part of a room between the faces of its walls; the boundary has no thickness."""
    half = thickness / 2.0
    left = room.left if room.left == 0.0 else room.left + half
    bottom = room.bottom if room.bottom == 0.0 else room.bottom + half
    right = room.right if room.right == request.width else room.right - half
    top = room.top if room.top == request.height else room.top - half
    return Box(*(round(float(edge), request.digits) for edge in (left, bottom, right, top)))


class _Piece(NamedTuple):
    """A piece of furniture: its kind, and the sides of its bounding box, (2,) m."""

    kind: str
    size: Array

    @property
    def is_round(self) -> bool:
        """Whether it is a circle."""
        return self.kind == "round table"


def _draw_piece(request: Request, area: float, rng: np.random.Generator) -> _Piece:
    """Return a random piece of furniture of about the given area, m²."""
    kind = str(rng.choice(list(_PIECE_PROBABILITIES), p=list(_PIECE_PROBABILITIES.values())))
    min_stretch, max_stretch = _CABINET_STRETCH if kind == "cabinet" else _TABLE_STRETCH
    stretch = rng.uniform(min_stretch, max_stretch)
    length = math.sqrt(area * stretch)
    depth = math.sqrt(area / stretch)
    size = np.array([length, depth] if rng.random() < 0.5 else [depth, length])
    if kind == "round table":
        size = np.full(2, 2.0 * math.sqrt(area / math.pi))
    return _Piece(kind, np.maximum(request.round_points(size), _MIN_PIECE_STEPS * request.step))


def _sample_piece_corners(
    request: Request, piece: _Piece, room: Box, rng: np.random.Generator
) -> Array | None:
    """Sample positions of a piece in a room where its gap to each wall is zero or at least the requested one.

    A cabinet stands against a wall with its longer side. A round table touches no wall.

    Returns
    -------
    (k, 2) array or None, m
        Lower left corners; None if the piece is larger than the room.
    """
    room_low = np.array([room.left, room.bottom])
    room_high = np.array([room.right, room.top])
    free_size = room_high - room_low - piece.size
    if (free_size < 0.0).any():
        return None
    offsets = rng.random((_CANDIDATES_PER_PIECE, 2)) * free_size
    if piece.kind == "cabinet":
        # Its longer side stands against one of the two walls.
        axis = 1 if piece.size[0] > piece.size[1] else 0
        offsets[:, axis] = free_size[axis] * rng.integers(0, 2, _CANDIDATES_PER_PIECE)
    corners = request.round_points(offsets + room_low)
    gaps_to_walls = np.column_stack([corners - room_low, room_high - corners - piece.size])
    is_valid = gaps_to_walls >= request.gap
    if not piece.is_round:
        # Pieces may also touch a wall, except for round tables, which would touch it in a single point.
        is_touching = gaps_to_walls < request.step / 2.0
        is_valid |= is_touching
    return corners[is_valid.all(axis=1)]


def _place_piece(
    request: Request,
    piece: _Piece,
    room: Box,
    occupied: list[Polygon],
    start_disc: Polygon,
    rng: np.random.Generator,
) -> CircleObstacle | PolygonObstacle | None:
    """Return a piece of furniture at the first free one of several random positions in a room.

    A position is free if the piece does not touch the start disc, and keeps the gap from the other pieces and
    from doors, whose polygons are `occupied`. None if no position is free.
    """
    # Lower left corners, upper right corners and centers of the piece at all positions, (k, 2) m each.
    lower_left = _sample_piece_corners(request, piece, room, rng)
    if lower_left is None:
        return None
    upper_right = request.round_points(lower_left + piece.size)
    centers = request.round_points(lower_left + piece.size / 2.0)
    # Distances to a circle are measured from its center, and must be larger by its radius.
    if piece.is_round:
        shapes = shapely.points(centers)
        # Rounding moves the center by up to half a step.
        radius = request.round_down(piece.size[0] / 2.0 - request.step / 2.0)
    else:
        shapes = shapely.box(*lower_left.T, *upper_right.T)
        radius = 0.0
    is_free = shapely.distance(shapes, start_disc) > radius
    if occupied:
        is_free &= shapely.distance(shapes, shapely.MultiPolygon(occupied)) >= request.gap + radius
    if not is_free.any():
        return None
    chosen = int(is_free.argmax())
    if piece.is_round:
        x, y = centers[chosen].tolist()
        return CircleObstacle((x, y), radius, piece.kind)
    left, bottom = lower_left[chosen].tolist()
    right, top = upper_right[chosen].tolist()
    return PolygonObstacle(((left, bottom), (right, bottom), (right, top), (left, top)), name=piece.kind)
