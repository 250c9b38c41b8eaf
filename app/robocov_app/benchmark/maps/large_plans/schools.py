"""Schools: classrooms with rows of desks in wings, along a hall with a gym and an assembly hall."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import shapely

from robocov.environment import Point
from robocov_app.benchmark.maps.large_plans.drawing import Drawing, build_outline
from robocov_app.benchmark.maps.plan_shapes import FloorPlan, build_box

_WALL_THICKNESS_M = 0.2
_CORRIDOR_WIDTH_M = 2.6
_DOOR_WIDTH_M = 1.0
_HALL_DOOR_WIDTH_M = 1.2
_CLASS_LENGTH_M = 8.8
_CLASS_DEPTH_M = 6.8
_CLASS_DOOR_M = 1.2
"""Distance of the middle of a door from the wall with the board."""
_DESK_DEPTH_M = 0.5
_DESK_WIDTH_M = 2.3
_DESK_OFFSET_M = 1.65
"""Distance of the middles of desks from the aisle in the middle of the room."""
_FIRST_ROW_M = 3.2
"""Distance of the first row of desks from the wall with the board."""
_FOUR_ROWS_PROBABILITY = 0.35
_FOUR_ROWS_PITCH_M = 1.6
_THREE_ROWS_PITCH_M = 2.0
_STAIRS_LENGTH_M = 2.6
"""Length of the stairs at the end of a wing."""
_STORAGE_WIDTH_M = 3.2
"""Width of the storage room of the gym."""
_DOUBLE_WING_WIDTH_M = 2.0 * _CLASS_DEPTH_M + _CORRIDOR_WIDTH_M
"""Width of a wing with classrooms on both sides of its corridor."""
_SINGLE_WING_WIDTH_M = _CLASS_DEPTH_M + _CORRIDOR_WIDTH_M
"""Width of a wing with classrooms on one side of its corridor."""
_CLASSES = 2
"""Number of classrooms along a wing."""
_WING_LENGTH_M = _CLASSES * _CLASS_LENGTH_M

_Layout: TypeAlias = tuple[list[shapely.Geometry], Point]
"""Shapes whose union is the floor, and the entrance."""


def draw_school(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a school: a hall with a gym at its end, and wings in a comb, a Z, an E, or around a yard."""
    drawing = Drawing()
    hall_depth = rng.uniform(4.2, 5.2)
    draw_layout: Callable[..., _Layout] = (_draw_comb, _draw_z, _draw_e, _draw_yard)[layout]
    shapes, entrance = draw_layout(rng, drawing, hall_depth)
    return FloorPlan(build_outline(shapes), drawing.obstacles, entrance=entrance)


def _draw_comb(rng: np.random.Generator, drawing: Drawing, hall_depth: float) -> _Layout:
    """Draw two wings above the hall, with classrooms on both sides, and the common rooms below it."""
    yard_width = rng.uniform(8.0, 11.0)
    right_wing_left = _DOUBLE_WING_WIDTH_M + yard_width
    length = right_wing_left + _DOUBLE_WING_WIDTH_M
    depth = rng.uniform(12.0, 13.0)
    shapes: list[shapely.Geometry] = [shapely.box(0.0, -depth, length, hall_depth)]
    for left in (0.0, right_wing_left):
        wing = drawing.open_part(left + _DOUBLE_WING_WIDTH_M / 2.0, hall_depth, 1)
        shapes.append(_draw_double_wing(rng, wing))
    _draw_common_rooms(rng, drawing, length, depth)
    _draw_benches(drawing, _DOUBLE_WING_WIDTH_M + 1.0, right_wing_left - 1.0, hall_depth)
    return shapes, (length * 0.55, hall_depth / 2.0)


def _draw_z(rng: np.random.Generator, drawing: Drawing, hall_depth: float) -> _Layout:
    """Draw a wing above the left end of the hall, and one below its right end, next to the gym."""
    length = _DOUBLE_WING_WIDTH_M + rng.uniform(26.0, 29.0)
    upper = drawing.open_part(_DOUBLE_WING_WIDTH_M / 2.0, hall_depth, 1)
    lower = drawing.open_part(length - _DOUBLE_WING_WIDTH_M / 2.0, 0.0, 3)
    shapes = [
        shapely.box(0.0, 0.0, length, hall_depth),
        _draw_double_wing(rng, upper),
        _draw_double_wing(rng, lower),
    ]
    depth = rng.uniform(12.0, 14.0)
    gym_length = length - _DOUBLE_WING_WIDTH_M - 3.0
    shapes.append(shapely.box(0.0, -depth, gym_length, 1.0))
    _draw_gym_and_assembly_hall(drawing, gym_length, depth)
    rooms_left = _DOUBLE_WING_WIDTH_M + 2.0
    shapes.append(_draw_classrooms(rng, drawing.open_part(rooms_left, hall_depth), _CLASSES))
    _draw_benches(drawing, rooms_left, length - rooms_left, hall_depth)
    return shapes, (_DOUBLE_WING_WIDTH_M + 3.0, hall_depth / 2.0)


