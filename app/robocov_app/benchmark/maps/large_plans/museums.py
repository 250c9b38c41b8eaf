"""Museums: galleries with aligned doors around an atrium, with cabinets, partitions and plinths."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import partial

import numpy as np
import shapely

from robocov.typing import FloatArray
from robocov_app.benchmark.maps.large_plans.drawing import (
    Drawing,
    build_octagon,
    build_outline,
    divide_evenly,
)
from robocov_app.benchmark.maps.plan_shapes import FloorPlan

_WALL_THICKNESS_M = 0.4
_DOOR_WIDTH_M = 1.2
_COLUMN_SIDE_M = 0.6
_COLUMN_DISTANCE_M = 3.4
_COLUMN_INSET_M = 2.4
"""Distance of the columns of an atrium from its walls."""
_ENFILADE = 0.64
"""Position of the aligned doors of galleries, as a fraction of their depth from the inner wall."""
_PORTICO_DEPTH_M = 2.4
"""Depth of the portico in front of the entrance hall."""
_PROJECTION_DEPTH_M = 1.4
"""Depth by which the corner pavilions project from the facades."""
_APSE_RADIUS_M = 4.6
_HALF_MIDDLE_GALLERY_M = 3.6
"""Half the width of the gallery between two atriums."""
_MAX_ROTUNDA_RADIUS_M = 6.4


@dataclass(frozen=True)
class _Building:
    """Sizes of a museum, m."""

    width: float
    height: float
    depth: float
    """Depth of the galleries."""
    half_hall: float
    """Half the width of the entrance hall."""

    @property
    def middle(self) -> float:
        """Position x of the axis of the building."""
        return self.width / 2.0

    @property
    def inner_right(self) -> float:
        """Position x of the right inner wall; that of the left one is the depth."""
        return self.width - self.depth

    @property
    def inner_top(self) -> float:
        """Position y of the upper inner wall; that of the lower one is the depth."""
        return self.height - self.depth


def draw_museum(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a museum; its layout selects what the galleries surround, and the shape of the building."""
    depth = rng.uniform(7.0, 8.2)
    building = _Building(
        width=rng.uniform(44.0, 54.0),
        height=rng.uniform(31.0, 36.0),
        depth=depth,
        half_hall=rng.uniform(5.0, 6.0),
    )
    drawing = Drawing()
    has_apse = layout in (1, 2)
    if has_apse:
        # A plinth in the apse.
        drawing.add_octagon(building.middle, building.height + 1.6, 0.8)
    _draw_galleries(rng, drawing, building)
    _draw_entrance(drawing, building)
    if layout == 0:
        _draw_rotunda_court(drawing, building)
    elif layout == 2:
        _draw_light_wells(rng, drawing, building)
    else:
        _draw_two_atriums(rng, drawing, building)
    floor_parts = _build_floor_parts(building, has_apse=has_apse, has_pavilions=layout != 2)
    return FloorPlan(build_outline(floor_parts), drawing.obstacles, entrance=(building.middle, 0.4))


def _build_floor_parts(building: _Building, *, has_apse: bool, has_pavilions: bool) -> list[shapely.Geometry]:
    """Build the parts of the floor: the main building, the portico, and any corner pavilions and apse."""
    width = building.width
    height = building.height
    depth = building.depth
    left = building.middle - building.half_hall
    right = building.middle + building.half_hall
    parts = [shapely.box(0.0, 0.0, width, height), shapely.box(left, -_PORTICO_DEPTH_M, right, 1.0)]
    if has_pavilions:
        for x, y in itertools.product((0.0, building.inner_right), (0.0, building.inner_top)):
            parts.append(
                shapely.box(x, y, x + depth, y + depth).buffer(_PROJECTION_DEPTH_M, join_style="mitre")
            )
    if has_apse:
        parts.append(shapely.Polygon(build_octagon(building.middle, height, _APSE_RADIUS_M)))
    return parts


