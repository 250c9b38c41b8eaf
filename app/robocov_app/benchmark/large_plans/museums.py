"""Museums: galleries in a row with aligned doors around an atrium, with cabinets, partitions and plinths."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov_app.benchmark.large_plans.drawing import Drawing, build_octagon, build_outline, divide_evenly
from robocov_app.benchmark.plan_shapes import FloorPlan

_WALL_M = 0.4
_DOOR_WIDTH_M = 1.2
_COLUMN_M = 0.6
_ENFILADE = 0.36
"""Position of the aligned doors of a row of galleries, as a fraction of their depth from the outside."""


def draw_museum(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a museum: around one or two atriums, with corner pavilions, a portico, and sometimes an apse."""
    depth = rng.uniform(7.0, 8.2)
    width = rng.uniform(44.0, 54.0)
    height = rng.uniform(31.0, 36.0)
    drawing = Drawing()
    hall_half = rng.uniform(5.0, 6.0)
    middle = width / 2.0
    shapes = [
        shapely.box(0.0, 0.0, width, height),
        shapely.box(middle - hall_half, -2.4, middle + hall_half, 1.0),
    ]
    if layout != 2:
        projection = 1.4
        for left, bottom in itertools.product((0.0, width - depth), (0.0, height - depth)):
            shapes.append(
                shapely.box(left, bottom, left + depth, bottom + depth).buffer(projection, join_style="mitre")
            )
    if layout in (1, 2):
        shapes.append(shapely.Polygon(build_octagon(middle, height, 4.6)))
        drawing.add_octagon(middle, height + 1.6, 0.8)
    _draw_ring(rng, drawing, width, height, depth, hall_half)
    _draw_entrance(drawing, middle, hall_half, depth)
    left, right = depth, width - depth
    if layout in (1, 3):
        # A gallery between two atriums.
        for x in (middle - 3.6, middle + 3.6):
            drawing.add_wall_with_doors(
                (x, depth),
                (x, height - depth),
                [(height - 2.0 * depth) / 2.0],
                width=_DOOR_WIDTH_M,
                thickness=_WALL_M,
            )
        _draw_exhibits(rng, drawing.open_part(middle, height / 2.0 + 3.4), 4.0, 4.0)
        _draw_exhibits(rng, drawing.open_part(middle, height / 2.0 - 3.4), 4.0, 4.0)
        _draw_atrium(drawing, left, depth, middle - 3.6, height - depth)
        _draw_atrium(drawing, middle + 3.6, depth, right, height - depth)
    elif layout == 2:
        # A light well on either side of the atrium.
        well = rng.uniform(5.0, 6.0)
        for x in (left + 1.8, right - 1.8 - well):
            drawing.add_block(x, depth + 2.2, x + well, height - depth - 2.2)
        _draw_atrium(drawing, left + well + 2.2, depth, right - well - 2.2, height - depth)
    else:
        _draw_rotunda(drawing, middle, height / 2.0, min(6.4, (height - 2.0 * depth) / 2.0 - 1.6))
        for x in (left + (middle - 6.4 - left) / 2.0, right - (middle - 6.4 - left) / 2.0):
            for y in divide_evenly(depth, height - depth, 4.4)[1:-1].tolist():
                drawing.add_centered_block(x, y, _COLUMN_M, _COLUMN_M)
    return FloorPlan(build_outline(shapes), drawing.obstacles, (middle, 0.4))


def _draw_ring(
    rng: np.random.Generator, drawing: Drawing, width: float, height: float, depth: float, hall_half: float
) -> None:
    """Draw the four rows of galleries around the middle, whose aligned doors make enfilades."""
    middle = width / 2.0
    # In each part, x runs along the inner wall, and y from the inner wall to the facade.
    south = drawing.open_part(0.0, depth, mirrored=True)
    north = drawing.open_part(0.0, height - depth)
    west = drawing.open_part(depth, 0.0, 1)
    east = drawing.open_part(width - depth, 0.0, 1, mirrored=True)
    gallery = rng.uniform(6.5, 8.5)
    left_row = divide_evenly(depth, middle - hall_half, gallery).tolist()
    right_row = divide_evenly(middle + hall_half, width - depth, gallery).tolist()
    _draw_row(rng, south, [*left_row, *right_row], depth, [middle - 2.6, middle + 2.6], hall=middle)
    upper = rng.uniform(7.0, 9.5)
    # An odd number of galleries, so that the door from the atrium leads to the middle one.
    galleries = 2 * round((width - 2.0 * depth) / upper / 2.0 - 0.5) + 1
    north_row = np.linspace(depth, width - depth, galleries + 1).tolist()
    _draw_row(rng, north, north_row, depth, [middle])
    side_row = divide_evenly(depth, height - depth, rng.uniform(8.0, 10.0)).tolist()
    for part in (west, east):
        door_room = (len(side_row) - 1) // 2
        door = (side_row[door_room] + side_row[door_room + 1]) / 2.0
        _draw_row(rng, part, side_row, depth, [door])
    for x, y in itertools.product((depth / 2.0, width - depth / 2.0), (depth / 2.0, height - depth / 2.0)):
        drawing.add_octagon(x, y, 0.9)


