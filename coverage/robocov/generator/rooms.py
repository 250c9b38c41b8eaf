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

from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, WallObstacle
from robocov.generator.request import MapRequest
from robocov.typing import FloatArray

# Lengths in spacings are multiples of `MapRequest.mean_spacing`, the side of a square room of mean area.
# Lengths in gaps are multiples of `MapRequest.gap`.
_CORRIDOR_PROBABILITY = 0.5
"""Probability that a building with enough rooms has a corridor."""
_MIN_CORRIDOR_ROOMS = 5
"""Minimum number of rooms of a building with a corridor. The corridor counts as a room."""
_MIN_CORRIDOR_WIDTH_GAPS = 1.6
_MAX_CORRIDOR_WIDTH_GAPS = 2.2
"""Minimum and maximum width of a corridor."""
_MIN_CORRIDOR_OFFSET = 0.38
_MAX_CORRIDOR_OFFSET = 0.62
"""Minimum and maximum fraction of the remaining space that is to the left of a corridor, or below it."""
_MIN_CORRIDOR_DEPTH_GAPS = 3.0
"""Minimum depth of the rooms on either side of a corridor."""
_MIN_ROOM_SIDE_GAPS = 1.5
"""Minimum side of a room."""
_MAX_UNEVENNESS = 0.3
"""Maximum offset of a wall from an even division, relative to the width of one room."""
_MIN_DOOR_WIDTH_GAPS = 1.06
_MAX_DOOR_WIDTH_GAPS = 1.6
"""Minimum and maximum width of a door."""
_LOOP_PROBABILITY = 0.3
"""Probability of a door between rooms that are already connected."""
_MIN_WALL_SECTION_SPACINGS = 0.05
"""Minimum length of a wall next to a door."""
_MIN_WALL_FRACTION = 0.3
"""Minimum fraction of the blocked area that walls take."""
_LARGE_ROOM_SIDE_GAPS = 6.0
_MAX_WALL_FRACTION_OF_LARGE_ROOMS = 0.5
_SMALL_ROOM_SIDE_GAPS = 3.0
_MAX_WALL_FRACTION_OF_SMALL_ROOMS = 0.9
"""Maximum fraction of the blocked area that walls take if the mean room has the side of a large room or more,
or that of a small room or less. In between, it is interpolated. Small rooms have less furniture."""
_WALL_LENGTH_SPACINGS = 1.5
"""Mean length of the walls per room, without doors; a wall between two rooms is counted once."""
_MAX_THICKNESS_SPACINGS = 0.06
"""Maximum thickness of walls."""
_PIECES_PER_ROOM = 2.2
"""Mean number of pieces of furniture per room if no piece shrinks."""
_MIN_PIECE_AREA_RATIO = 0.5
_MAX_PIECE_AREA_RATIO = 1.5
"""Minimum and maximum area of a piece of furniture, relative to the mean area."""
_CANDIDATES_PER_PIECE = 32
"""Number of random positions that are tested for one piece of furniture."""
_MAX_FAILURES = 32
"""Number of consecutive pieces without a free position after which the layout is abandoned."""
_FAILURE_SHRINKAGE = 0.92
"""Factor by which the area of a piece is multiplied for each of the consecutive failures before it."""
_MIN_SHRINKAGE = 0.2
"""Minimum product of these factors."""
_MAX_FURNITURE_FRACTION = 0.35
"""Maximum fraction of the rooms that furniture may fill; more does not fit."""
_FRACTION_TOLERANCE = 0.001
"""Maximum difference between the blocked fraction of the map's area and the requested fraction."""
_PIECE_PROBABILITIES = {"cabinet": 0.5, "table": 0.3, "round table": 0.2}
"""Probabilities of the kinds of furniture."""
_CABINET_STRETCH = (1.6, 3.5)
_TABLE_STRETCH = (1.0, 2.0)
"""Minimum and maximum ratio of the longer side of a cabinet or table to the shorter one."""
_MIN_PIECE_ROUNDING_STEPS = 4.0
"""Minimum side of a piece of furniture, in rounding steps."""