def _draw_e(rng: np.random.Generator, drawing: Drawing, hall_depth: float) -> _Layout:
    """Draw three wings above the hall, with classrooms on one side, and the common rooms below it."""
    pitch = _SINGLE_WING_WIDTH_M + rng.uniform(8.0, 10.0)
    length = 2.0 * pitch + _SINGLE_WING_WIDTH_M
    depth = rng.uniform(11.0, 12.0)
    shapes: list[shapely.Geometry] = [shapely.box(0.0, -depth, length, hall_depth)]
    for number in range(3):
        left = number * pitch
        rooms = drawing.open_part(left + _CORRIDOR_WIDTH_M, hall_depth, 1, mirrored=True)
        shapes.append(_draw_classrooms(rng, rooms, _CLASSES))
        shapes.append(
            shapely.box(left, hall_depth - 0.5, left + _CORRIDOR_WIDTH_M, hall_depth + _WING_LENGTH_M)
        )
    _draw_common_rooms(rng, drawing, length, depth)
    _draw_benches(drawing, _SINGLE_WING_WIDTH_M + 1.0, length - _SINGLE_WING_WIDTH_M - 1.0, hall_depth)
    return shapes, (length * 0.55, hall_depth / 2.0)


def _draw_yard(rng: np.random.Generator, drawing: Drawing, hall_depth: float) -> _Layout:
    """Draw classrooms on three sides of a closed yard, and the hall and the common rooms on the fourth."""
    yard_width = 4.0 * _CLASS_LENGTH_M
    depth = rng.uniform(11.5, 12.5)
    top = hall_depth + _WING_LENGTH_M
    left = -_SINGLE_WING_WIDTH_M
    right = yard_width + _SINGLE_WING_WIDTH_M
    drawing.add_block(0.0, hall_depth, yard_width, top - _CORRIDOR_WIDTH_M)
    north = drawing.open_part(0.0, top)
    west = drawing.open_part(-_CORRIDOR_WIDTH_M, hall_depth, 1)
    east = drawing.open_part(yard_width + _CORRIDOR_WIDTH_M, hall_depth, 1, mirrored=True)
    shapes = [
        shapely.box(left, -depth, right, hall_depth),
        shapely.box(-_CORRIDOR_WIDTH_M, hall_depth - 0.5, yard_width + _CORRIDOR_WIDTH_M, top),
        _draw_classrooms(rng, north, 4),
        _draw_classrooms(rng, west, _CLASSES),
        _draw_classrooms(rng, east, _CLASSES),
    ]
    _draw_common_rooms(rng, drawing.open_part(left, 0.0), right - left, depth)
    _draw_benches(drawing, 3.0, yard_width - 3.0, hall_depth)
    return shapes, (yard_width * 0.55, hall_depth / 2.0)


def _draw_double_wing(rng: np.random.Generator, part: Drawing) -> shapely.Geometry:
    """Draw classrooms on both sides of a corridor along the x axis, and stairs at its end.

    Returns
    -------
    geometry, m
        Outline of the wing, in the coordinates of the plan.
    """
    half = _CORRIDOR_WIDTH_M / 2.0
    for side in (part.open_part(0.0, half), part.open_part(0.0, -half, mirrored=True)):
        _draw_classrooms(rng, side, _CLASSES)
    length = _WING_LENGTH_M
    end = length + _STAIRS_LENGTH_M
    # The stairs are solid; in front of them is a landing.
    part.add_block(length + _STAIRS_LENGTH_M / 2.0, -half, end, 0.0)
    half_width = half + _CLASS_DEPTH_M
    rooms = shapely.Polygon(part.to_plan(build_box(-0.5, -half_width, length, half_width)))
    stairs = shapely.Polygon(part.to_plan(build_box(length - 0.5, -half, end, half)))
    return rooms | stairs


def _draw_classrooms(rng: np.random.Generator, part: Drawing, classes: int) -> shapely.Geometry:
    """Draw a row of classrooms along the x axis, with doors to a corridor below it.

    Returns
    -------
    geometry, m
        Outline of the row with a strip of the corridor, in the coordinates of the plan.
    """
    length = classes * _CLASS_LENGTH_M
    walls = [number * _CLASS_LENGTH_M for number in range(classes + 1)]
    for x in walls[:-1]:
        _draw_classroom(rng, part.open_part(x, 0.0))
    doors = [x + _CLASS_DOOR_M for x in walls[:-1]]
    part.add_wall_with_doors(
        (0.0, 0.0), (length, 0.0), doors, width=_DOOR_WIDTH_M, thickness=_WALL_THICKNESS_M
    )
    part.add_partitions(walls, _CLASS_DEPTH_M, thickness=_WALL_THICKNESS_M)
    return shapely.Polygon(part.to_plan(build_box(0.0, -0.5, length, _CLASS_DEPTH_M)))


