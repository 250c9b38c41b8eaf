"""Hospital wards: wings with rooms on both sides of a corridor, which meet at a nurse station."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import shapely

from robocov_app.benchmark.maps.large_plans.drawing import Drawing, build_outline
from robocov_app.benchmark.maps.plan_shapes import FloorPlan, build_box

_DOOR_WIDTH_M = 1.2
"""Width of the doors of rooms, through which beds fit."""
_DOOR_MARGIN_M = 0.95
"""Distance of the middle of a door from the next wall."""
_BATH_WIDTH_M = 1.8
_BATH_DEPTH_M = 2.2
_BATH_DOOR_M = 0.91
"""Distance of the side wall of a bath from the center line of the corridor wall; the gap is its door."""
_BED_WIDTH_M = 1.0
_BED_LENGTH_M = 2.1
_BED_PITCH_M = 1.6
_BED_MARGIN_M = 0.7
"""Distance of the first bed from the facade."""
_TWO_BEDS_PROBABILITY = 0.6
_STORAGE_WALL_THICKNESS_M = 0.2
_STORAGE_DOOR_M = 2.6
"""Distance of the middle of the door of the storage room from the outer wall."""
_STORAGE_SHELF_DEPTH_M = 0.7
_HUB_CORNER_M = 4.0
"""Side of the square corners of the hub. The elevators in one of them are this deep, but wider."""
_ELEVATOR_COUNT = 2
_ELEVATOR_WIDTH_M = 2.2
_ELEVATOR_DOOR_M = 1.2
_ELEVATOR_NICHE_M = 0.4
_STAIRS_WIDTH_M = 1.5
_COUNTER_OFFSET_M = 2.0
"""Distance of the counter of the nurse station from its middle."""
_COUNTER_DEPTH_M = 0.5
_COUNTER_OPENING_M = 1.2
_DESK_WIDTH_M = 0.8
_DESK_LENGTH_M = 1.8
_ENTRANCE_FRACTION = 0.45
"""Distance of the entrance from the middle of the hub in x and y, as a fraction of half its side."""
_CUPBOARD_DEPTH_M = 0.8
_CUPBOARD_LENGTH_M = 2.0
_TABLE_WIDTH_M = 1.2
_TABLE_LENGTH_M = 1.8
_TABLE_DEPTH_FRACTION = 0.45
"""Distance of the table of the day room from the corridor, as a fraction of the depth of the rooms."""
_SHELF_DEPTH_M = 0.6
_SHELF_GAP_M = 1.2
"""Space between the shelf along the facade and the one in the middle of the room."""
_SHELF_MARGIN_M = 1.4
"""Distance of the shelf in the middle of a room from the corridor."""
_DIRECTIONS = ((0, 1), (0, 1, 2), (0, 1, 2, 3), (0, 2, 3))
"""Directions of the wings in quarter turns, by layout: an L, a T, a cross, and a T upside down."""
_ROOMS = (6, 4, 3, 4)
"""Number of rooms on each side of a wing, by layout."""


@dataclass(frozen=True)
class _Wing:
    """Sizes of a wing along the x axis, m."""

    start: float
    """x of the first room."""
    rooms: int
    """Number of rooms on each side."""
    room_width: float
    day_room: float
    """Length of the day room at the end."""
    depth: float
    """Depth of the rooms."""
    corridor: float
    """Width of the corridor."""

    @property
    def rooms_end(self) -> float:
        """Position x of the end of the last room."""
        return self.start + self.rooms * self.room_width

    @property
    def end(self) -> float:
        """Position x of the end of the wing."""
        return self.rooms_end + self.day_room


def draw_ward(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a ward: two to four wings around a hub with a nurse station, elevators and stairs."""
    depth = rng.uniform(6.0, 6.5)
    corridor = rng.uniform(2.3, 2.6)
    half_hub = depth + corridor / 2.0
    drawing = Drawing()
    shapes = [shapely.box(-half_hub, -half_hub, half_hub, half_hub)]
    for direction in _DIRECTIONS[layout]:
        wing = _Wing(
            start=half_hub,
            rooms=_ROOMS[layout],
            room_width=rng.uniform(3.9, 4.3),
            day_room=rng.uniform(4.6, 5.4),
            depth=depth,
            corridor=corridor,
        )
        part = drawing.open_part(0.0, 0.0, direction)
        _draw_wing(rng, part, wing)
        outline = part.to_plan(build_box(0.0, -half_hub, wing.end, half_hub))
        shapes.append(shapely.Polygon(outline))
    _draw_hub(drawing, half_hub)
    entrance = (half_hub * _ENTRANCE_FRACTION, -half_hub * _ENTRANCE_FRACTION)
    return FloorPlan(build_outline(shapes), drawing.obstacles, entrance=entrance)


def _draw_hub(drawing: Drawing, half_hub: float) -> None:
    """Draw the hub: a nurse station in the middle; elevators, stairs and a storage room in the corners."""
    _draw_nurse_station(drawing)
    inner = half_hub - _HUB_CORNER_M
    drawing.add_polygon(_outline_elevators(half_hub, inner))
    # Stairs: two flights with a landing between them.
    drawing.add_block(inner, half_hub - _STAIRS_WIDTH_M, half_hub, half_hub)
    drawing.add_block(inner, inner, half_hub - _STAIRS_WIDTH_M, inner + _STAIRS_WIDTH_M)
    # A storage room with a shelf.
    drawing.add_wall_with_doors(
        (-half_hub, -inner), (-inner, -inner), [_STORAGE_DOOR_M], thickness=_STORAGE_WALL_THICKNESS_M
    )
    corner_y = -inner - _STORAGE_WALL_THICKNESS_M / 2.0
    drawing.add_wall((-inner, corner_y), (-inner, -half_hub), thickness=_STORAGE_WALL_THICKNESS_M)
    drawing.add_block(-half_hub, -half_hub, -inner, -half_hub + _STORAGE_SHELF_DEPTH_M)


