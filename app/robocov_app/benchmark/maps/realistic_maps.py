"""Random maps that resemble real places: homes, offices, yards, factories, and halls with traffic.

Lengths are in meters. Coordinates are rounded to centimeters, so that they are the same on every machine.
"""

import itertools
from collections.abc import Callable

import numpy as np
import shapely

from robocov.environment import (
    CircleObstacle,
    Environment,
    Obstacle,
    ObstaclePath,
    PolygonObstacle,
    WallObstacle,
)
from robocov.typing import FloatArray
from robocov_app.benchmark.maps.plan_search import find_valid_map
from robocov_app.benchmark.maps.plan_shapes import (
    INNER_WALL_M,
    FloorPlan,
    build_block,
    build_box,
    build_rotated_block,
    build_wall_with_door,
    round_points,
)

_SEED_ORDER = ("homes", "offices", "plants", "traffic", "yards")
"""Kinds in the order that determines their seeds; append new kinds, so that other seeds do not change."""
_HALF_WALL_M = INNER_WALL_M / 2.0
_START_RADIUS_M = 0.6
"""Radius of the start disc."""
_MIN_BLOCKED_FRACTION = 0.04
"""Minimum area of the obstacles divided by the area of the map."""

# Floor plans are frozen: a different number gives different maps. Sizes that vary are in the functions.
_HOME_DOOR_MARGIN_M = 0.8
"""Minimum distance of the middle of a door from the ends of its wall."""
_FREE_WIDTH_AROUND_FURNITURE_M = 2.2
_OFFICE_DOOR_MARGIN_M = 0.7
_OFFICE_DOOR_WIDTH_M = 0.9
_SHELF_PROBABILITY = 0.6
_SHELF_END_M = 1.2
_SHELF_DEPTH_M = 0.7
"""A shelf is in the upper left corner of an office, up to this distance from its left and upper wall."""
_OPEN_SPACE_DOOR_WIDTH_M = 1.2
_DESK_SIZE_M = (1.6, 0.8)
_DESK_PROBABILITY = 0.85
_FIRST_DESK_X_M = 2.2
_LAST_DESK_MARGIN_M = 2.5
_LOWER_DESKS_Y_M = 1.3
_UPPER_DESKS_MARGIN_M = 1.9
_YARD_CENTER_M = (10.0, 8.0)
_YARD_RADII_M = (9.0, 7.5)
_YARD_CORNERS = 7
_YARD_GAP_M = 0.7
"""Minimum distance of the shapes in a yard from each other and from the boundary."""
_POND_CORNERS = 14
_HEDGE_WIDTH_M = 0.3
_RACK_DEPTH_M = 0.7
_FIRST_RACK_Y_M = 2.0
_GATE_MARGIN_M = 2.0
_MACHINE_MARGIN_M = 1.4
"""Minimum distance of the middle of a machine from outer walls, and of the last rack from the upper one."""
_MACHINE_PARTITION_MARGIN_M = 1.6
_MACHINE_GAP_M = 0.9
_MAX_MACHINES = 7
_MACHINE_ATTEMPTS = 30
_HALF_CROSS_AISLE_M = 0.8
"""Half the width of the gap in a row of shelves in a hall with vehicles."""
_SHELF_ROWS_Y_M = (3.0, 7.2)
_AISLES_Y_M = (5.7, 9.6, 1.5)
"""Aisles of the vehicles, one for each vehicle; there is not always a third vehicle."""


def build_floor_plan(kind: str, seed: int) -> Environment:
    """Build a random map of a kind.

    Plans are sampled until one is suitable, as in `find_valid_map`.

    Parameters
    ----------
    kind : str
        Name of a kind in `FLOOR_PLANS`.
    seed : int
        Seed of the random numbers.

    Returns
    -------
    Environment
        The map, with a start named "entry" near its lower left corner.

    Raises
    ------
    NoLayoutError
        If no plan with this seed is suitable.
    """
    return find_valid_map(
        kind,
        seed,
        kind_number=_SEED_ORDER.index(kind),
        sample_plan=FLOOR_PLANS[kind],
        start_radius=_START_RADIUS_M,
        min_blocked_fraction=_MIN_BLOCKED_FRACTION,
    )


def _build_circle(center: FloatArray, radius: float) -> Obstacle:
    return CircleObstacle(round_points(center[None])[0], round(radius, 2))