class Box(NamedTuple):
    """An axis-aligned rectangle.

    Attributes
    ----------
    left, bottom : float, m
        Minimum x and y.
    right, top : float, m
        Maximum x and y.
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
            The two coordinates. If one is omitted, the rectangle is not cropped on this side.

        Returns
        -------
        Box
            The cropped rectangle.
        """
        old_low, old_high = self.get_range(axis)
        new_low = old_low if low is None else low
        new_high = old_high if high is None else high
        if axis == 0:
            return self._replace(left=new_low, right=new_high)
        return self._replace(bottom=new_low, top=new_high)


class Wall(NamedTuple):
    """A vertical or horizontal wall.

    Attributes
    ----------
    axis : int
        Axis perpendicular to the wall: 0 for a vertical wall, 1 for a horizontal one.
    position : float, m
        Coordinate of the wall's middle line on this axis.
    start, end : float, m
        Coordinates of the wall's ends on the other axis.
    """

    axis: int
    position: float
    start: float
    end: float

    def build_section(self, start: float, end: float, thickness: float) -> WallObstacle:
        """Build a section of the wall.

        Parameters
        ----------
        start, end : float, m
            Coordinates of the section's ends along the wall.
        thickness : float, m
            Thickness of the wall.

        Returns
        -------
        WallObstacle
            The section.
        """
        if self.axis == 0:
            return WallObstacle(((self.position, start), (self.position, end)), thickness)
        return WallObstacle(((start, self.position), (end, self.position)), thickness)


class Door(NamedTuple):
    """An opening in a wall.

    Attributes
    ----------
    wall : Wall
        Wall that contains the door.
    start, end : float, m
        Coordinates of the door's ends along the wall.
    rooms : pair of int
        Indices of the rooms that the door connects.
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
    wall_thickness : float, m
        Thickness of the walls.
    rooms : list of Box
        Rooms, which end at the middle lines of their walls.
    walls : list of Wall
        Walls between rooms, without the boundary.
    doors : list of Door
        Openings in these walls.
    corridor : int or None
        Index of the room that is a corridor; None if no room is.
    """

    wall_thickness: float
    rooms: list[Box] = field(default_factory=list)
    walls: list[Wall] = field(default_factory=list)
    doors: list[Door] = field(default_factory=list)
    corridor: int | None = None

    def build_walls(self) -> list[WallObstacle]:
        """Build the sections of walls between doors.

        Returns
        -------
        list of WallObstacle
            All sections of all walls.
        """
        # Starts and ends of the doors in each wall, in the order along the wall.
        door_ends: defaultdict[Wall, list[float]] = defaultdict(list)
        for door in sorted(self.doors):
            door_ends[door.wall] += [door.start, door.end]
        sections = []
        for wall in self.walls:
            # A section leads from the start of the wall, or the end of a door, to the start of the next door,
            # or the end of the wall.
            section_ends = [wall.start, *door_ends[wall], wall.end]
            for start, end in zip(section_ends[::2], section_ends[1::2], strict=True):
                sections.append(wall.build_section(start, end, self.wall_thickness))
        return sections


