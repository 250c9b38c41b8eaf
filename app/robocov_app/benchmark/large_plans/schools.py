"""Schools: class rooms with rows of desks in wings, along a hall with a gym and an assembly hall."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov_app.benchmark.large_plans.drawing import Drawing, build_outline
from robocov_app.benchmark.plan_shapes import FloorPlan

_CLASS_LENGTH_M = 8.8
_CLASS_DEPTH_M = 6.8
_WALL_M = 0.2
_DESK_DEPTH_M = 0.5
_ROW_PITCH_M = 1.6
_FIRST_ROW_M = 3.2
"""Distance of the first row of desks from the wall with the board."""
_CORRIDOR_M = 2.6


def draw_school(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a school: a hall with a gym at its end, and wings in a comb, a Z, an E, or around a yard."""
    drawing = Drawing()
    hall = rng.uniform(4.2, 5.2)
    builders = (_draw_comb, _draw_z, _draw_e, _draw_yard)
    shapes, entrance = builders[layout](rng, drawing, hall)
    return FloorPlan(build_outline(shapes), drawing.obstacles, entrance)


_Layout = tuple[list[shapely.Polygon], tuple[float, float]]


def _draw_comb(rng: np.random.Generator, drawing: Drawing, hall: float) -> _Layout:
    """Draw two wings with class rooms on both sides, above a hall; gym, stage and offices are below it."""
    wing = 2.0 * _CLASS_DEPTH_M + _CORRIDOR_M
    yard = rng.uniform(8.0, 11.0)
    length = 2.0 * wing + yard
    below = rng.uniform(12.0, 13.0)
    shapes = [shapely.box(0.0, -below, length, hall)]
    for left in (0.0, wing + yard):
        part = drawing.open_part(left + wing / 2.0, hall, 1)
        shapes.append(_draw_double_wing(rng, part, classes=2))
    _draw_lower_side(rng, drawing, length, below)
    _draw_hall(drawing, wing + 1.0, wing + yard - 1.0, hall)
    return shapes, (length * 0.55, hall / 2.0)


def _draw_z(rng: np.random.Generator, drawing: Drawing, hall: float) -> _Layout:
    """Draw one wing above the hall at its left end, and one below at its right end, next to the gym."""
    wing = 2.0 * _CLASS_DEPTH_M + _CORRIDOR_M
    length = wing + rng.uniform(26.0, 29.0)
    shapes = [shapely.box(0.0, 0.0, length, hall)]
    upper = drawing.open_part(wing / 2.0, hall, 1)
    shapes.append(_draw_double_wing(rng, upper, classes=2))
    lower = drawing.open_part(length - wing / 2.0, 0.0, 3)
    shapes.append(_draw_double_wing(rng, lower, classes=2))
    below = rng.uniform(12.0, 14.0)
    gym = length - wing - 3.0
    shapes.append(shapely.box(0.0, -below, gym, 1.0))
    _draw_lower_side(rng, drawing, gym, below, has_offices=False)
    upper_rooms = drawing.open_part(wing + 2.0, hall)
    shapes.append(_draw_class_row(rng, upper_rooms, 2))
    _draw_hall(drawing, wing + 2.0, length - wing - 2.0, hall)
    return shapes, (wing + 3.0, hall / 2.0)


def _draw_e(rng: np.random.Generator, drawing: Drawing, hall: float) -> _Layout:
    """Draw three wings with class rooms on one side of their corridors, and gym and offices below the hall."""
    wing = _CLASS_DEPTH_M + _CORRIDOR_M
    yard = rng.uniform(8.0, 10.0)
    length = 3.0 * wing + 2.0 * yard
    below = rng.uniform(11.0, 12.0)
    shapes = [shapely.box(0.0, -below, length, hall)]
    for number in range(3):
        left = number * (wing + yard)
        # The corridor is on the left; the class rooms are on its right.
        rooms = drawing.open_part(left + _CORRIDOR_M, hall, 1, mirrored=True)
        shapes.append(_draw_class_row(rng, rooms, 2))
        end = hall + 2.0 * _CLASS_LENGTH_M
        shapes.append(shapely.box(left, hall - 0.5, left + _CORRIDOR_M, end))
    _draw_lower_side(rng, drawing, length, below)
    _draw_hall(drawing, wing + 1.0, length - wing - 1.0, hall)
    return shapes, (length * 0.55, hall / 2.0)