def _draw_classroom(rng: np.random.Generator, part: Drawing) -> None:
    """Draw a classroom, whose board is at x = 0: the teacher's desk, and rows of two desks."""
    middle = _CLASS_DEPTH_M / 2.0
    part.add_centered_block(1.7, middle + 0.8, 0.7, 1.6)
    if rng.random() < _FOUR_ROWS_PROBABILITY:
        rows_x = _FIRST_ROW_M + _FOUR_ROWS_PITCH_M * np.arange(4)
    else:
        rows_x = _FIRST_ROW_M + _THREE_ROWS_PITCH_M * np.arange(3)
    for x in rows_x.tolist():
        for y in (middle - _DESK_OFFSET_M, middle + _DESK_OFFSET_M):
            part.add_centered_block(x, y, _DESK_DEPTH_M, _DESK_WIDTH_M)


def _draw_common_rooms(rng: np.random.Generator, drawing: Drawing, length: float, depth: float) -> None:
    """Draw the rooms below the hall, from left to right: gym, assembly hall, two offices, and library."""
    gym_end = rng.uniform(0.40, 0.46) * length
    assembly_end = gym_end + rng.uniform(0.28, 0.32) * length
    part = drawing.open_part(0.0, 0.0, mirrored=True)
    partitions = np.linspace(assembly_end, length, 4).tolist()
    room_doors = [(low + high) / 2.0 for low, high in itertools.pairwise(partitions)]
    doors = [*_list_hall_doors(gym_end, assembly_end), *room_doors]
    _add_hall_wall(part, length, doors)
    _draw_gym(part, gym_end, depth)
    _draw_assembly_hall(part, gym_end, assembly_end, depth)
    part.add_partitions(partitions[:-1], depth, thickness=_WALL_THICKNESS_M)
    for door in room_doors[:-1]:
        part.add_centered_block(door, depth * 0.6, 0.9, depth * 0.35)
    # The shelves of the library.
    for y in np.arange(2.4, depth - 1.4, 1.7).tolist():
        part.add_block(partitions[2] + 1.0, y, length, y + 0.5)


def _draw_gym_and_assembly_hall(drawing: Drawing, length: float, depth: float) -> None:
    """Draw a gym and an assembly hall below the hall."""
    gym_end = 0.62 * length
    part = drawing.open_part(0.0, 0.0, mirrored=True)
    _add_hall_wall(part, length, _list_hall_doors(gym_end, length))
    _draw_gym(part, gym_end, depth)
    _draw_assembly_hall(part, gym_end, length, depth)


def _list_hall_doors(gym_end: float, assembly_end: float) -> list[float]:
    """Return the x of the doors from the hall to the gym, its storage room, and the assembly hall."""
    middle = (gym_end + assembly_end) / 2.0
    return [gym_end * 0.5, gym_end - _STORAGE_WIDTH_M / 2.0, middle - 2.5, middle + 2.5]


def _add_hall_wall(part: Drawing, length: float, doors: list[float]) -> None:
    """Add the wall between the hall and the rooms below it."""
    part.add_wall_with_doors(
        (0.0, 0.0), (length, 0.0), doors, width=_HALL_DOOR_WIDTH_M, thickness=_WALL_THICKNESS_M
    )


def _draw_gym(part: Drawing, end: float, depth: float) -> None:
    """Draw a gym with benches for spectators, and a storage room for equipment on its right."""
    storage_left = end - _STORAGE_WIDTH_M
    part.add_wall_with_doors(
        (storage_left, 0.0),
        (storage_left, depth),
        [depth * 0.5],
        width=_HALL_DOOR_WIDTH_M,
        thickness=_WALL_THICKNESS_M,
    )
    part.add_partitions([end], depth, thickness=_WALL_THICKNESS_M)
    part.add_block(end - 1.0, depth * 0.25, end, depth * 0.45)
    part.add_block(end - 1.0, depth * 0.6, end, depth * 0.85)
    part.add_block(1.2, depth - 0.8, storage_left - 1.2, depth)
    part.add_block(0.0, depth * 0.35, 0.6, depth * 0.65)


def _draw_assembly_hall(part: Drawing, start: float, end: float, depth: float) -> None:
    """Draw a stage, and rows of seats with an aisle in the middle."""
    middle = (start + end) / 2.0
    part.add_block(start + 1.0, depth - 2.4, end - 1.0, depth)
    for y in np.arange(2.4, depth - 4.2, 1.7).tolist():
        part.add_block(start + 1.1, y, middle - 0.6, y + 0.6)
        part.add_block(middle + 0.6, y, end - 1.1, y + 0.6)


def _draw_benches(drawing: Drawing, left: float, right: float, hall_depth: float) -> None:
    """Draw benches in the hall."""
    benches = max(1, int((right - left) / 7.0))
    for x in (left + (np.arange(benches) + 0.5) * (right - left) / benches).tolist():
        drawing.add_centered_block(x, hall_depth / 2.0 + 0.3, 2.4, 0.8)
