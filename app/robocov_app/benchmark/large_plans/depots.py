"""Depots: halls with long racks and cross aisles, loading bays, cages, pallets, and an office."""

from __future__ import annotations

import itertools

import numpy as np
import shapely

from robocov_app.benchmark.large_plans.drawing import Drawing, build_outline, divide_evenly
from robocov_app.benchmark.plan_shapes import FloorPlan

_RACK_DEPTH_M = 2.4
"""Depth of two racks back to back."""
_CROSS_AISLE_M = 2.6
_BAY_WIDTH_M = 3.0
_BAY_DEPTH_M = 2.6
_PALLET_SIZE_M = (1.2, 0.8)
_CAGE_M = 7.0


def draw_depot(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a depot; its racks are across or along the side with the loading bays, in a rectangle or an L."""
    width = rng.uniform(44.0, 56.0)
    height = rng.uniform(30.0, 36.0)
    drawing = Drawing()
    dock_depth = rng.uniform(8.0, 9.5)
    shapes = [shapely.box(0.0, 0.0, width, height)]
    bays = int((width - 12.0) / 6.0)
    bays_x = np.linspace(10.5, width - 4.5, bays)
    for x in bays_x.tolist():
        shapes.append(shapely.box(x - _BAY_WIDTH_M / 2.0, -_BAY_DEPTH_M, x + _BAY_WIDTH_M / 2.0, 0.5))
    has_annex = layout in (1, 3)
    if has_annex:
        # A lower hall next to the racks makes the floor an L.
        shapes[0] = shapely.box(0.0, 0.0, width - 13.0, height) | shapely.box(0.0, 0.0, width, height - 11.0)
    _draw_office(drawing)
    _draw_staging(rng, drawing, bays_x.tolist(), dock_depth)
    if layout in (0, 1):
        _draw_racks_across(rng, drawing, width, height, dock_depth, has_annex=has_annex)
    else:
        _draw_racks_along(rng, drawing, width, height, dock_depth, has_annex=has_annex)
    return FloorPlan(build_outline(shapes), drawing.obstacles, (9.0, 3.0))


def _draw_office(drawing: Drawing) -> None:
    """Draw the office of the dispatcher in the lower left corner: two rooms with desks."""
    drawing.add_wall_with_doors((6.5, 0.0), (6.5, 6.0), [4.6])
    drawing.add_wall_with_doors((0.0, 6.0), (6.56, 6.0), [])
    drawing.add_wall_with_doors((0.0, 3.0), (6.5, 3.0), [5.2])
    drawing.add_block(0.9, 0.9, 3.3, 1.7)
    drawing.add_block(0.0, 5.2, 2.4, 6.0)


def _draw_staging(rng: np.random.Generator, drawing: Drawing, bays_x: list[float], dock_depth: float) -> None:
    """Draw pallets in lanes in front of the loading bays."""
    length, depth = _PALLET_SIZE_M
    for low, high in itertools.pairwise(bays_x):
        middle = (low + high) / 2.0
        pallets = int(rng.integers(1, 4))
        for number in range(pallets):
            y = 1.2 + number * (depth + 0.8)
            pair = 2.0 if rng.random() < 0.5 else 1.0
            drawing.add_centered_block(middle, y, depth * pair + 0.2, length * 0.8)
    del dock_depth


def _draw_racks_across(
    rng: np.random.Generator,
    drawing: Drawing,
    width: float,
    height: float,
    dock_depth: float,
    *,
    has_annex: bool,
) -> None:
    """Draw racks that run away from the loading bays, with a cross aisle, and a cage at the far right."""
    aisle = rng.uniform(2.7, 3.1)
    middle = dock_depth + (height - dock_depth) * rng.uniform(0.48, 0.58)
    racks_right = width - _CAGE_M - 2.0
    for left in np.arange(1.4, racks_right - _RACK_DEPTH_M, _RACK_DEPTH_M + aisle).tolist():
        top = height - 1.6
        if has_annex and left + _RACK_DEPTH_M > width - 13.0 - 1.0:
            top = height - 11.0 - 1.6
        drawing.add_block(left, dock_depth, left + _RACK_DEPTH_M, middle - _CROSS_AISLE_M / 2.0)
        if top - middle > 4.0:
            drawing.add_block(left, middle + _CROSS_AISLE_M / 2.0, left + _RACK_DEPTH_M, top)
    top = height - 11.0 if has_annex else height
    _draw_cage(rng, drawing, width - _CAGE_M, top - 9.0, width, top)
    _draw_pallet_field(rng, drawing, width - _CAGE_M + 1.0, dock_depth, width - 1.2, top - 10.5)


def _draw_racks_along(
    rng: np.random.Generator,
    drawing: Drawing,
    width: float,
    height: float,
    dock_depth: float,
    *,
    has_annex: bool,
) -> None:
    """Draw racks parallel to the side with the loading bays, in three blocks, and a cage in the upper right."""
    aisle = rng.uniform(2.7, 3.1)
    ends = np.linspace(1.6, width - 1.6, 4)
    for bottom in np.arange(dock_depth, height - _RACK_DEPTH_M - 3.6, _RACK_DEPTH_M + aisle).tolist():
        top = bottom + _RACK_DEPTH_M
        for number, (low, high) in enumerate(itertools.pairwise(ends.tolist())):
            right = high - (_CROSS_AISLE_M if number < 2 else 0.0)
            if number == 2 and top > height - 12.0:
                continue
            drawing.add_block(low, bottom, right, top)
    # A single rack along the wall.
    drawing.add_block(ends[0], height - 1.2, ends[2] - _CROSS_AISLE_M, height)
    if has_annex:
        _draw_pallet_field(rng, drawing, ends[2] + 0.6, height - 15.5, width - 1.2, height - 12.2)
        return
    _draw_cage(rng, drawing, width - 9.0, height - _CAGE_M, width, height)
    _draw_pallet_field(rng, drawing, ends[2] + 0.6, height - 10.0, width - 10.2, height - 1.2)


def _draw_cage(
    rng: np.random.Generator, drawing: Drawing, left: float, bottom: float, right: float, top: float
) -> None:
    """Draw a cage for valuable goods: a fence with a gate, and shelves inside."""
    drawing.add_wall((left, top), (left, bottom), thickness=0.1)
    drawing.add_wall_with_doors(
        (left - 0.05, bottom), (right, bottom), [rng.uniform(1.2, 2.0)], width=1.2, thickness=0.1
    )
    for x in np.arange(left + 1.2, right - 1.0, 1.9).tolist():
        drawing.add_block(x, bottom + 1.8, x + 0.7, top - 1.1)


def _draw_pallet_field(
    rng: np.random.Generator, drawing: Drawing, left: float, bottom: float, right: float, top: float
) -> None:
    """Draw pallets in a grid, some of whose places are empty."""
    columns = divide_evenly(left, right, 2.2)
    rows = divide_evenly(bottom, top, 2.0)
    for low_x, low_y in itertools.product(columns[:-1].tolist(), rows[:-1].tolist()):
        if rng.random() < 0.7:
            drawing.add_block(low_x, low_y, low_x + _PALLET_SIZE_M[0], low_y + _PALLET_SIZE_M[1])
