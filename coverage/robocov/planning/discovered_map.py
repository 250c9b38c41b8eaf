"""The occupancy grid of one robot, built from range scans.

All cells are *unknown* at first. A cell becomes *free* when a ray or a robot passes through it. It becomes a
*wall* when a ray ends in it, and remains one until several later rays have passed through it. If the ends of
neighboring rays are close together, they are taken to belong to one surface: the cells between them are
*presumed walls* until a ray passes through them. Routes may lead through unknown cells. In the coverage cost,
unknown cells are weighted by their `openness`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robocov.compiled import kernel
from robocov.observation import compute_ray_directions
from robocov.planning.raster import CellGrid, Raster, find_column, find_row
from robocov.typing import BoolArray, FloatArray

UNKNOWN = 0
FREE = 1
PRESUMED_WALL = 2
WALL = 3
CERTAIN_WALL = 6
"""States of a cell. All values from `WALL` to `CERTAIN_WALL` are walls; higher ones are more certain."""

MAX_BRIDGED_GAP_M = 0.5
"""Maximum gap between the ends of neighboring rays that is presumed to be wall.

It must not exceed the width of the passages that a robot should find. Otherwise, doors seen from afar would
be closed.
"""
_RAY_STEP_CELLS = 0.7
"""Distance between the sampled points of a ray."""
_END_DEPTH_CELLS = 0.25
"""Distance beyond the end of a ray at which its hit is counted, since the end may lie between two cells."""
_CORE_HALF_WIDTH_CELLS = 0.3
"""Distance from the center of a presumed wall, in x and y, within which a ray must pass to free the cell."""


@dataclass(frozen=True, eq=False)
class DiscoveredMap:
    """The occupancy grid of a robot. It is immutable: methods that add to it return a new map.

    Attributes
    ----------
    raster : Raster
    state : (rows, columns) uint8 array
        `UNKNOWN`, `FREE`, `PRESUMED_WALL`, or a value from `WALL` to `CERTAIN_WALL`, the lowest row first.
        The array is made read-only.
    """

    raster: Raster
    state: NDArray[np.uint8]

    def __post_init__(self) -> None:
        self.state.setflags(write=False)

    @classmethod
    def build_unknown(cls, raster: Raster) -> DiscoveredMap:
        """Build the map of a robot that has seen nothing yet.

        Parameters
        ----------
        raster : Raster

        Returns
        -------
        DiscoveredMap
        """
        return cls(raster, np.zeros(raster.shape, dtype=np.uint8))

    def __deepcopy__(self, memo: object) -> DiscoveredMap:
        # Copies share the object, because it never changes.
        return self

    @cached_property
    def is_blocked(self) -> BoolArray:
        """Whether each cell is a wall, a presumed wall, or outside the region, (rows, columns)."""
        return np.asarray((self.state >= PRESUMED_WALL) | self.raster.is_outside)

    def add_scan(self, position: FloatArray, distances: FloatArray, is_hit: BoolArray) -> DiscoveredMap:
        """Return the map updated by one scan of a range sensor.

        Cells that rays pass through become free, cells in which they hit an obstacle become walls, and cells
        between hits on the same surface become presumed walls.

        Parameters
        ----------
        position : (2,) array, m
            Position from which the scan was taken.
        distances : (rays,) array, m
            Lengths of rays that are evenly spaced around a full turn, the first along +x.
        is_hit : (rays,) bool array
            Whether each ray ends at an obstacle.

        Returns
        -------
        DiscoveredMap
            This map itself if the scan adds nothing to it.
        """
        return self.add_scans(position[None], distances[None], is_hit[None])

    def add_scans(
        self,
        positions: FloatArray,
        distances: FloatArray,
        is_hit: BoolArray,
        robot_radius: float | None = None,
    ) -> DiscoveredMap:
        """Return the map updated by several scans, one after another; see `add_scan`.

        Parameters
        ----------
        positions : (k, 2) array, m
        distances : (k, rays) array, m
        is_hit : (k, rays) bool array
        robot_radius : float or None, m
            Radius around each position within which cells become free, unless they are walls. None: only
            the cells that rays pass through become free.

        Returns
        -------
        DiscoveredMap
            This map itself if the scans add nothing to it.
        """
        state = self.state.copy()
        grid = self.raster.grid
        directions = compute_ray_directions(distances.shape[1])
        # No ray inside the region is longer than its diameter, and the map does not extend beyond it.
        lengths = np.minimum(distances, self.raster.region.diameter)
        for scan, position in enumerate(positions):
            _mark_passed_cells(state, grid, position, directions, lengths[scan])
            ends = _compute_ray_ends(grid, position, directions, lengths[scan])
            _mark_presumed_walls(state, grid, ends, is_hit[scan])
            _mark_hit_cells(state, grid, ends, is_hit[scan])
            if robot_radius is not None:
                _mark_robots(state, grid, positions[scan : scan + 1], robot_radius)
        return self._replace_state(state)

    def add_robots(self, positions: FloatArray, radius: float) -> DiscoveredMap:
        """Return the map with the cells that robots cover marked as free, except for walls.

        Presumed walls also become free.

        Parameters
        ----------
        positions : (k, 2) array, m
        radius : float, m

        Returns
        -------
        DiscoveredMap
            This map itself if nothing changes.
        """
        state = self.state.copy()
        _mark_robots(state, self.raster.grid, positions, radius)
        return self._replace_state(state)

    def replace_cells(self, is_replaced: BoolArray, other: DiscoveredMap) -> DiscoveredMap:
        """Return the map with some cells of another map of the same raster.

        Parameters
        ----------
        is_replaced : (rows, columns) bool array
            Cells to take from the other map.
        other : DiscoveredMap

        Returns
        -------
        DiscoveredMap
            This map itself if nothing changes.
        """
        return self._replace_state(np.where(is_replaced, other.state, self.state))

    def count_changed_walls(self, earlier: DiscoveredMap) -> int:
        """Count the cells where walls have disappeared, or appeared in open space, since an earlier map.

        Parameters
        ----------
        earlier : DiscoveredMap

        Returns
        -------
        int
        """
        if earlier is self:
            return 0
        # A wall that has appeared is one that would disappear if time ran backwards.
        disappeared = _count_opened_walls(earlier.state, self.state)
        appeared = _count_opened_walls(self.state, earlier.state)
        return disappeared + appeared

    def _replace_state(self, state: NDArray[np.uint8]) -> DiscoveredMap:
        """Return a map with another state, or this map itself if the state is equal."""
        if np.array_equal(state, self.state):
            return self
        return DiscoveredMap(self.raster, state)


def dilate(is_marked: BoolArray, radius: float, *, is_outside_marked: bool = True) -> BoolArray:
    """Find the cells close to marked ones.

    Parameters
    ----------
    is_marked : (rows, columns) bool array
    radius : float
        Maximum distance between the center of a cell and that of a marked cell, in cells.
    is_outside_marked : bool
        Whether everything outside the array counts as marked.

    Returns
    -------
    (rows, columns) bool array

    Examples
    --------
    >>> cells = np.zeros((5, 5), dtype=bool)
    >>> cells[2, 2] = True
    >>> dilate(cells, 1.0).astype(int)[1:4, 1:4]
    array([[0, 1, 0],
           [1, 1, 1],
           [0, 1, 0]])
    """
    rows, columns = is_marked.shape
    # A view of the padded array that starts at (margin + up, margin + right) contains, for each cell, the one
    # that is `up` rows above it and `right` columns to the right.
    margin = int(radius)
    padded = np.pad(is_marked, margin, constant_values=is_outside_marked)
    is_close = np.zeros_like(is_marked)
    for up in range(-margin, margin + 1):
        for right in range(-margin, margin + 1):
            if up**2 + right**2 <= radius * radius:
                first_row = margin + up
                first_column = margin + right
                is_close |= padded[first_row : first_row + rows, first_column : first_column + columns]
    return is_close


@kernel
def _count_opened_walls(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> int:
    """Count the cells that were walls before, and are now free together with their eight neighbors.

    Cells at the border of a wall do not count, because they may be free or wall, depending on the position
    from which they are scanned.
    """
    count = 0
    rows, columns = before.shape
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            if before[row, column] >= WALL and _is_open(after, row, column):
                count += 1
    return count


@kernel
def _is_open(state: NDArray[np.uint8], row: int, column: int) -> bool:
    """Return whether a cell and its eight neighbors are free."""
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            if state[i, j] != FREE:
                return False
    return True


@kernel
def _mark_passed_cells(
    state: NDArray[np.uint8],
    grid: CellGrid,
    position: FloatArray,
    directions: FloatArray,
    lengths: FloatArray,
) -> None:
    """Mark the cells that rays pass through as free, or as less certain walls.

    The states of walls are numbers from `WALL`, the least certain, to `CERTAIN_WALL`. Rays are sampled at
    regular steps, and the last step before their ends is left out. Each sample in a wall lowers its number by
    1, and a wall whose number is `WALL` becomes free. A ray has one or two samples in a cell that it crosses,
    so that two to four rays remove a certain wall.
    """
    rows, columns = state.shape
    step = _RAY_STEP_CELLS * grid.cell_size
    for ray in range(len(lengths)):
        # Distance of the sampled point from the robot.
        along = 0.5 * _RAY_STEP_CELLS * grid.cell_size
        while along < lengths[ray] - step:
            x = position[0] + along * directions[ray, 0]
            y = position[1] + along * directions[ray, 1]
            row = find_row(y, grid, rows)
            column = find_column(x, grid, columns)
            cell_state = state[row, column]
            if cell_state in (UNKNOWN, WALL):
                state[row, column] = FREE
            elif cell_state > WALL:
                state[row, column] = cell_state - 1
            elif cell_state == PRESUMED_WALL:
                # The offset of the point from the center of the cell, in cells. A ray that only cuts a corner
                # of the cell does not show that the cell is free.
                offset_x = (x - grid.low_x) / grid.cell_size - column - 0.5
                offset_y = (y - grid.low_y) / grid.cell_size - row - 0.5
                if max(abs(offset_x), abs(offset_y)) < _CORE_HALF_WIDTH_CELLS:
                    state[row, column] = FREE
            along += step


@kernel
def _compute_ray_ends(
    grid: CellGrid, position: FloatArray, directions: FloatArray, lengths: FloatArray
) -> FloatArray:
    """Compute points, (rays, 2) m, just inside the obstacles at the ends of the rays."""
    ends = np.empty(directions.shape)
    for ray in range(len(lengths)):
        length = lengths[ray] + _END_DEPTH_CELLS * grid.cell_size
        ends[ray, 0] = position[0] + length * directions[ray, 0]
        ends[ray, 1] = position[1] + length * directions[ray, 1]
    return ends


@kernel
def _mark_presumed_walls(
    state: NDArray[np.uint8], grid: CellGrid, ends: FloatArray, is_hit: BoolArray
) -> None:
    """Mark unknown cells between the ends of neighboring rays as presumed walls, and known walls as certain.

    If the ends of two neighboring rays are close together, both have probably hit the same surface.
    """
    rows, columns = state.shape
    half_cell = 0.5 * grid.cell_size
    step_count = math.ceil(MAX_BRIDGED_GAP_M / half_cell)
    for ray in range(len(ends)):
        next_ray = (ray + 1) % len(ends)
        dx = ends[next_ray, 0] - ends[ray, 0]
        dy = ends[next_ray, 1] - ends[ray, 1]
        gap = math.sqrt(dx * dx + dy * dy)
        if not (is_hit[ray] and is_hit[next_ray] and half_cell < gap < MAX_BRIDGED_GAP_M):
            continue
        for step in range(1, step_count):
            row = find_row(ends[ray, 1] + dy * step / step_count, grid, rows)
            column = find_column(ends[ray, 0] + dx * step / step_count, grid, columns)
            if state[row, column] == UNKNOWN:
                state[row, column] = PRESUMED_WALL
            elif state[row, column] >= WALL:
                state[row, column] = CERTAIN_WALL


@kernel
def _mark_hit_cells(state: NDArray[np.uint8], grid: CellGrid, ends: FloatArray, is_hit: BoolArray) -> None:
    """Mark the cells in which rays have hit an obstacle as walls."""
    rows, columns = state.shape
    for ray in range(len(ends)):
        if is_hit[ray]:
            row = find_row(ends[ray, 1], grid, rows)
            column = find_column(ends[ray, 0], grid, columns)
            state[row, column] = CERTAIN_WALL


@kernel
def _mark_robots(state: NDArray[np.uint8], grid: CellGrid, positions: FloatArray, radius: float) -> None:
    """Mark the cells whose center is within a radius of a robot as free; only walls that rays hit remain."""
    rows, columns = state.shape
    for x, y in positions:
        first_column = find_column(x - radius, grid, columns)
        last_column = find_column(x + radius, grid, columns)
        for row in range(find_row(y - radius, grid, rows), find_row(y + radius, grid, rows) + 1):
            for column in range(first_column, last_column + 1):
                offset_x = grid.low_x + (column + 0.5) * grid.cell_size - x
                offset_y = grid.low_y + (row + 0.5) * grid.cell_size - y
                is_within_radius = offset_x * offset_x + offset_y * offset_y <= radius * radius
                if state[row, column] < WALL and is_within_radius:
                    state[row, column] = FREE