def build_building(
    request: MapRequest, corner_disc: DiscStart, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Build walls, and furniture that touches walls or is at least the requested gap away from them.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    corner_disc : DiscStart
        Disc that stays free of furniture.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    list of Obstacle or None
        The walls, then the furniture. None if rooms would be too small, or the furniture does not fit.
    """
    wall_thickness = _sample_wall_thickness(request, rng)
    plan = sample_floor_plan(request, wall_thickness, rng)
    if plan is None:
        return None
    walls: list[Obstacle] = list(plan.build_walls())
    map_area = shapely.box(0.0, 0.0, request.width, request.height)
    wall_area = 0.0
    if walls:
        wall_area = shapely.union_all([wall.polygon for wall in walls]).intersection(map_area).area
    furniture_area = request.blocked_area - wall_area
    furniture = _place_furniture(request, corner_disc, plan, furniture_area, rng)
    return None if furniture is None else [*walls, *furniture]


def _sample_wall_thickness(request: MapRequest, rng: np.random.Generator) -> float:
    """Sample the thickness of walls, m."""
    # Interpolate the largest fraction of the blocked area that walls take.
    room_side_gaps = request.mean_spacing / request.gap
    weight = (_LARGE_ROOM_SIDE_GAPS - room_side_gaps) / (_LARGE_ROOM_SIDE_GAPS - _SMALL_ROOM_SIDE_GAPS)
    weight = min(max(weight, 0.0), 1.0)
    fraction_increase = _MAX_WALL_FRACTION_OF_SMALL_ROOMS - _MAX_WALL_FRACTION_OF_LARGE_ROOMS
    max_fraction = _MAX_WALL_FRACTION_OF_LARGE_ROOMS + fraction_increase * weight
    fraction = rng.uniform(_MIN_WALL_FRACTION, max_fraction)
    # If lengths are measured in spacings, the area of the map per room is 1, and the blocked area per room is
    # the length of its walls times their thickness.
    thickness_spacings = fraction * request.blocked_fraction / _WALL_LENGTH_SPACINGS
    thickness_spacings = min(thickness_spacings, _MAX_THICKNESS_SPACINGS)
    # Half of the thickness is rounded, so that the faces of walls have rounded coordinates too.
    half_thickness = thickness_spacings * request.mean_spacing / 2.0
    return 2.0 * max(request.round_down(half_thickness), request.rounding_step)


def sample_floor_plan(
    request: MapRequest, wall_thickness: float, rng: np.random.Generator
) -> FloorPlan | None:
    """Sample a floor plan with the requested number of rooms.

    Parameters
    ----------
    request : MapRequest
        Parameters of the map.
    wall_thickness : float, m
        Thickness of the walls.
    rng : numpy.random.Generator
        Random number generator.

    Returns
    -------
    FloorPlan or None
        The plan. None if rooms would be too small, or cannot be connected by doors.
    """
    plan = FloorPlan(wall_thickness)
    building = Box(0.0, 0.0, float(request.width), float(request.height))
    room_count = int(request.obstacle_count)
    # Rectangles that may have to be divided, and the number of rooms in each.
    waiting = [(building, room_count)]
    if room_count >= _MIN_CORRIDOR_ROOMS and rng.random() < _CORRIDOR_PROBABILITY:
        waiting = _divide_by_corridor(request, plan, building, room_count, rng)
    while waiting:
        box, room_count = waiting.pop()
        if room_count == 1:
            plan.rooms.append(box)
            continue
        parts = _divide_by_wall(request, plan, box, room_count, rng)
        if parts is None:
            return None
        waiting += parts
    are_connected = _add_doors(request, plan, rng)
    return plan if are_connected else None


def _divide_by_wall(
    request: MapRequest, plan: FloorPlan, box: Box, room_count: int, rng: np.random.Generator
) -> list[tuple[Box, int]] | None:
    """Divide a rectangle by a wall across its longer side, and add the wall to the plan.

    Each part will contain about half of the rooms, and gets about the same fraction of the rectangle. Return
    the two parts, each with its number of rooms; None if they would be too small.
    """
    width, height = box.sides
    # The axis perpendicular to the wall.
    axis = 1 if height > width else 0
    # If the number of rooms is odd, either part may get one more.
    first_count = room_count // 2 if rng.random() < 0.5 else room_count - room_count // 2
    unevenness = rng.uniform(-_MAX_UNEVENNESS, _MAX_UNEVENNESS)
    fraction = first_count / room_count + unevenness / room_count
    low, high = box.get_range(axis)
    min_side = _MIN_ROOM_SIDE_GAPS * request.gap + plan.wall_thickness
    min_position = low + min_side
    max_position = high - min_side
    if min_position > max_position:
        return None
    position = min(max(low + fraction * (high - low), min_position), max_position)
    position = round(position, request.decimals)
    plan.walls.append(Wall(axis, position, *box.get_range(1 - axis)))
    return [
        (box.crop(axis, high=position), first_count),
        (box.crop(axis, low=position), room_count - first_count),
    ]


def _divide_by_corridor(
    request: MapRequest, plan: FloorPlan, box: Box, room_count: int, rng: np.random.Generator
) -> list[tuple[Box, int]]:
    """Divide a building by a corridor along its longer side, and add the corridor to the plan.

    The corridor is one of the rooms. Return the two parts on its sides, each with its number of rooms. If a
    corridor does not fit, return only the whole building.
    """
    # The axis perpendicular to the corridor.
    width, height = box.sides
    axis = 1 if width >= height else 0
    extent = box.sides[axis]
    width_gaps = rng.uniform(_MIN_CORRIDOR_WIDTH_GAPS, _MAX_CORRIDOR_WIDTH_GAPS)
    # The distance between the middle lines of the corridor's walls.
    corridor_width = width_gaps * request.gap + plan.wall_thickness
    offset = (extent - corridor_width) * rng.uniform(_MIN_CORRIDOR_OFFSET, _MAX_CORRIDOR_OFFSET)
    start = round(offset, request.decimals)
    end = round(offset + corridor_width, request.decimals)
    if min(start, extent - end) < _MIN_CORRIDOR_DEPTH_GAPS * request.gap:
        return [(box, room_count)]
    wall_range = box.get_range(1 - axis)
    plan.walls.append(Wall(axis, start, *wall_range))
    plan.walls.append(Wall(axis, end, *wall_range))
    plan.corridor = len(plan.rooms)
    plan.rooms.append(box.crop(axis, low=start, high=end))
    # The other rooms are divided in proportion to the depth of the parts, with at least one in each.
    first_share = start / (extent - corridor_width)
    other_count = room_count - 1
    first_count = min(max(round(other_count * first_share), 1), other_count - 1)
    return [
        (box.crop(axis, high=start), first_count),
        (box.crop(axis, low=end), other_count - first_count),
    ]


class _SharedWall(NamedTuple):
    """The section of a wall between two rooms, where a door may be.

    Attributes
    ----------
    wall : Wall
        The whole wall.
    rooms : pair of int
        Indices of the rooms on the two sides of the wall.
    low, high : float, m
        Coordinates of the section's ends along the wall. If the wall does not separate these rooms, `high` is
        below `low`.
    """

    wall: Wall
    rooms: tuple[int, int]
    low: float
    high: float


def _add_doors(request: MapRequest, plan: FloorPlan, rng: np.random.Generator) -> bool:
    """Add doors that connect all rooms, and a few more; return whether all rooms could be connected.

    The walls between rooms are processed in random order, the walls of the corridor before all others. A wall
    gets a door if the two rooms are not connected yet, directly or through other rooms. Some of the other
    walls, chosen at random, get a door too. A section of the wall remains on both sides of each door.
    """
    room_groups = DisjointSet(range(len(plan.rooms)))
    min_section = _MIN_WALL_SECTION_SPACINGS * request.mean_spacing + plan.wall_thickness / 2.0
    shared_walls = _find_shared_walls(plan)
    # Random numbers of each wall. They decide the order of the walls, whether a wall between connected rooms
    # gets a door, and the position of the door.
    order_keys, loop_draws, relative_positions = rng.random((3, len(shared_walls)))
    widths = request.gap * rng.uniform(_MIN_DOOR_WIDTH_GAPS, _MAX_DOOR_WIDTH_GAPS, len(shared_walls))

    def compute_sort_key(k: int) -> tuple[bool, float]:
        """Return a key that sorts the walls of the corridor first, and is random otherwise."""
        return plan.corridor not in shared_walls[k].rooms, float(order_keys[k])

    for k in sorted(range(len(shared_walls)), key=compute_sort_key):
        shared_wall = shared_walls[k]
        max_width = shared_wall.high - shared_wall.low - 2.0 * min_section
        width = request.round_down(min(float(widths[k]), max_width))
        if width < request.gap + request.rounding_step:
            continue
        if room_groups.connected(*shared_wall.rooms) and loop_draws[k] > _LOOP_PROBABILITY:
            continue
        free_length = max_width - width
        start = shared_wall.low + min_section + free_length * float(relative_positions[k])
        start = round(start, request.decimals)
        end = round(start + width, request.decimals)
        plan.doors.append(Door(shared_wall.wall, start, end, shared_wall.rooms))
        room_groups.merge(*shared_wall.rooms)
    return room_groups.n_subsets == 1


def _find_shared_walls(plan: FloorPlan) -> list[_SharedWall]:
    """Find the section of each wall between each pair of rooms on its two sides.

    The first room of a pair ends, and the second one begins, at the position of the wall on the axis
    perpendicular to it.
    """
    # Rooms by the axis and the coordinate at which they begin, and at which they end. These coordinates are
    # compared exactly, because walls and rooms contain the same rounded numbers.
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
    request: MapRequest, corner_disc: DiscStart, plan: FloorPlan, area: float, rng: np.random.Generator
) -> list[Obstacle] | None:
    """Place furniture that blocks the given area, m²; return None if it does not fit.

    Pieces of random size are placed at random, one after another, until the sum of their areas is near enough
    to the given area. After a piece that does not fit, smaller ones are tried.
    """
    max_area_error = _FRACTION_TOLERANCE * request.width * request.height
    if area < -max_area_error:
        # The walls alone block more than requested.
        return None
    inner_rooms = [_shrink_to_wall_faces(request, room, plan.wall_thickness) for room in plan.rooms]
    room_areas = np.array([room.area for room in inner_rooms])
    if area > _MAX_FURNITURE_FRACTION * room_areas.sum():
        return None
    start_disc = shapely.Point(corner_disc.center).buffer(corner_disc.radius)
    # The polygons of the doors and of the furniture in each room. Further furniture must keep the gap from
    # these polygons.
    occupied = _list_door_openings(plan)
    # A room is chosen with a probability that is proportional to its area. Because of rounding errors, the
    # last cumulative sum may differ a little from 1. Dividing by it makes the last cumulative probability
    # exactly 1.
    cumulative_areas = np.cumsum(room_areas / room_areas.sum())
    cumulative_probabilities = cumulative_areas / cumulative_areas[-1]
    mean_piece_area = area / (_PIECES_PER_ROOM * len(inner_rooms))
    failure_count = 0
    furniture: list[Obstacle] = []
    remaining_area = area
    while remaining_area > max_area_error:
        room = int(np.searchsorted(cumulative_probabilities, rng.random(), side="right"))
        shrinkage = max(_MIN_SHRINKAGE, _FAILURE_SHRINKAGE**failure_count)
        area_ratio = rng.uniform(_MIN_PIECE_AREA_RATIO, _MAX_PIECE_AREA_RATIO)
        piece_area = min(remaining_area, mean_piece_area * area_ratio * shrinkage)
        piece = _sample_piece(request, piece_area, rng)
        obstacle = _place_piece(request, piece, inner_rooms[room], occupied[room], start_disc, rng)
        if obstacle is None:
            failure_count += 1
            if failure_count == _MAX_FAILURES:
                return None
        else:
            failure_count = 0
            occupied[room].append(obstacle.polygon)
            furniture.append(obstacle)
            remaining_area -= obstacle.polygon.area
    return furniture


def _list_door_openings(plan: FloorPlan) -> list[list[Polygon]]:
    """List the door openings of each room. A door opening belongs to both of its rooms."""
    openings: list[list[Polygon]] = [[] for _ in plan.rooms]
    for door in plan.doors:
        opening = door.wall.build_section(door.start, door.end, plan.wall_thickness)
        for room in door.rooms:
            openings[room].append(opening.polygon)
    return openings


def _shrink_to_wall_faces(request: MapRequest, room: Box, thickness: float) -> Box:
    """Return the part of a room between the faces of its walls. The boundary has no thickness."""
    half_thickness = thickness / 2.0
    left = room.left if room.left == 0.0 else room.left + half_thickness
    bottom = room.bottom if room.bottom == 0.0 else room.bottom + half_thickness
    right = room.right if room.right == request.width else room.right - half_thickness
    top = room.top if room.top == request.height else room.top - half_thickness
    edges = (left, bottom, right, top)
    return Box(*(round(float(edge), request.decimals) for edge in edges))


class _FurniturePiece(NamedTuple):
    """A piece of furniture.

    Attributes
    ----------
    kind : str
        A key of `_PIECE_PROBABILITIES`.
    size : (2,) array, m
        Width and height of the bounding box.
    """

    kind: str
    size: FloatArray

    @property
    def is_round(self) -> bool:
        """Whether the piece is a circle."""
        return self.kind == "round table"


def _sample_piece(request: MapRequest, area: float, rng: np.random.Generator) -> _FurniturePiece:
    """Sample a random piece of furniture of about the given area, m²."""
    kind = str(rng.choice(list(_PIECE_PROBABILITIES), p=list(_PIECE_PROBABILITIES.values())))
    min_stretch, max_stretch = _CABINET_STRETCH if kind == "cabinet" else _TABLE_STRETCH
    stretch = rng.uniform(min_stretch, max_stretch)
    length = math.sqrt(area * stretch)
    depth = math.sqrt(area / stretch)
    size = np.array([length, depth] if rng.random() < 0.5 else [depth, length])
    if kind == "round table":
        size = np.full(2, 2.0 * math.sqrt(area / math.pi))
    min_side = _MIN_PIECE_ROUNDING_STEPS * request.rounding_step
    return _FurniturePiece(kind, np.maximum(request.round_points(size), min_side))


def _sample_piece_corners(
    request: MapRequest, piece: _FurniturePiece, room: Box, rng: np.random.Generator
) -> FloatArray | None:
    """Sample positions of a piece in a room at which the piece touches each wall or keeps the gap from it.

    A cabinet stands against a wall with its longer side. A round table touches no wall.

    Returns
    -------
    (k, 2) array or None, m
        Lower left corners of the piece's bounding box. None if the piece is larger than the room.
    """
    room_low = np.array([room.left, room.bottom])
    room_high = np.array([room.right, room.top])
    free_size = room_high - room_low - piece.size
    if (free_size < 0.0).any():
        return None
    offsets = rng.random((_CANDIDATES_PER_PIECE, 2)) * free_size
    if piece.kind == "cabinet":
        # The axis perpendicular to the longer side, on which the cabinet stands at either end of the room.
        axis = 1 if piece.size[0] > piece.size[1] else 0
        offsets[:, axis] = free_size[axis] * rng.integers(0, 2, _CANDIDATES_PER_PIECE)
    corners = request.round_points(offsets + room_low)
    gaps_to_walls = np.column_stack([corners - room_low, room_high - corners - piece.size])
    is_valid = gaps_to_walls >= request.gap
    if not piece.is_round:
        # A round table would touch a wall in a single point. All other pieces may touch walls.
        is_touching = gaps_to_walls < request.rounding_step / 2.0
        is_valid |= is_touching
    return corners[is_valid.all(axis=1)]


def _place_piece(
    request: MapRequest,
    piece: _FurniturePiece,
    room: Box,
    occupied: list[Polygon],
    start_disc: Polygon,
    rng: np.random.Generator,
) -> CircleObstacle | PolygonObstacle | None:
    """Place a piece of furniture at a random position in a room; return None if no free position is found.

    Several positions are tested. A position is free if the piece does not touch the start disc and keeps the
    gap from doors and from the other pieces, whose polygons are `occupied`.
    """
    # Lower left corners, upper right corners and centers of the piece at all positions, (k, 2) m each.
    lower_left = _sample_piece_corners(request, piece, room, rng)
    if lower_left is None:
        return None
    upper_right = request.round_points(lower_left + piece.size)
    centers = request.round_points(lower_left + piece.size / 2.0)
    # The distance of a round piece is that of its center, which must be larger by the radius.
    if piece.is_round:
        shapes = shapely.points(centers)
        # Rounding moves the center by up to half a step. The radius is made smaller by the same length.
        radius = request.round_down(piece.size[0] / 2.0 - request.rounding_step / 2.0)
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
