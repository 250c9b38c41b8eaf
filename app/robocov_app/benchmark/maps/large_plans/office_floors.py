"""Office floors: a core with elevators and stairs, a corridor, cells, meeting rooms and open spaces."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from robocov.environment import Point
from robocov_app.benchmark.maps.large_plans.drawing import Drawing, build_outline, divide_evenly
from robocov_app.benchmark.maps.plan_shapes import FloorPlan, build_box

_CORE_WALL_M = 0.25
"""Thickness of the walls around the core."""
_COLUMN_SIDE_M = 0.5
_LOBBY_WIDTH_M = 3.2
_ELEVATOR_WIDTH_M = 2.2
_ELEVATOR_DEPTH_M = 2.4
_ELEVATOR_DOOR_M = 1.2
_ELEVATOR_NICHE_M = 0.35
"""Depth of the niche in front of the door of an elevator."""
_DESK_DEPTH_M = 1.6
"""Depth of two desks that face each other."""
_DESK_WIDTH_M = 1.6
_DESK_PROBABILITY = 0.75
"""Probability that a cell has a desk instead of a cupboard."""
_CELL_WIDTH_M = 3.6
_LARGE_CELL_M = 5.0
"""Width of a cell above which it has two desks."""
_MEETING_ROOM_WIDTH_M = 5.8
_COLUMN_DISTANCE_M = 7.2
_SHORT_BENCH_PROBABILITY = 0.25
_RECESS_MARGIN_M = 0.7
"""Minimum distance of furniture from a recess in the facade."""
_LONG_SPACE_M = 30.0
"""Length above which an open space has phone boothes."""
_USES = (
    {"south": "open", "north": "cells", "west": "cells", "east": "meeting"},
    {"south": "open", "north": "cells", "west": "open", "east": "meeting"},
    {"south": "open", "north": "open", "west": "cells", "east": "meeting"},
    {"south": "cells", "north": "open", "west": "meeting", "east": "open"},
)
"""Use of the four sides, by layout."""


@dataclass(frozen=True)
class _Floor:
    """Sizes of an office floor, m."""

    width: float
    height: float
    depth: float
    """Depth of the rooms along the facades."""
    corridor: float
    """Width of the corridor."""

    @property
    def core(self) -> tuple[float, float, float, float]:
        """Left, bottom, right and top of the core."""
        margin = self.depth + self.corridor
        return margin, margin, self.width - margin, self.height - margin


def draw_office_floor(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw an office floor; its layout selects the use of the four sides and the shape of the floor."""
    floor = _Floor(
        width=rng.uniform(40.0, 54.0),
        height=rng.uniform(31.0, 36.0),
        depth=rng.uniform(6.6, 7.4),
        corridor=rng.uniform(1.8, 2.2),
    )
    drawing = Drawing()
    _draw_core(rng, drawing, floor)
    recess = _choose_recess(rng, floor, layout)
    _draw_sides(rng, drawing, floor, _USES[layout], recess)
    outline = shapely.box(0.0, 0.0, floor.width, floor.height) - recess
    center = (floor.width / 2.0, floor.height / 2.0)
    return FloorPlan(build_outline([outline]), drawing.obstacles, entrance=center)


def _choose_recess(rng: np.random.Generator, floor: _Floor, layout: int) -> shapely.Geometry:
    """Choose the area cut from the rectangular floor: two corners, a recess in the facade, or nothing."""
    width = floor.width
    height = floor.height
    cut = rng.uniform(2.6, 3.4)
    if layout == 0:
        return shapely.Polygon()
    if layout == 1:
        left = shapely.Polygon([(0.0, 0.0), (cut, 0.0), (0.0, cut)])
        right = shapely.Polygon([(width, 0.0), (width, cut), (width - cut, 0.0)])
        return left | right
    if layout == 2:
        left_end = width * rng.uniform(0.36, 0.42)
        return shapely.box(left_end, 0.0, left_end + rng.uniform(8.0, 10.0), cut)
    left = shapely.box(0.0, height - cut, cut, height)
    right = shapely.box(width - cut, height - cut, width, height)
    return left | right


def _draw_core(rng: np.random.Generator, drawing: Drawing, floor: _Floor) -> None:
    """Draw the core: a lobby between two banks of elevators, and rooms on both sides in two rows."""
    left, bottom, right, top = floor.core
    middle_x = (left + right) / 2.0
    for side in (-1, 1):
        lobby_x = middle_x + side * _LOBBY_WIDTH_M / 2.0
        drawing.add_polygon(_outline_elevators(lobby_x, side, bottom, top))
    for is_right, end in ((False, left), (True, right)):
        _draw_core_end(rng, drawing, floor, end, is_right=is_right)