def _draw_galleries(rng: np.random.Generator, drawing: Drawing, building: _Building) -> None:
    """Draw the four rows of galleries, and a plinth in each corner pavilion."""
    depth = building.depth
    # In each part, x runs along the inner wall, and y from the inner wall to the facade.
    south = drawing.open_part(0.0, depth, mirrored=True)
    north = drawing.open_part(0.0, building.inner_top)
    west = drawing.open_part(depth, 0.0, 1)
    east = drawing.open_part(building.inner_right, 0.0, 1, mirrored=True)
    _draw_entrance_row(rng, south, building)
    # The number of galleries is odd, so that the door in the middle leads to a gallery, not to a partition.
    galleries = 2 * round((building.inner_right - depth) / rng.uniform(7.0, 9.5) / 2.0 - 0.5) + 1
    partitions = np.linspace(depth, building.inner_right, galleries + 1).tolist()
    _draw_row(rng, north, partitions, depth, [building.middle])
    partitions = divide_evenly(depth, building.inner_top, rng.uniform(8.0, 10.0)).tolist()
    middle_gallery = (len(partitions) - 1) // 2
    door = (partitions[middle_gallery] + partitions[middle_gallery + 1]) / 2.0
    for part in (west, east):
        _draw_row(rng, part, partitions, depth, [door])
    plinths_x = (depth / 2.0, building.width - depth / 2.0)
    plinths_y = (depth / 2.0, building.height - depth / 2.0)
    for x, y in itertools.product(plinths_x, plinths_y):
        drawing.add_octagon(x, y, 0.9)


def _draw_entrance_row(rng: np.random.Generator, part: Drawing, building: _Building) -> None:
    """Draw the galleries on both sides of the entrance hall, and two doors in its inner wall."""
    width = rng.uniform(6.5, 8.5)
    middle = building.middle
    left = divide_evenly(building.depth, middle - building.half_hall, width).tolist()
    right = divide_evenly(middle + building.half_hall, building.inner_right, width).tolist()
    doors = [middle - 2.6, middle + 2.6]
    _draw_row(rng, part, [*left, *right], building.depth, doors, hall=middle)


def _draw_row(
    rng: np.random.Generator,
    part: Drawing,
    partitions: list[float],
    depth: float,
    inner_doors: list[float],
    *,
    hall: float | None = None,
) -> None:
    """Draw a row of galleries between the corner pavilions, with doors through all its partitions.

    Parameters
    ----------
    partitions : list of float, m
        x of the partitions.
    depth : float, m
        Depth of the galleries.
    inner_doors : list of float, m
        x of the doors in the inner wall.
    hall : float, m, or None
        x of a point in the entrance hall, which has no exhibits.
    """
    add_wall = partial(part.add_wall_with_doors, width=_DOOR_WIDTH_M, thickness=_WALL_THICKNESS_M)
    # The inner wall extends to the outer corners of the partitions.
    start = partitions[0] - _WALL_THICKNESS_M / 2.0
    end = partitions[-1] + _WALL_THICKNESS_M / 2.0
    add_wall((start, 0.0), (end, 0.0), [door - start for door in inner_doors])
    enfilade = depth * _ENFILADE
    for x in partitions:
        add_wall((x, 0.0), (x, depth), [enfilade])
    for low, high in itertools.pairwise(partitions):
        if hall is not None and low < hall < high:
            continue
        # The exhibits leave the line of the doors free.
        gallery = part.open_part((low + high) / 2.0, (enfilade - 1.0) / 2.0)
        _draw_exhibits(rng, gallery, high - low - 2.4, enfilade - 2.6)


def _draw_exhibits(rng: np.random.Generator, part: Drawing, width: float, depth: float) -> None:
    """Draw exhibits in a rectangle around the origin: cabinets, partitions, or a plinth with benches."""
    right = width / 2.0
    top = depth / 2.0
    choice = int(rng.integers(0, 4))
    if choice == 0:
        for x, y in itertools.product((0.6 - right, right - 0.6), (0.3 - top, top)):
            part.add_centered_block(x, y, 1.2, 0.6)
    elif choice == 1:
        # Two partitions for paintings.
        part.add_wall((-right, -top / 2.0), (width * 0.1, -top / 2.0), thickness=0.3)
        part.add_wall((width * 0.1, top - 0.1), (right, top - 0.1), thickness=0.3)
    elif choice == 2:
        part.add_octagon(0.0, 0.0, 0.8)
        part.add_centered_block(0.2 - right, 0.0, 0.5, 1.8)
        part.add_centered_block(right - 0.2, 0.0, 0.5, 1.8)
    else:
        # Partitions at a right angle, and a plinth.
        part.add_wall((-right / 2.0, -top), (-right / 2.0, top), (right / 2.0, top), thickness=0.3)
        part.add_octagon(right / 2.0, -top / 2.0, 0.5)


