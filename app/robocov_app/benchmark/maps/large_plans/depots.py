"""Depots: halls with long racks and cross aisles, loading bays, a cage, pallets, and an office."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import shapely

from robocov_app.benchmark.maps.large_plans.drawing import Drawing, build_outline, divide_evenly
from robocov_app.benchmark.maps.plan_shapes import FloorPlan

_RACK_DEPTH_M = 2.4
"""Depth of two racks back to back."""
_CROSS_AISLE_M = 2.6
_WALL_AISLE_M = 1.6
"""Width of the aisle between the racks and the walls."""
_BAY_WIDTH_M = 3.0
_BAY_DEPTH_M = 2.6
_FIRST_BAY_X_M = 10.5
_LAST_BAY_MARGIN_M = 4.5
_BAY_DISTANCE_M = 6.0
_PALLET_SIZE_M = (1.2, 0.8)
_PALLET_PROBABILITY = 0.7
_CAGE_M = 7.0
_CAGE_GATE_M = 1.2
_FENCE_THICKNESS_M = 0.1
_OFFICE_WIDTH_M = 6.5
_OFFICE_HEIGHT_M = 6.0
_CUT_SIZE_M = (13.0, 11.0)
"""Width and height of the missing upper right corner of an L-shaped hall."""


@dataclass(frozen=True)
class _Hall:
    """Sizes of a depot, m."""

    width: float
    height: float
    dock_depth: float
    """Depth of the space between the loading bays and the racks."""
    is_l_shaped: bool

    @property
    def right_height(self) -> float:
        """Height of the right part of the hall."""
        return self.height - _CUT_SIZE_M[1] if self.is_l_shaped else self.height

    @property
    def outline(self) -> shapely.Geometry:
        """Shape of the hall without its loading bays."""
        hall = shapely.box(0.0, 0.0, self.width, self.height)
        if self.is_l_shaped:
            cut_left = self.width - _CUT_SIZE_M[0]
            hall -= shapely.box(cut_left, self.right_height, self.width, self.height)
        return hall


def draw_depot(rng: np.random.Generator, layout: int) -> FloorPlan:
    """Draw a depot; its layout selects the direction of the racks, and whether the hall is L-shaped."""
    hall = _Hall(
        width=rng.uniform(44.0, 56.0),
        height=rng.uniform(30.0, 36.0),
        dock_depth=rng.uniform(8.0, 9.5),
        is_l_shaped=layout in (1, 3),
    )
    drawing = Drawing()
    bays = int((hall.width - 12.0) / _BAY_DISTANCE_M)
    bays_x = np.linspace(_FIRST_BAY_X_M, hall.width - _LAST_BAY_MARGIN_M, bays).tolist()
    half_bay = _BAY_WIDTH_M / 2.0
    bay_shapes = [shapely.box(x - half_bay, -_BAY_DEPTH_M, x + half_bay, 0.5) for x in bays_x]
    _draw_office(drawing)
    _draw_staging(rng, drawing, bays_x)
    if layout in (0, 1):
        _draw_racks_across(rng, drawing, hall)
    else:
        _draw_racks_along(rng, drawing, hall)
    return FloorPlan(build_outline([hall.outline, *bay_shapes]), drawing.obstacles, entrance=(9.0, 3.0))


def _draw_office(drawing: Drawing) -> None:
    """Draw the office in the lower left corner: two rooms, with a desk and a cupboard."""
    width = _OFFICE_WIDTH_M
    height = _OFFICE_HEIGHT_M
    drawing.add_wall_with_doors((width, 0.0), (width, height), [4.6])
    drawing.add_wall((0.0, height), (width + 0.06, height))
    drawing.add_wall_with_doors((0.0, height / 2.0), (width, height / 2.0), [5.2])
    drawing.add_block(0.9, 0.9, 3.3, 1.7)
    drawing.add_block(0.0, height - 0.8, 2.4, height)


def _draw_staging(rng: np.random.Generator, drawing: Drawing, bays_x: list[float]) -> None:
    """Draw the staging area: rows of one or two pallets between the loading bays."""
    length, depth = _PALLET_SIZE_M
    for low, high in itertools.pairwise(bays_x):
        rows = int(rng.integers(1, 4))
        for row in range(rows):
            y = 1.2 + row * (depth + 0.8)
            pallets = 2.0 if rng.random() < 0.5 else 1.0
            drawing.add_centered_block((low + high) / 2.0, y, depth * pallets + 0.2, length * 0.8)


def _draw_racks_across(rng: np.random.Generator, drawing: Drawing, hall: _Hall) -> None:
    """Draw pallets, a cage, and racks at right angles to the loading bays, with a cross aisle."""
    aisle = rng.uniform(2.7, 3.1)
    cross_y = hall.dock_depth + (hall.height - hall.dock_depth) * rng.uniform(0.48, 0.58)
    cage_left = hall.width - _CAGE_M
    last_left = cage_left - 2.0 - _RACK_DEPTH_M
    for left in np.arange(1.4, last_left, _RACK_DEPTH_M + aisle).tolist():
        right = left + _RACK_DEPTH_M
        is_below_cut = right > hall.width - _CUT_SIZE_M[0] - 1.0
        top = (hall.right_height if is_below_cut else hall.height) - _WALL_AISLE_M
        drawing.add_block(left, hall.dock_depth, right, cross_y - _CROSS_AISLE_M / 2.0)
        if top - cross_y > 4.0:
            drawing.add_block(left, cross_y + _CROSS_AISLE_M / 2.0, right, top)
    cage_top = hall.right_height
    _draw_cage(rng, drawing, (cage_left, cage_top - 9.0, hall.width, cage_top))
    _draw_pallets(rng, drawing, (cage_left + 1.0, hall.dock_depth, hall.width - 1.2, cage_top - 10.5))


def _draw_racks_along(rng: np.random.Generator, drawing: Drawing, hall: _Hall) -> None:
    """Draw pallets, racks parallel to the loading bays and, in a rectangular hall, a cage."""
    aisle = rng.uniform(2.7, 3.1)
    # Cross aisles divide the racks into three blocks.
    blocks_x = np.linspace(_WALL_AISLE_M, hall.width - _WALL_AISLE_M, 4).tolist()
    pitch = _RACK_DEPTH_M + aisle
    for bottom in np.arange(hall.dock_depth, hall.height - _RACK_DEPTH_M - 3.6, pitch).tolist():
        top = bottom + _RACK_DEPTH_M
        drawing.add_block(blocks_x[0], bottom, blocks_x[1] - _CROSS_AISLE_M, top)
        drawing.add_block(blocks_x[1], bottom, blocks_x[2] - _CROSS_AISLE_M, top)
        if top <= hall.height - 12.0:
            drawing.add_block(blocks_x[2], bottom, blocks_x[3], top)
    # A single rack along the wall.
    drawing.add_block(blocks_x[0], hall.height - 1.2, blocks_x[2] - _CROSS_AISLE_M, hall.height)
    pallets_left = blocks_x[2] + 0.6
    if hall.is_l_shaped:
        bottom = hall.height - 15.5
        _draw_pallets(rng, drawing, (pallets_left, bottom, hall.width - 1.2, bottom + 3.3))
        return
    cage_left = hall.width - 9.0
    _draw_cage(rng, drawing, (cage_left, hall.height - _CAGE_M, hall.width, hall.height))
    _draw_pallets(rng, drawing, (pallets_left, hall.height - 10.0, cage_left - 1.2, hall.height - 1.2))


def _draw_cage(rng: np.random.Generator, drawing: Drawing, bounds: tuple[float, float, float, float]) -> None:
    """Draw a cage for valuable goods: a fence with a gate, and shelves inside.

    The bounds are left, bottom, right and top; walls of the hall are on the right and above.
    """
    left, bottom, right, top = bounds
    drawing.add_wall((left, top), (left, bottom), thickness=_FENCE_THICKNESS_M)
    drawing.add_wall_with_doors(
        (left - _FENCE_THICKNESS_M / 2.0, bottom),
        (right, bottom),
        [rng.uniform(1.2, 2.0)],
        width=_CAGE_GATE_M,
        thickness=_FENCE_THICKNESS_M,
    )
    for x in np.arange(left + 1.2, right - 1.0, 1.9).tolist():
        drawing.add_block(x, bottom + 1.8, x + 0.7, top - 1.1)


def _draw_pallets(
    rng: np.random.Generator, drawing: Drawing, bounds: tuple[float, float, float, float]
) -> None:
    """Draw a grid of pallets with some empty places; the bounds are left, bottom, right and top."""
    left, bottom, right, top = bounds
    columns = divide_evenly(left, right, 2.2)[:-1].tolist()
    rows = divide_evenly(bottom, top, 2.0)[:-1].tolist()
    length, depth = _PALLET_SIZE_M
    for x, y in itertools.product(columns, rows):
        if rng.random() < _PALLET_PROBABILITY:
            drawing.add_block(x, y, x + length, y + depth)