def _build_home(rng: np.random.Generator) -> FloorPlan:
    """Build a home: a rectangle divided repeatedly into rooms.

    Each inner wall has a door, and large rooms have a piece of furniture.
    """
    width = rng.uniform(10.0, 14.0)
    height = rng.uniform(8.0, 11.0)
    home = _Home(rng)
    home.divide(0.0, 0.0, width, height)
    return FloorPlan(build_box(0.0, 0.0, width, height), [*home.walls, *home.furniture])


class _Home:
    """The walls and the furniture of a home, which is divided into rooms."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.walls: list[Obstacle] = []
        self.furniture: list[Obstacle] = []
        self._rng = rng

    def divide(self, left: float, bottom: float, right: float, top: float) -> None:
        """Divide a rectangle by walls across its longer side until only rooms remain, and furnish them."""
        is_wide = right - left > top - bottom
        if is_wide:
            split = self._add_wall(left, right, start=bottom, end=top, is_vertical=True)
        else:
            split = self._add_wall(bottom, top, start=left, end=right, is_vertical=False)
        if split is None:
            self._furnish(left, bottom, right, top)
        elif is_wide:
            self.divide(left, bottom, split, top)
            self.divide(split, bottom, right, top)
        else:
            self.divide(left, bottom, right, split)
            self.divide(left, split, right, top)

    def _add_wall(
        self, low: float, high: float, *, start: float, end: float, is_vertical: bool
    ) -> float | None:
        """Add a wall with a door near the middle of a range.

        Parameters
        ----------
        low, high : float, m
            Range that the wall divides, perpendicular to its direction.
        start, end : float, m
            Ends of the wall along its direction.
        is_vertical : bool
            Whether the wall is parallel to the y axis, instead of the x axis.

        Returns
        -------
        float or None, m
            Position of the wall. If the range is only wide enough for one room, no wall is added, and the
            result is None.
        """
        rng = self._rng
        min_width_of_two_rooms = rng.uniform(4.6, 6.4)
        if high - low < min_width_of_two_rooms:
            return None
        split = low + (high - low) * rng.uniform(0.38, 0.62)
        door = rng.uniform(start + _HOME_DOOR_MARGIN_M, end - _HOME_DOOR_MARGIN_M)
        door_width = rng.uniform(0.8, 1.1)
        self.walls += build_wall_with_door(
            split, start, end, door=door, door_width=door_width, is_vertical=is_vertical
        )
        return split

    def _furnish(self, left: float, bottom: float, right: float, top: float) -> None:
        """Place a piece of furniture in a random corner of a room, if the room is large enough."""
        rng = self._rng
        width = rng.uniform(0.5, 1.6)
        depth = rng.uniform(0.4, 0.9)
        free_width = _FREE_WIDTH_AROUND_FURNITURE_M
        if right - left > width + free_width and top - bottom > depth + free_width:
            x = left + _HALF_WALL_M if rng.random() < 0.5 else right - _HALF_WALL_M - width
            y = bottom + _HALF_WALL_M if rng.random() < 0.5 else top - _HALF_WALL_M - depth
            self.furniture.append(build_block(x, y, width, depth))


def _build_office(rng: np.random.Generator) -> FloorPlan:
    """Build an office floor: offices on one side of a corridor, an open space with desks on the other."""
    width = rng.uniform(16.0, 20.0)
    height = rng.uniform(10.0, 12.0)
    corridor_low = height * rng.uniform(0.48, 0.56)
    corridor_high = corridor_low + rng.uniform(1.4, 1.9)
    # The order determines which random numbers each group of obstacles gets, and must not change.
    obstacles = [
        *_build_offices(rng, width, corridor_high, height),
        *_build_open_space_wall(rng, width, corridor_low),
        *_build_desks(rng, width, corridor_low),
    ]
    return FloorPlan(build_box(0.0, 0.0, width, height), obstacles)


def _build_offices(rng: np.random.Generator, width: float, low: float, high: float) -> list[Obstacle]:
    """Build a row of offices between two heights: walls, doors to the corridor, and some shelves."""
    obstacles: list[Obstacle] = []
    partitions = np.linspace(0.0, width, int(rng.integers(5, 8)))
    partitions[1:-1] += rng.uniform(-0.4, 0.4, len(partitions) - 2)
    for left, right in itertools.pairwise(partitions.tolist()):
        door = rng.uniform(left + _OFFICE_DOOR_MARGIN_M, right - _OFFICE_DOOR_MARGIN_M)
        obstacles += build_wall_with_door(
            low, left, right, door=door, door_width=_OFFICE_DOOR_WIDTH_M, is_vertical=False
        )
        if right < width:
            obstacles.append(WallObstacle(round_points([(right, low), (right, high)]), INNER_WALL_M))
        if rng.random() < _SHELF_PROBABILITY:
            shelf = build_box(left + _HALF_WALL_M, high - _SHELF_DEPTH_M, left + _SHELF_END_M, high)
            obstacles.append(PolygonObstacle(shelf))
    return obstacles


def _build_open_space_wall(rng: np.random.Generator, width: float, y: float) -> list[Obstacle]:
    """Build the wall between the corridor and the open space, with two doors."""
    left_door = width * rng.uniform(0.15, 0.35)
    right_door = width * rng.uniform(0.65, 0.85)
    middle = width / 2.0
    walls: list[Obstacle] = []
    for start, end, door in ((0.0, middle, left_door), (middle, width, right_door)):
        walls += build_wall_with_door(
            y, start, end, door=door, door_width=_OPEN_SPACE_DOOR_WIDTH_M, is_vertical=False
        )
    return walls


def _build_desks(rng: np.random.Generator, width: float, depth: float) -> list[Obstacle]:
    """Build two rows of desks in an open space of the given width and depth."""
    columns_x = np.arange(_FIRST_DESK_X_M, width - _LAST_DESK_MARGIN_M, rng.uniform(2.9, 3.6))
    rows_y = (_LOWER_DESKS_Y_M, depth - _UPPER_DESKS_MARGIN_M)
    corners = itertools.product(columns_x, rows_y)
    return [build_block(x, y, *_DESK_SIZE_M) for x, y in corners if rng.random() < _DESK_PROBABILITY]


def _remove_near_shapes(shapes: list[Obstacle], gap: float) -> list[Obstacle]:
    """Return the shapes that are at least `gap` apart. Of two shapes that are closer, the first is kept."""
    spaced: list[Obstacle] = []
    for shape in shapes:
        if all(shape.polygon.distance(other.polygon) >= gap for other in spaced):
            spaced.append(shape)
    return spaced


def _build_yard(rng: np.random.Generator) -> FloorPlan:
    """Build a yard: a convex piece of land with houses, a pond, hedges and trees."""
    offsets = rng.uniform(-0.25, 0.25, _YARD_CORNERS)
    angles = np.sort((np.arange(_YARD_CORNERS) + offsets) * 2.0 * np.pi / _YARD_CORNERS)
    center_x, center_y = _YARD_CENTER_M
    radius_x, radius_y = _YARD_RADII_M
    corners_x = center_x + radius_x * np.cos(angles)
    corners_y = center_y + radius_y * np.sin(angles)
    corners = np.column_stack([corners_x, corners_y])
    hull = shapely.orient_polygons(shapely.convex_hull(shapely.MultiPoint(corners)))
    boundary = round_points(np.asarray(hull.exterior.coords)[:-1])

    # Large shapes come first, because of two shapes that are too close, the later one is removed.
    builders = [_build_house] * 5 + [_build_pond] + [_build_hedge] * 6 + [_build_tree] * 14
    shapes = [build(rng) for build in builders]
    land = shapely.Polygon(boundary)
    inside = [shape for shape in shapes if land.contains(shape.polygon)]
    clear = [shape for shape in inside if land.exterior.distance(shape.polygon) > _YARD_GAP_M]
    return FloorPlan(boundary, _remove_near_shapes(clear, _YARD_GAP_M))


def _sample_yard_point(rng: np.random.Generator) -> FloatArray:
    """Sample a point from the rectangle around the middle of a yard."""
    return np.array([rng.uniform(3.0, 17.0), rng.uniform(2.5, 13.5)])


def _build_house(rng: np.random.Generator) -> Obstacle:
    center = _sample_yard_point(rng)
    width = rng.uniform(2.0, 3.6)
    depth = rng.uniform(1.6, 2.6)
    return build_rotated_block(center, width, depth, rng.uniform(0.0, np.pi))


def _build_pond(rng: np.random.Generator) -> Obstacle:
    """Build a pond: a polygon, roughly an ellipse with a wavy shore."""
    angles = np.linspace(0.0, 2.0 * np.pi, _POND_CORNERS, endpoint=False)
    radius = rng.uniform(0.9, 1.5) * (1.0 + 0.2 * np.sin(2.0 * angles + rng.uniform(0.0, 6.0)))
    shore = radius[:, None] * np.column_stack([1.4 * np.cos(angles), np.sin(angles)])
    return PolygonObstacle(round_points(_sample_yard_point(rng) + shore))


def _build_hedge(rng: np.random.Generator) -> Obstacle:
    """Build a hedge: a wall of two equal legs with a right angle between them."""
    start = _sample_yard_point(rng)
    angle = rng.uniform(0.0, np.pi)
    along = np.array((np.cos(angle), np.sin(angle)))
    across = np.array((-np.sin(angle), np.cos(angle)))
    leg_length = rng.uniform(1.4, 2.4)
    corners = leg_length * np.array([np.zeros(2), along, along + across])
    return WallObstacle(round_points(start + corners), _HEDGE_WIDTH_M)


def _build_tree(rng: np.random.Generator) -> Obstacle:
    center = _sample_yard_point(rng)
    return _build_circle(center, rng.uniform(0.2, 0.45))


def _build_factory(rng: np.random.Generator) -> FloorPlan:
    """Build a factory: racks in rows, and behind a partition with a gate, machines and columns."""
    width = rng.uniform(15.0, 19.0)
    height = rng.uniform(10.0, 13.0)
    split = width * rng.uniform(0.48, 0.58)
    gate = rng.uniform(_GATE_MARGIN_M, height - _GATE_MARGIN_M)
    gate_width = rng.uniform(1.4, 2.2)
    obstacles = build_wall_with_door(split, 0.0, height, door=gate, door_width=gate_width, is_vertical=True)
    for y in np.arange(_FIRST_RACK_Y_M, height - _MACHINE_MARGIN_M, rng.uniform(1.9, 2.4)):
        left = rng.uniform(1.2, 2.2)
        right = split - rng.uniform(1.2, 1.8)
        obstacles.append(PolygonObstacle(build_box(left, y, right, y + _RACK_DEPTH_M)))
    shapes: list[Obstacle] = []
    margin = _MACHINE_MARGIN_M
    for number in range(_MACHINE_ATTEMPTS):
        x = rng.uniform(split + _MACHINE_PARTITION_MARGIN_M, width - margin)
        y = rng.uniform(margin, height - margin)
        center = np.array([x, y])
        # Every third shape is round.
        if number % 3 == 2:
            shapes.append(_build_circle(center, rng.uniform(0.2, 0.7)))
            continue
        block_width = rng.uniform(0.8, 2.0)
        block_depth = rng.uniform(0.6, 1.2)
        shapes.append(build_rotated_block(center, block_width, block_depth, rng.choice([0.0, 0.6, 1.2])))
    machines = _remove_near_shapes(shapes, _MACHINE_GAP_M)[:_MAX_MACHINES]
    return FloorPlan(build_box(0.0, 0.0, width, height), [*obstacles, *machines])


def _build_traffic(rng: np.random.Generator) -> FloorPlan:
    """Build a hall with shelves, and two or three vehicles that drive back and forth in the aisles."""
    width = 16.0
    height = 11.0
    obstacles: list[Obstacle] = []
    left = rng.uniform(4.2, 5.0)
    right = width - rng.uniform(2.2, 3.0)
    for y in _SHELF_ROWS_Y_M:
        middle = rng.uniform(8.2, 9.8)
        for start, end in ((left, middle - _HALF_CROSS_AISLE_M), (middle + _HALF_CROSS_AISLE_M, right)):
            obstacles.append(PolygonObstacle(build_box(start, y, end, y + rng.uniform(0.8, 1.3))))
    vehicles = int(rng.integers(2, 4))
    for y in _AISLES_Y_M[:vehicles]:
        ends = round_points([(rng.uniform(4.0, 5.0), y), (rng.uniform(11.5, 14.0), y)])
        path = ObstaclePath(ends, round(rng.uniform(0.2, 0.4), 2), "back-and-forth")
        obstacles.append(CircleObstacle(ends[0], round(rng.uniform(0.3, 0.45), 2), path=path))
    return FloorPlan(build_box(0.0, 0.0, width, height), obstacles)


FLOOR_PLANS: dict[str, Callable[[np.random.Generator], FloorPlan]] = {
    "homes": _build_home,
    "offices": _build_office,
    "yards": _build_yard,
    "plants": _build_factory,
    "traffic": _build_traffic,
}
"""Functions that build a random plan, by the name of its kind."""