def _draw_entrance(drawing: Drawing, building: _Building) -> None:
    """Draw the columns of the portico, and in the entrance hall a ticket desk and a cloakroom."""
    left = building.middle - building.half_hall
    right = building.middle + building.half_hall
    for x in np.linspace(left + 1.0, right - 1.0, 4).tolist():
        drawing.add_centered_block(x, -1.4, _COLUMN_SIDE_M, _COLUMN_SIDE_M)
    drawing.add_centered_block(building.middle, building.depth - 2.6, 3.0, 0.8)
    drawing.add_block(left, building.depth - 1.6, left + 0.8, building.depth)


def _draw_two_atriums(rng: np.random.Generator, drawing: Drawing, building: _Building) -> None:
    """Draw an atrium on either side of a gallery in the middle."""
    bottom = building.depth
    top = building.inner_top
    left = building.middle - _HALF_MIDDLE_GALLERY_M
    right = building.middle + _HALF_MIDDLE_GALLERY_M
    for x in (left, right):
        drawing.add_wall_with_doors(
            (x, bottom), (x, top), [(top - bottom) / 2.0], width=_DOOR_WIDTH_M, thickness=_WALL_THICKNESS_M
        )
    for shift in (3.4, -3.4):
        _draw_exhibits(rng, drawing.open_part(building.middle, building.height / 2.0 + shift), 4.0, 4.0)
    _draw_atrium(drawing, building, building.depth, left)
    _draw_atrium(drawing, building, right, building.inner_right)


def _draw_light_wells(rng: np.random.Generator, drawing: Drawing, building: _Building) -> None:
    """Draw an atrium between two closed light wells."""
    width = rng.uniform(5.0, 6.0)
    left = building.depth + 1.8
    right = building.inner_right - 1.8
    for x in (left, right - width):
        drawing.add_block(x, building.depth + 2.2, x + width, building.inner_top - 2.2)
    _draw_atrium(drawing, building, left + width + 0.4, right - width - 0.4)


def _draw_atrium(drawing: Drawing, building: _Building, left: float, right: float) -> None:
    """Draw an atrium: columns along its sides, and a sculpture in its middle."""
    inset = _COLUMN_INSET_M
    columns_x = divide_evenly(left + inset, right - inset, _COLUMN_DISTANCE_M).tolist()
    lowest = building.depth + inset
    highest = building.inner_top - inset
    columns_y = divide_evenly(lowest, highest, _COLUMN_DISTANCE_M).tolist()
    for x, y in itertools.product(columns_x, (columns_y[0], columns_y[-1])):
        drawing.add_centered_block(x, y, _COLUMN_SIDE_M, _COLUMN_SIDE_M)
    for y, x in itertools.product(columns_y[1:-1], (columns_x[0], columns_x[-1])):
        drawing.add_centered_block(x, y, _COLUMN_SIDE_M, _COLUMN_SIDE_M)
    drawing.add_octagon((left + right) / 2.0, building.height / 2.0, 1.3)


def _draw_rotunda_court(drawing: Drawing, building: _Building) -> None:
    """Draw a rotunda around a sculpture in the middle of a court, and a row of columns on either side."""
    middle = building.middle
    half_height = (building.inner_top - building.depth) / 2.0
    _draw_rotunda(
        drawing.open_part(middle, building.height / 2.0), min(_MAX_ROTUNDA_RADIUS_M, half_height - 1.6)
    )
    drawing.add_octagon(middle, building.height / 2.0, 1.2)
    distance = (middle - _MAX_ROTUNDA_RADIUS_M - building.depth) / 2.0
    for x in (building.depth + distance, building.inner_right - distance):
        for y in divide_evenly(building.depth, building.inner_top, 4.4)[1:-1].tolist():
            drawing.add_centered_block(x, y, _COLUMN_SIDE_M, _COLUMN_SIDE_M)


def _draw_rotunda(part: Drawing, radius: float) -> None:
    """Draw an octagonal wall with doors on four sides around the origin."""
    corners = np.array(build_octagon(0.0, 0.0, radius))
    for number in range(0, 8, 2):
        # Each piece of the wall is a whole side, with the parts of both adjacent sides up to their doors.
        first = corners[number]
        second = corners[number + 1]
        start = _stop_at_door(first, corners[number - 1])
        end = _stop_at_door(second, corners[(number + 2) % 8])
        points = [(float(x), float(y)) for x, y in (start, first, second, end)]
        part.add_wall(*points, thickness=_WALL_THICKNESS_M)


def _stop_at_door(corner: FloatArray, next_corner: FloatArray) -> FloatArray:
    """Return the point where the wall from a corner ends, at the door in the middle of the side."""
    side = next_corner - corner
    length = float(np.hypot(*side))
    return corner + side * ((length - _DOOR_WIDTH_M) / 2.0 / length)
