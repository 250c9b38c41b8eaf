"""Hospital wards: wings with rooms on both sides of a corridor, and nurse stations where wings meet."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov_app.benchmark.large_plans.drawing import Drawing, build_outline, divide_evenly
from robocov_app.benchmark.plan_shapes import FloorPlan

_DOOR_WIDTH_M = 1.2
_BATH_WIDTH_M = 1.8
_BATH_DEPTH_M = 2.2
_BATH_DOOR_M = 0.85
_BED_WIDTH_M = 1.0
_BED_LENGTH_M = 2.1
_OUTER_WALL_M = 0.3
_WINGS: tuple[tuple[int, ...], ...] = ((0, 1), (0, 1, 2), (0, 1, 2, 3), (0, 2, 3))
"""Directions of the wings, in quarter turns from the x axis, by layout: an L, a T, a cross, and a T again."""


def draw_ward(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a ward: two to four wings around a hub with a nurse station, lifts and stairs."""
    directions = _WINGS[layout]
    depth = rng.uniform(6.0, 6.5)
    corridor = rng.uniform(2.3, 2.6)
    hub = 2.0 * depth + corridor
    half_hub = hub / 2.0
    drawing = Drawing()
    shapes = [shapely.box(-half_hub, -half_hub, half_hub, half_hub)]
    # With many wings, each is shorter.
    rooms = {2: 6, 3: 4, 4: 3}[len(directions)]
    for direction in directions:
        room_width = rng.uniform(3.9, 4.3)
        day_room = rng.uniform(4.6, 5.4)
        length = rooms * room_width + day_room
        part = drawing.open_part(0.0, 0.0, direction)
        _draw_wing(rng, part, half_hub, rooms, room_width, day_room, depth, corridor)
        outline = part.to_plan(
            [(0.0, -half_hub), (half_hub + length, -half_hub), (half_hub + length, half_hub), (0.0, half_hub)]
        )
        shapes.append(shapely.Polygon(outline))
    _draw_hub(drawing, half_hub, corridor, directions)
    return FloorPlan(build_outline(shapes), drawing.obstacles, (half_hub * 0.45, -half_hub * 0.45))


def _draw_hub(drawing: Drawing, half_hub: float, corridor: float, directions: tuple[int, ...]) -> None:
    """Draw the hub: a nurse station in its middle, and lifts, stairs and a store in its corners."""
    # The station is a counter around a desk, open to one side.
    reach = 2.0
    drawing.add_wall(
        (reach, -0.6),
        (reach, -reach),
        (-reach, -reach),
        (-reach, reach),
        (reach, reach),
        (reach, 0.6),
        thickness=0.5,
    )
    drawing.add_centered_block(-0.4, 0.0, 0.8, 1.8)
    corner = half_hub - 4.0
    # Lifts with niches in front of their doors.
    points = [(-half_hub, half_hub), (-half_hub, corner)]
    for number in range(2):
        middle = -half_hub + (number + 0.5) * 2.2
        points += [
            (middle - 0.6, corner),
            (middle - 0.6, corner + 0.4),
            (middle + 0.6, corner + 0.4),
            (middle + 0.6, corner),
        ]
    lift_end = -half_hub + 4.4
    drawing.add_polygon([*points, (lift_end, corner), (lift_end, half_hub)])
    # Stairs: two flights with a landing between them.
    drawing.add_block(corner, half_hub - 1.5, half_hub, half_hub)
    drawing.add_block(corner, corner, half_hub - 1.5, corner + 1.5)
    # A closed store.
    drawing.add_wall_with_doors((-half_hub, -corner), (-corner, -corner), [2.6], thickness=0.2)
    drawing.add_wall((-corner, -corner - 0.1), (-corner, -half_hub), thickness=0.2)
    drawing.add_block(-half_hub, -half_hub, -corner, -half_hub + 0.7)
    del corridor, directions


def _draw_wing(
    rng: np.random.Generator,
    part: Drawing,
    start: float,
    rooms: int,
    room_width: float,
    day_room: float,
    depth: float,
    corridor: float,
) -> None:
    """Draw a wing along the x axis: rooms on both sides of its corridor, and a day room at its end."""
    end = start + rooms * room_width
    part_length = end + day_room
    service = int(rng.integers(0, rooms))
    for mirrored in (False, True):
        side = part.open_part(0.0, corridor / 2.0 if not mirrored else -corridor / 2.0, mirrored=mirrored)
        partitions = [start + number * room_width for number in range(rooms + 1)]
        doors = []
        for number, (low, high) in enumerate(itertools.pairwise(partitions)):
            # Neighboring rooms have their baths side by side.
            has_bath_on_left = number % 2 == 1
            doors.append(high - 0.95 if has_bath_on_left else low + 0.95)
            is_service = mirrored and number == service
            if is_service:
                _draw_service_room(side, low, high, depth)
            else:
                room = side.open_part(low if has_bath_on_left else high, 0.0, 0)
                _draw_patient_room(rng, room, 1.0 if has_bath_on_left else -1.0, room_width, depth)
        side.add_wall_with_doors(
            (start, 0.0), (end, 0.0), [door - start for door in doors], width=_DOOR_WIDTH_M
        )
        for x in partitions:
            side.add_wall((x, 0.0), (x, depth))
        # Tables of the day room.
        side.add_centered_block(end + day_room / 2.0, depth * 0.45, 1.2, 1.8)
    part.add_centered_block(part_length - 0.4, 0.0, 0.8, 2.0)


def _draw_patient_room(
    rng: np.random.Generator, room: Drawing, direction: float, width: float, depth: float
) -> None:
    """Draw a bath cell next to the door, and one or two beds. x starts at the wall with the bath."""
    edge = direction * _BATH_WIDTH_M
    room.add_wall((0.0, _BATH_DEPTH_M), (edge, _BATH_DEPTH_M), (edge, _BATH_DOOR_M + 0.06))
    beds = 2 if rng.random() < 0.6 else 1
    for number in range(beds):
        y = depth - 0.7 - number * 1.6
        x = sorted((0.0, direction * _BED_LENGTH_M))
        room.add_block(x[0], y - _BED_WIDTH_M, x[1], y)
    del width


def _draw_service_room(side: Drawing, low: float, high: float, depth: float) -> None:
    """Draw shelves along three walls."""
    side.add_block(low, depth - 0.6, high, depth)
    side.add_block((low + high) / 2.0 - 0.3, 1.4, (low + high) / 2.0 + 0.3, depth - 1.8)