def _draw_core_end(
    rng: np.random.Generator, drawing: Drawing, floor: _Floor, end: float, *, is_right: bool
) -> None:
    """Draw the rooms between the elevators and one end of the core, whose x is `end`."""
    left, bottom, right, top = floor.core
    middle_y = (bottom + top) / 2.0
    side = 1 if is_right else -1
    inner = (left + right) / 2.0 + side * (_LOBBY_WIDTH_M / 2.0 + _ELEVATOR_DEPTH_M)
    drawing.add_wall((end, bottom), (end, top), thickness=_CORE_WALL_M)
    drawing.add_wall((end, middle_y), (inner, middle_y), thickness=_CORE_WALL_M)
    for edge, is_upper in ((bottom, False), (top, True)):
        # The origin is at the end of the core, on the corridor; y is the distance from the corridor.
        quarter_turns = 2 if is_right else 0
        part = drawing.open_part(end, edge, quarter_turns, mirrored=is_upper != is_right)
        has_stairs = is_upper == is_right
        _draw_core_row(rng, part, abs(inner - end), abs(middle_y - edge), has_stairs=has_stairs)


def _outline_elevators(lobby_x: float, side: int, bottom: float, top: float) -> list[Point]:
    """Return the outline of a solid bank of elevators, with a niche in front of the door of each elevator.

    The bank is on the left of the lobby if `side` is -1, and on its right if `side` is 1.
    """
    elevators = int((top - bottom - 1.0) / _ELEVATOR_WIDTH_M)
    back_x = lobby_x + side * _ELEVATOR_DEPTH_M
    points = [(back_x, bottom), (lobby_x, bottom)]
    pitch = (top - bottom) / elevators
    for number in range(elevators):
        middle = bottom + (number + 0.5) * pitch
        low = middle - _ELEVATOR_DOOR_M / 2.0
        high = middle + _ELEVATOR_DOOR_M / 2.0
        niche_x = lobby_x + side * _ELEVATOR_NICHE_M
        points += [(lobby_x, low), (niche_x, low), (niche_x, high), (lobby_x, high)]
    return [*points, (lobby_x, top), (back_x, top)]


def _draw_core_row(
    rng: np.random.Generator, part: Drawing, length: float, depth: float, *, has_stairs: bool
) -> None:
    """Draw a row of rooms from the end of the core to the elevators; the first has stairs or toilets."""
    first_end = 3.2 if has_stairs else 3.8
    partitions = [0.0, first_end, *divide_evenly(first_end, length, 4.2)[1:].tolist()]
    doors = _find_middles(partitions)
    doors[0] = 0.9
    part.add_wall_with_doors((0.0, 0.0), (length, 0.0), doors, thickness=_CORE_WALL_M)
    part.add_partitions(partitions[1:-1], depth)
    if has_stairs:
        # Two flights of stairs, a passage between them, and the landing behind.
        part.add_block(0.0, 1.6, 1.35, depth)
        part.add_block(2.15, 1.6, first_end, depth)
        part.add_block(1.3, depth - 1.3, 2.2, depth)
    else:
        # A row of cubicles and a row of washbasins.
        part.add_block(0.0, depth - 1.5, first_end, depth)
        part.add_block(first_end - 0.6, 0.0, first_end, depth - 2.4)
    # The furniture of the other rooms is in the middle or along the back wall.
    for low, high in itertools.pairwise(partitions[1:]):
        middle = (low + high) / 2.0
        if rng.random() < 0.5:
            part.add_centered_block(middle, depth * 0.55, 1.2, min(2.6, depth - 3.0))
        else:
            part.add_block(low, depth - 0.6, high, depth)