def _draw_yard(rng: np.random.Generator, drawing: Drawing, hall: float) -> _Layout:
    """Draw class rooms on three sides of a closed yard, and hall, gym and offices on the fourth."""
    classes_x = 4
    inner_width = classes_x * _CLASS_LENGTH_M
    inner_height = 2.0 * _CLASS_LENGTH_M
    wing = _CLASS_DEPTH_M + _CORRIDOR_M
    below = rng.uniform(11.5, 12.5)
    left = -_CORRIDOR_M
    right = inner_width + _CORRIDOR_M
    top = hall + inner_height
    shapes = [shapely.box(left - _CLASS_DEPTH_M, -below, right + _CLASS_DEPTH_M, hall)]
    # The yard, with a margin of one corridor above it.
    drawing.add_block(0.0, hall, inner_width, top - _CORRIDOR_M)
    shapes.append(shapely.box(left, hall - 0.5, right, top))
    shapes.append(_draw_class_row(rng, drawing.open_part(0.0, top), classes_x))
    west = drawing.open_part(left, hall, 1)
    shapes.append(_draw_class_row(rng, west, 2))
    east = drawing.open_part(right, hall, 1, mirrored=True)
    shapes.append(_draw_class_row(rng, east, 2))
    lower = drawing.open_part(left - _CLASS_DEPTH_M, 0.0)
    _draw_lower_side(rng, lower, right - left + 2.0 * _CLASS_DEPTH_M, below)
    _draw_hall(drawing, 3.0, inner_width - 3.0, hall)
    del wing
    return shapes, (inner_width * 0.55, hall / 2.0)


def _draw_double_wing(rng: np.random.Generator, part: Drawing, classes: int) -> shapely.Polygon:
    """Draw class rooms on both sides of a corridor along the x axis, and stairs at its end."""
    half = _CORRIDOR_M / 2.0
    for mirrored in (False, True):
        side = part.open_part(0.0, -half if mirrored else half, mirrored=mirrored)
        _draw_class_row(rng, side, classes)
    length = classes * _CLASS_LENGTH_M
    # The stairs are solid, and leave a landing at the end of the corridor.
    end = length + 2.6
    part.add_block(length + 1.3, -half, end, 0.0)
    half_width = half + _CLASS_DEPTH_M
    rooms = shapely.Polygon(
        part.to_plan([(-0.5, -half_width), (length, -half_width), (length, half_width), (-0.5, half_width)])
    )
    stairs = shapely.Polygon(
        part.to_plan([(length - 0.5, -half), (end, -half), (end, half), (length - 0.5, half)])
    )
    return rooms | stairs


def _draw_class_row(rng: np.random.Generator, part: Drawing, classes: int) -> shapely.Polygon:
    """Draw a row of class rooms along the x axis, with a corridor or hall below it; return its outline."""
    length = classes * _CLASS_LENGTH_M
    doors = []
    for number in range(classes):
        doors += [number * _CLASS_LENGTH_M + 1.2]
        _draw_class(rng, part.open_part(number * _CLASS_LENGTH_M, 0.0))
    part.add_wall_with_doors((0.0, 0.0), (length, 0.0), doors, width=1.0, thickness=_WALL_M)
    for number in range(classes + 1):
        x = number * _CLASS_LENGTH_M
        part.add_wall((x, 0.0), (x, _CLASS_DEPTH_M), thickness=_WALL_M)
    return shapely.Polygon(
        part.to_plan([(0.0, -0.5), (length, -0.5), (length, _CLASS_DEPTH_M), (0.0, _CLASS_DEPTH_M)])
    )