def _draw_row(
    rng: np.random.Generator,
    part: Drawing,
    partitions: list[float],
    depth: float,
    inner_doors: list[float],
    hall: float | None = None,
) -> None:
    """Draw a row of galleries between the corner pavilions, with doors through all its partitions."""
    start = partitions[0]
    doors = [door - start for door in inner_doors]
    part.add_wall_with_doors(
        (start - _WALL_M / 2.0, 0.0),
        (partitions[-1] + _WALL_M / 2.0, 0.0),
        [door + _WALL_M / 2.0 for door in doors],
        width=_DOOR_WIDTH_M,
        thickness=_WALL_M,
    )
    enfilade = depth * (1.0 - _ENFILADE)
    for x in partitions:
        part.add_wall_with_doors((x, 0.0), (x, depth), [enfilade], width=_DOOR_WIDTH_M, thickness=_WALL_M)
    for low, high in itertools.pairwise(partitions):
        if hall is not None and low < hall < high:
            continue
        # The exhibits leave the line of the enfilade free.
        _draw_exhibits(
            rng, part.open_part((low + high) / 2.0, (enfilade - 1.0) / 2.0), high - low - 2.4, enfilade - 2.6
        )


def _draw_exhibits(rng: np.random.Generator, part: Drawing, width: float, depth: float) -> None:
    """Draw exhibits around the origin: cabinets, partitions, or a plinth with benches."""
    choice = int(rng.integers(0, 4))
    if choice == 0:
        for x, y in itertools.product(
            (-width / 2.0 + 0.6, width / 2.0 - 0.6), (-depth / 2.0 + 0.3, depth / 2.0)
        ):
            part.add_centered_block(x, y, 1.2, 0.6)
    elif choice == 1:
        # Two partitions that overlap in the middle, for paintings.
        part.add_wall((-width / 2.0, -depth / 4.0), (width * 0.1, -depth / 4.0), thickness=0.3)
        part.add_wall((width * 0.1, depth / 2.0 - 0.1), (width / 2.0, depth / 2.0 - 0.1), thickness=0.3)
    elif choice == 2:
        part.add_octagon(0.0, 0.0, 0.8)
        part.add_centered_block(-width / 2.0 + 0.2, 0.0, 0.5, 1.8)
        part.add_centered_block(width / 2.0 - 0.2, 0.0, 0.5, 1.8)
    else:
        part.add_wall(
            (-width / 4.0, -depth / 2.0),
            (-width / 4.0, depth / 2.0),
            (width / 4.0, depth / 2.0),
            thickness=0.3,
        )
        part.add_octagon(width / 4.0, -depth / 4.0, 0.5)


def _draw_entrance(drawing: Drawing, middle: float, hall_half: float, depth: float) -> None:
    """Draw the entrance hall behind the portico: columns, a ticket desk, and a cloakroom counter."""
    for x in np.linspace(middle - hall_half + 1.0, middle + hall_half - 1.0, 4).tolist():
        drawing.add_centered_block(x, -1.4, _COLUMN_M, _COLUMN_M)
    drawing.add_centered_block(middle, depth - 2.6, 3.0, 0.8)
    drawing.add_block(middle - hall_half, depth - 1.6, middle - hall_half + 0.8, depth)


def _draw_atrium(drawing: Drawing, left: float, bottom: float, right: float, top: float) -> None:
    """Draw an atrium: columns along its sides, and a sculpture in its middle."""
    inset = 2.4
    columns_x = divide_evenly(left + inset, right - inset, 3.4).tolist()
    columns_y = divide_evenly(bottom + inset, top - inset, 3.4).tolist()
    for x in columns_x:
        for y in (columns_y[0], columns_y[-1]):
            drawing.add_centered_block(x, y, _COLUMN_M, _COLUMN_M)
    for y in columns_y[1:-1]:
        for x in (columns_x[0], columns_x[-1]):
            drawing.add_centered_block(x, y, _COLUMN_M, _COLUMN_M)
    drawing.add_octagon((left + right) / 2.0, (bottom + top) / 2.0, 1.3)


def _draw_rotunda(drawing: Drawing, x: float, y: float, radius: float) -> None:
    """Draw a rotunda: an octagonal wall with four doors, and a sculpture in its middle."""
    ring = build_octagon(0.0, 0.0, radius)
    # Doors are in the middle of the sides that face the four galleries; the wall pieces are the corners.
    sides = [ring[number] for number in range(8)]
    for number in range(0, 8, 2):
        first, second = np.array(sides[number]), np.array(sides[(number + 1) % 8])
        before, after = np.array(sides[number - 1]), np.array(sides[(number + 2) % 8])
        start = _stop_before_door(first, before)
        end = _stop_before_door(second, after)
        points = [tuple(point + (x, y)) for point in (start, first, second, end)]
        drawing.add_wall(*points, thickness=_WALL_M)
    drawing.add_octagon(x, y, 1.2)


def _stop_before_door(corner: np.ndarray, next_corner: np.ndarray) -> np.ndarray:
    """Return the end of the wall from a corner towards the door in the middle of a side."""
    length = float(np.hypot(*(next_corner - corner)))
    return corner + (next_corner - corner) * ((length - _DOOR_WIDTH_M) / 2.0 / length)