def _draw_sides(
    rng: np.random.Generator, drawing: Drawing, floor: _Floor, uses: dict[str, str], recess: shapely.Geometry
) -> None:
    """Draw the four sides; those in the south and north include the corners of the floor."""
    depth = floor.depth
    far_x = floor.width - depth
    far_y = floor.height - depth
    # In each part, x runs along the corridor, and y from the corridor to the facade.
    south = drawing.open_part(0.0, depth, mirrored=True)
    north = drawing.open_part(0.0, far_y)
    west = drawing.open_part(depth, depth, 1)
    east = drawing.open_part(far_x, depth, 1, mirrored=True)
    for name, part in (("south", south), ("north", north)):
        if uses[name] == "open":
            _draw_open_space(rng, part, floor.width, depth, recess)
        else:
            _draw_cells_with_corners(rng, part, floor)
    for name, part in (("west", west), ("east", east)):
        length = far_y - depth
        if uses[name] == "open":
            _draw_open_space(rng, part, length, depth, recess)
            continue
        if uses[name] == "cells":
            partitions = divide_evenly(0.0, length, _CELL_WIDTH_M).tolist()
            _draw_cells(rng, part, partitions, _find_middles(partitions), depth)
        else:
            partitions = divide_evenly(0.0, length, _MEETING_ROOM_WIDTH_M).tolist()
            _draw_meeting_rooms(part, partitions, depth)
        # These rooms need a wall toward an open space in the corner.
        for x, neighbor in ((0.0, "south"), (length, "north")):
            if uses[neighbor] == "open":
                part.add_wall((x, 0.0), (x, depth))


def _find_middles(partitions: Sequence[float]) -> list[float]:
    """Return the middle of each room between partitions."""
    return [(low + high) / 2.0 for low, high in itertools.pairwise(partitions)]


def _draw_cells_with_corners(rng: np.random.Generator, part: Drawing, floor: _Floor) -> None:
    """Draw a row of cells with a room in each corner, whose door is at the end of a corridor."""
    corner = floor.depth + floor.corridor
    inner = divide_evenly(corner, floor.width - corner, rng.uniform(3.4, 4.2)).tolist()
    corner_door = corner - floor.corridor / 2.0
    doors = [corner_door, *_find_middles(inner), floor.width - corner_door]
    _draw_cells(rng, part, [0.0, *inner, floor.width], doors, floor.depth)


def _draw_cells(
    rng: np.random.Generator, part: Drawing, partitions: Sequence[float], doors: Sequence[float], depth: float
) -> None:
    """Draw a row of cells, with a desk near the facade, or a cupboard."""
    part.add_wall_with_doors((0.0, 0.0), (partitions[-1], 0.0), doors)
    part.add_partitions(partitions[1:-1], depth)
    for low, high in itertools.pairwise(partitions):
        middle = (low + high) / 2.0
        if rng.random() < _DESK_PROBABILITY:
            desk_depth = 1.6 if high - low > _LARGE_CELL_M else 0.8
            part.add_centered_block(middle, depth - 2.2, _DESK_WIDTH_M, desk_depth)
        else:
            part.add_block(low, 2.0, low + 0.6, depth - 1.6)


def _draw_meeting_rooms(part: Drawing, partitions: Sequence[float], depth: float) -> None:
    """Draw a row of meeting rooms, with a table in the middle."""
    middles = _find_middles(partitions)
    part.add_wall_with_doors((0.0, 0.0), (partitions[-1], 0.0), middles)
    part.add_partitions(partitions[1:-1], depth)
    for middle in middles:
        part.add_centered_block(middle, depth / 2.0, 1.4, depth - 3.4)


def _draw_open_space(
    rng: np.random.Generator, part: Drawing, length: float, depth: float, recess: shapely.Geometry
) -> None:
    """Draw an open space: columns along the corridor, and rows of desks at right angles to it.

    In a long open space, some rows are replaced by a phone booth and a round table. There are no desks near
    the recess in the facade.
    """
    for x in divide_evenly(0.0, length, _COLUMN_DISTANCE_M)[1:-1].tolist():
        part.add_centered_block(x, 0.3, _COLUMN_SIDE_M, _COLUMN_SIDE_M)
    pitch = rng.uniform(3.4, 3.9)
    benches = int((length - 2.0) / pitch)
    first_x = (length - (benches - 1) * pitch) / 2.0
    end = depth - 0.9
    for number in range(benches):
        x = first_x + number * pitch
        # Sampled even if it is not used, so that the random numbers that follow do not depend on the recess.
        is_short = rng.random() < _SHORT_BENCH_PROBABILITY
        space = part.to_plan(build_box(x - 1.1, 0.0, x + 1.1, depth))
        if not recess.is_empty and shapely.Polygon(space).distance(recess) < _RECESS_MARGIN_M:
            continue
        if length > _LONG_SPACE_M and 0 < number < benches - 1 and number % 5 == 2:
            part.add_block(x - 1.1, depth - 1.2, x + 1.1, depth)
            part.add_octagon(x, depth - 3.6, 0.7)
            continue
        desks = 3.0 if depth > 6.9 else 2.5
        if is_short:
            desks -= 1.0
        start = end - _DESK_WIDTH_M * desks
        part.add_block(x - _DESK_DEPTH_M / 2.0, start, x + _DESK_DEPTH_M / 2.0, end)