def _draw_class(rng: np.random.Generator, part: Drawing) -> None:
    """Draw a class room, whose board is at x = 0: the teacher's desk, and rows of two desks."""
    middle = _CLASS_DEPTH_M / 2.0
    part.add_centered_block(1.7, middle + 0.8, 0.7, 1.6)
    rows = 4 if rng.random() < 0.35 else 3
    for number in range(rows):
        x = _FIRST_ROW_M + number * (_ROW_PITCH_M if rows == 4 else 1.25 * _ROW_PITCH_M)
        for y in (middle - 1.65, middle + 1.65):
            part.add_centered_block(x, y, _DESK_DEPTH_M, 2.3)


def _draw_lower_side(
    rng: np.random.Generator, drawing: Drawing, length: float, depth: float, *, has_offices: bool = True
) -> None:
    """Draw the rooms below the hall, from left to right: gym with its store, assembly hall, and offices."""
    gym = rng.uniform(0.40, 0.46) * length if has_offices else 0.62 * length
    store = 3.2
    stage_hall = gym + rng.uniform(0.28, 0.32) * length if has_offices else length
    part = drawing.open_part(0.0, 0.0, mirrored=True)
    doors = [gym * 0.5, gym - store / 2.0, (gym + stage_hall) / 2.0 - 2.5, (gym + stage_hall) / 2.0 + 2.5]
    offices = []
    if has_offices:
        offices = np.linspace(stage_hall, length, 4).tolist()
        doors += [(low + high) / 2.0 for low, high in itertools.pairwise(offices)]
    part.add_wall_with_doors((0.0, 0.0), (length, 0.0), doors, width=1.2, thickness=_WALL_M)
    # The gym has a store for its equipment, with boxes and mats.
    part.add_wall_with_doors(
        (gym - store, 0.0), (gym - store, depth), [depth * 0.5], width=1.2, thickness=_WALL_M
    )
    part.add_wall((gym, 0.0), (gym, depth), thickness=_WALL_M)
    part.add_block(gym - 1.0, depth * 0.25, gym, depth * 0.45)
    part.add_block(gym - 1.0, depth * 0.6, gym, depth * 0.85)
    part.add_block(1.2, depth - 0.8, gym - store - 1.2, depth)
    part.add_block(0.0, depth * 0.35, 0.6, depth * 0.65)
    # The assembly hall has a stage with stairs, and rows of seats with an aisle in the middle.
    middle = (gym + stage_hall) / 2.0
    half = (stage_hall - gym) / 2.0
    part.add_block(gym + 1.0, depth - 2.4, stage_hall - 1.0, depth)
    for y in np.arange(2.4, depth - 4.2, 1.7).tolist():
        part.add_block(gym + 1.1, y, middle - 0.6, y + 0.6)
        part.add_block(middle + 0.6, y, stage_hall - 1.1, y + 0.6)
    del half
    for x in [stage_hall, *offices[1:-1]]:
        if has_offices:
            part.add_wall((x, 0.0), (x, depth), thickness=_WALL_M)
    for number, (low, high) in enumerate(itertools.pairwise(offices)):
        if number == 2:
            # The library, with shelves.
            for y in np.arange(2.4, depth - 1.4, 1.7).tolist():
                part.add_block(low + 1.0, y, high, y + 0.5)
            continue
        part.add_centered_block((low + high) / 2.0, depth * 0.6, 0.9, depth * 0.35)


def _draw_hall(drawing: Drawing, left: float, right: float, hall: float) -> None:
    """Draw lockers or benches, as islands in the hall."""
    count = max(1, int((right - left) / 7.0))
    for x in (left + (np.arange(count) + 0.5) * (right - left) / count).tolist():
        drawing.add_centered_block(x, hall / 2.0 + 0.3, 2.4, 0.8)
