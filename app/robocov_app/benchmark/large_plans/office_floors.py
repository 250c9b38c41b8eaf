"""Office floors: a core with lifts and stairs, a corridor around it, cells, meeting rooms and open spaces."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from robocov.arrays import Array
from robocov_app.benchmark.large_plans.drawing import Drawing, build_outline, divide_evenly
from robocov_app.benchmark.plan_shapes import FloorPlan

_CORE_WALL_M = 0.25
"""Thickness of the walls around the core."""
_COLUMN_M = 0.5
_LOBBY_WIDTH_M = 3.2
_LIFT_WIDTH_M = 2.2
_LIFT_DEPTH_M = 2.4
_DESK_DEPTH_M = 1.6
"""Depth of two desks that face each other."""
_DESK_WIDTH_M = 1.6
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
    return FloorPlan(build_outline([outline]), drawing.obstacles, (floor.width / 2.0, floor.height / 2.0))


def _choose_recess(rng: np.random.Generator, floor: _Floor, layout: int) -> shapely.Geometry:
    """Return what is missing from the rectangular floor: corners, a recess in the facade, or nothing."""
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
    """Draw the core: a lift lobby between two banks of lifts, and rooms on both sides in two rows."""
    left, bottom, right, top = floor.core
    middle_x = (left + right) / 2.0
    middle_y = (bottom + top) / 2.0
    bank_left = middle_x - _LOBBY_WIDTH_M / 2.0 - _LIFT_DEPTH_M
    bank_right = middle_x + _LOBBY_WIDTH_M / 2.0 + _LIFT_DEPTH_M
    lifts = int((top - bottom - 1.0) / _LIFT_WIDTH_M)
    for side in (-1, 1):
        lobby_x = middle_x + side * _LOBBY_WIDTH_M / 2.0
        drawing.add_polygon(_outline_lifts(lobby_x, side, bottom, top, lifts))
    for end, inner, direction in ((left, bank_left, 1.0), (right, bank_right, -1.0)):
        length = abs(inner - end)
        drawing.add_wall((end, bottom), (end, top), thickness=_CORE_WALL_M)
        drawing.add_wall((end, middle_y), (inner, middle_y), thickness=_CORE_WALL_M)
        for edge, is_upper in ((bottom, False), (top, True)):
            # The origin is at the outer end of the row, on the corridor; y goes towards the middle.
            turned = direction < 0.0
            mirrored = is_upper != turned
            part = drawing.open_part(end, edge, 2 if turned else 0, mirrored=mirrored)
            has_stairs = is_upper == turned
            _draw_core_row(rng, part, length, abs(middle_y - edge), has_stairs=has_stairs)


def _outline_lifts(
    lobby_x: float, side: int, bottom: float, top: float, lifts: int
) -> list[tuple[float, float]]:
    """Return the outline of a solid bank of lifts, with a niche in front of the door of each lift."""
    back_x = lobby_x + side * _LIFT_DEPTH_M
    points = [(back_x, bottom), (lobby_x, bottom)]
    pitch = (top - bottom) / lifts
    for number in range(lifts):
        middle = bottom + (number + 0.5) * pitch
        niche_x = lobby_x + side * 0.35
        points += [
            (lobby_x, middle - 0.6),
            (niche_x, middle - 0.6),
            (niche_x, middle + 0.6),
            (lobby_x, middle + 0.6),
        ]
    return [*points, (lobby_x, top), (back_x, top)]


def _draw_core_row(
    rng: np.random.Generator, part: Drawing, length: float, depth: float, *, has_stairs: bool
) -> None:
    """Draw a row of rooms from the outer end of the core to the lifts: stairs or toilets, and others."""
    first = 3.2 if has_stairs else 3.8
    partitions = [0.0, first, *divide_evenly(first, length, 4.2)[1:].tolist()]
    doors = [(low + high) / 2.0 for low, high in itertools.pairwise(partitions)]
    doors[0] = 0.9
    part.add_wall_with_doors((0.0, 0.0), (length, 0.0), doors, thickness=_CORE_WALL_M)
    for x in partitions[1:-1]:
        part.add_wall((x, 0.0), (x, depth))
    if has_stairs:
        # Two flights around an eye, and a landing in front of them.
        part.add_block(0.0, 1.6, 1.35, depth)
        part.add_block(1.85 + 0.3, 1.6, first, depth)
        part.add_block(1.3, depth - 1.3, 2.2, depth)
    else:
        # Two rows of cubicles, with washbasins in between.
        part.add_block(0.0, depth - 1.5, first, depth)
        part.add_block(first - 0.6, 0.0, first, depth - 2.4)
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
    width = floor.width
    height = floor.height
    depth = floor.depth
    # In each part, x runs along the corridor, and y from the corridor to the facade.
    south = drawing.open_part(0.0, depth, mirrored=True)
    north = drawing.open_part(0.0, height - depth)
    west = drawing.open_part(depth, depth, 1)
    east = drawing.open_part(width - depth, depth, 1, mirrored=True)
    side_length = height - 2.0 * depth
    corner = depth + floor.corridor
    for name, part in (("south", south), ("north", north)):
        if uses[name] == "open":
            _draw_open_space(rng, part, width, depth, recess, has_ends=True)
            continue
        inner = divide_evenly(corner, width - corner, rng.uniform(3.4, 4.2))
        doors = [(low + high) / 2.0 for low, high in itertools.pairwise(inner)]
        doors = [corner - floor.corridor / 2.0, *doors, width - corner + floor.corridor / 2.0]
        _draw_cells(rng, part, np.array([0.0, *inner, width]), depth, doors)
    for name, part in (("west", west), ("east", east)):
        if uses[name] == "open":
            _draw_open_space(rng, part, side_length, depth, recess, has_ends=False)
            continue
        room_width = 3.6 if uses[name] == "cells" else 5.8
        partitions = divide_evenly(0.0, side_length, room_width)
        doors = [(low + high) / 2.0 for low, high in itertools.pairwise(partitions)]
        if uses[name] == "cells":
            _draw_cells(rng, part, partitions, depth, doors)
        else:
            _draw_meeting_rooms(part, partitions, depth, doors)
        # Walls towards the rooms in the corners, unless they belong to closed rooms.
        for x, neighbor in ((0.0, "south"), (side_length, "north")):
            if uses[neighbor] == "open":
                part.add_wall((x, 0.0), (x, depth))


def _draw_cells(
    rng: np.random.Generator, part: Drawing, partitions: Array, depth: float, doors: Sequence[float]
) -> None:
    """Draw a row of cells, with a desk near the facade and sometimes a cupboard."""
    part.add_wall_with_doors((partitions[0], 0.0), (partitions[-1], 0.0), doors)
    for x in partitions[1:-1]:
        part.add_wall((x, 0.0), (x, depth))
    for low, high in itertools.pairwise(partitions):
        middle = (low + high) / 2.0
        if rng.random() < 0.75:
            part.add_centered_block(middle, depth - 2.2, 1.6, 1.6 if high - low > 5.0 else 0.8)
        else:
            part.add_block(low, 2.0, low + 0.6, depth - 1.6)


def _draw_meeting_rooms(part: Drawing, partitions: Array, depth: float, doors: Sequence[float]) -> None:
    """Draw a row of meeting rooms, with a table in the middle."""
    part.add_wall_with_doors((partitions[0], 0.0), (partitions[-1], 0.0), doors)
    for x in partitions[1:-1]:
        part.add_wall((x, 0.0), (x, depth))
    for low, high in itertools.pairwise(partitions):
        part.add_centered_block((low + high) / 2.0, depth / 2.0, 1.4, depth - 3.4)


def _draw_open_space(
    rng: np.random.Generator,
    part: Drawing,
    length: float,
    depth: float,
    recess: shapely.Geometry,
    *,
    has_ends: bool,
) -> None:
    """Draw an open space: columns along the corridor, benches of desks across, and low shelves between."""
    for x in divide_evenly(0.0, length, 7.2)[1:-1]:
        part.add_centered_block(x, 0.3, _COLUMN_M, _COLUMN_M)
    pitch = rng.uniform(3.4, 3.9)
    benches = int((length - 2.0) / pitch)
    first = (length - (benches - 1) * pitch) / 2.0
    for number in range(benches):
        x = first + number * pitch
        draw = rng.random()
        bench_end = depth - 0.9
        bench_start = bench_end - _DESK_WIDTH_M * (3 if depth > 6.9 else 2.5)
        place = shapely.box(x - 1.1, 0.0, x + 1.1, depth)
        plan_place = shapely.Polygon(part.to_plan(place.exterior.coords[:-1]))
        if not recess.is_empty and plan_place.distance(recess) < 0.7:
            continue
        if has_ends and 0 < number < benches - 1 and number % 5 == 2:
            # A bench is replaced by a telephone box and a round table.
            part.add_block(x - 1.1, depth - 1.2, x + 1.1, depth)
            part.add_octagon(x, depth - 3.6, 0.7)
            continue
        if draw < 0.25:
            bench_start += _DESK_WIDTH_M
        part.add_block(x - _DESK_DEPTH_M / 2.0, bench_start, x + _DESK_DEPTH_M / 2.0, bench_end)