def _draw_nurse_station(drawing: Drawing) -> None:
    """Draw a nurse station: a desk inside a square counter that is open on the right."""
    half_opening = _COUNTER_OPENING_M / 2.0
    drawing.add_wall(
        (_COUNTER_OFFSET_M, -half_opening),
        (_COUNTER_OFFSET_M, -_COUNTER_OFFSET_M),
        (-_COUNTER_OFFSET_M, -_COUNTER_OFFSET_M),
        (-_COUNTER_OFFSET_M, _COUNTER_OFFSET_M),
        (_COUNTER_OFFSET_M, _COUNTER_OFFSET_M),
        (_COUNTER_OFFSET_M, half_opening),
        thickness=_COUNTER_DEPTH_M,
    )
    drawing.add_centered_block(-_DESK_WIDTH_M / 2.0, 0.0, _DESK_WIDTH_M, _DESK_LENGTH_M)


def _outline_elevators(half_hub: float, front: float) -> list[tuple[float, float]]:
    """Return the outline of two elevators in the upper left corner of the hub, with recessed doors."""
    points = [(-half_hub, half_hub), (-half_hub, front)]
    door_y = front + _ELEVATOR_NICHE_M
    for number in range(_ELEVATOR_COUNT):
        middle = -half_hub + (number + 0.5) * _ELEVATOR_WIDTH_M
        left = middle - _ELEVATOR_DOOR_M / 2.0
        right = middle + _ELEVATOR_DOOR_M / 2.0
        points += [(left, front), (left, door_y), (right, door_y), (right, front)]
    right_end = -half_hub + _ELEVATOR_COUNT * _ELEVATOR_WIDTH_M
    return [*points, (right_end, front), (right_end, half_hub)]


def _draw_wing(rng: np.random.Generator, part: Drawing, wing: _Wing) -> None:
    """Draw a wing along the x axis: rooms on both sides of its corridor, and a day room at its end."""
    service_room = int(rng.integers(0, wing.rooms))
    half_corridor = wing.corridor / 2.0
    left_side = part.open_part(0.0, half_corridor)
    _draw_wing_side(rng, left_side, wing, service_room=None)
    right_side = part.open_part(0.0, -half_corridor, mirrored=True)
    _draw_wing_side(rng, right_side, wing, service_room=service_room)
    # A cupboard of the day room.
    part.add_centered_block(wing.end - _CUPBOARD_DEPTH_M / 2.0, 0.0, _CUPBOARD_DEPTH_M, _CUPBOARD_LENGTH_M)


def _draw_wing_side(
    rng: np.random.Generator, side: Drawing, wing: _Wing, *, service_room: int | None
) -> None:
    """Draw the rooms on one side of a wing; y is the distance from the corridor.

    `service_room` is the number of the room that has shelves instead of beds, or None.
    """
    partitions = [wing.start + number * wing.room_width for number in range(wing.rooms + 1)]
    doors = []
    for number, (low, high) in enumerate(itertools.pairwise(partitions)):
        # The baths of adjacent rooms are side by side, in pairs.
        has_bath_on_left = number % 2 == 1
        door = high - _DOOR_MARGIN_M if has_bath_on_left else low + _DOOR_MARGIN_M
        doors.append(door - wing.start)
        if number == service_room:
            _draw_shelves(side, low, high, wing.depth)
        elif has_bath_on_left:
            _draw_patient_room(rng, side.open_part(low, 0.0), 1.0, wing.depth)
        else:
            _draw_patient_room(rng, side.open_part(high, 0.0), -1.0, wing.depth)
    side.add_wall_with_doors((wing.start, 0.0), (wing.rooms_end, 0.0), doors, width=_DOOR_WIDTH_M)
    side.add_partitions(partitions, wing.depth)
    # A table of the day room.
    table_x = wing.rooms_end + wing.day_room / 2.0
    table_y = wing.depth * _TABLE_DEPTH_FRACTION
    side.add_centered_block(table_x, table_y, _TABLE_WIDTH_M, _TABLE_LENGTH_M)


def _draw_patient_room(rng: np.random.Generator, room: Drawing, direction: float, depth: float) -> None:
    """Draw a bath, and one or two beds; the room extends from x = 0 to the right (1) or left (-1)."""
    edge = direction * _BATH_WIDTH_M
    room.add_wall((0.0, _BATH_DEPTH_M), (edge, _BATH_DEPTH_M), (edge, _BATH_DOOR_M))
    beds = 2 if rng.random() < _TWO_BEDS_PROBABILITY else 1
    left = min(0.0, direction * _BED_LENGTH_M)
    for number in range(beds):
        top = depth - _BED_MARGIN_M - number * _BED_PITCH_M
        room.add_block(left, top - _BED_WIDTH_M, left + _BED_LENGTH_M, top)


def _draw_shelves(side: Drawing, low: float, high: float, depth: float) -> None:
    """Draw a shelf along the facade, and one in the middle of a room."""
    middle = (low + high) / 2.0
    half_depth = _SHELF_DEPTH_M / 2.0
    front = depth - _SHELF_DEPTH_M
    side.add_block(low, front, high, depth)
    side.add_block(middle - half_depth, _SHELF_MARGIN_M, middle + half_depth, front - _SHELF_GAP_M)
