"""Exact shortest distances and paths in the free space of a map."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol, TypeVar

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray, IntArray, compute_lengths
from robocov.compiled import kernel
from robocov.environment import GRID_M, Environment
from robocov.errors import InputError
from robocov.geodesic.angular_index import NO_SPACE, AngularWallIndex, add_walls, is_visible
from robocov.geodesic.corner_graph import (
    NO_CORNER,
    CornerGraph,
    CornerPaths,
    CornerQueue,
    build_corner_graph,
    find_links,
    find_visible_corners,
    relax_paths,
)
from robocov.geodesic.grid import Grid
from robocov.geodesic.walls import Walls, build_walls, count_windings

_Result = TypeVar("_Result")

SOURCE_BINS = 128
"""Number of angular bins per source."""
_CORNER_BINS = 256
"""Number of angular bins for a corner. There are more, since many targets are tested from it."""
_CORNERS_PER_REPORT = 64
"""Number of corners that are processed between two progress reports."""
_TARGETS_PER_BLOCK = 1024
"""Number of targets that are indexed at the same time, which limits the memory."""
_INITIAL_ENTRIES_PER_SOURCE = {SOURCE_BINS: 256, _CORNER_BINS: 1 << 14}
"""Initial number of index entries per source, by number of bins. It is doubled whenever it is too small."""
_MAX_DEPTH_M = 2.0 * GRID_M
"""Points up to this depth in an obstacle are moved to free space; see also `_MAX_RELATIVE_DEPTH`."""
_MAX_RELATIVE_DEPTH = 1e-9
"""The same for large maps, as a fraction of the size of the map."""
_SNAP_STEPS = 2
"""Number of grid steps around the nearest point of a slanted wall where a free point is searched for."""


class CornerComputation(Protocol):
    """A computation that produces rows for the corners from `first` up to `end`.

    It writes whole numbers, such as the indices of corners, to `indices`, and the lengths that belong to them
    to `lengths`. It chooses the columns of both. It returns the number of rows that it has written, or
    `NO_SPACE` if there was not enough space for them or in the index.
    """

    def __call__(
        self, first: int, end: int, index: AngularWallIndex, indices: IntArray, lengths: Array, /
    ) -> int:
        """Write rows of `indices` and `lengths`."""


class Geodesics:
    """The shortest paths in the free space of one environment.

    The distance between two points is the infimum over the paths in the *open* free space, extended to its
    closure: no path leads through a point or along an edge where two obstacles touch. A shortest path is a
    chain of segments that bends only at corners.

    Parameters
    ----------
    environment : Environment
    heartbeat : callable, optional
        Called regularly while the graph of the corners is computed. It may raise an exception to stop.

    Attributes
    ----------
    grid : Grid
    size : float, m
        Side of the square around the region's bounding box.
    free : shapely.MultiPolygon, grid steps
        The free space, one polygon for each component.
    walls : Walls
    corners : (k, 2) array, m
    graph : CornerGraph

    Examples
    --------
    >>> from robocov.environment import PolygonObstacle
    >>> wall = PolygonObstacle(((1.0, 0.0), (2.0, 0.0), (2.0, 3.0), (1.0, 3.0)))
    >>> room = Environment("room", ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)), (wall,))
    >>> geodesics = Geodesics(room)
    >>> geodesics.find_path(source=[0.5, 2.0], target=[2.0, 0.0])
    array([[0.5, 2. ],
           [1. , 3. ],
           [2. , 3. ],
           [2. , 0. ]])
    >>> geodesics.compute_distances(sources=[[0.5, 2.0]], targets=[[2.0, 0.0], [0.5, 0.0]]).round(3)
    array([[5.118, 2.   ]])
    """

    def __init__(self, environment: Environment, heartbeat: Callable[[], None] | None = None) -> None:
        low_x, low_y, high_x, high_y = environment.region.bounds
        self.size = max(high_x - low_x, high_y - low_y)
        self.grid = Grid.from_square(np.array([low_x, low_y]), self.size)
        self.free = shapely.transform(environment.free, self.grid.snap)
        self.walls: Walls = build_walls(self.free)
        self.corners = self.grid.to_meters(self.walls.corners)
        self._name = environment.name
        self._entries_per_source = dict(_INITIAL_ENTRIES_PER_SOURCE)
        self.graph = self._build_graph(heartbeat)

    def _build_graph(self, heartbeat: Callable[[], None] | None) -> CornerGraph:
        """Build the graph of the corners that see each other."""
        count = len(self.corners)
        visible_buffer = np.empty(count, np.int64)  # Scratch space of `find_links`.
        pairs, lengths = self.run_for_corners(
            partial(find_links, self.walls, visible_buffer),
            index_columns=2,
            length_columns=1,
            progress=None if heartbeat is None else lambda _: heartbeat(),
        )
        return build_corner_graph(count, pairs, lengths[:, 0])

    def run_for_corners(
        self,
        compute: CornerComputation,
        index_columns: int,
        length_columns: int,
        progress: Callable[[float], None] | None = None,
    ) -> tuple[IntArray, Array]:
        """Run a computation for all corners, a batch at a time.

        Parameters
        ----------
        compute : callable
            See `CornerComputation`. The index that it is called with has space for one source.
        index_columns, length_columns : int
            Number of columns of `indices` and of `lengths`.
        progress : callable, optional
            Called with the completed fraction. It may raise an exception to stop.

        Returns
        -------
        indices : (r, index_columns) int array
        lengths : (r, length_columns) array, grid steps
            All rows that `compute` has written.
        """
        count = len(self.corners)
        all_indices = [np.empty((0, index_columns), np.int64)]
        all_lengths = [np.empty((0, length_columns))]
        for first in range(0, count, _CORNERS_PER_REPORT):
            if progress is not None:
                progress(first / count)
            end = min(first + _CORNERS_PER_REPORT, count)
            compute_batch = partial(compute, first, end)
            indices, lengths = self._run_for_batch(compute_batch, index_columns, length_columns)
            all_indices.append(indices)
            all_lengths.append(lengths)
        return np.concatenate(all_indices), np.concatenate(all_lengths)

    def _run_for_batch(
        self,
        compute: Callable[[AngularWallIndex, IntArray, Array], int],
        index_columns: int,
        length_columns: int,
    ) -> tuple[IntArray, Array]:
        """Return the rows that a computation writes for one batch of corners.

        The computation fills `indices` and `lengths`, and returns the number of rows, or `NO_SPACE` if they
        or the wall index are too small. It is then repeated with more space.
        """

        def compute_rows(index: AngularWallIndex) -> tuple[IntArray, Array] | None:
            """Return the indices and lengths; None if there is not enough space."""
            max_rows = len(index.entry_wall)
            indices = np.empty((max_rows, index_columns), np.int64)
            lengths = np.empty((max_rows, length_columns))
            row_count = compute(index, indices, lengths)
            if row_count == NO_SPACE:
                return None
            return indices[:row_count].copy(), lengths[:row_count].copy()

        return self.run_with_index(source_count=1, bin_count=_CORNER_BINS, compute=compute_rows)

    def run_with_index(
        self, source_count: int, bin_count: int, compute: Callable[[AngularWallIndex], _Result | None]
    ) -> _Result:
        """Run a computation with a new index; repeat it with a larger one until there is enough space.

        Parameters
        ----------
        source_count : int
            Number of sources of the index.
        bin_count : int
            Number of bins of each source.
        compute : callable
            Called with the index. It returns None if there was not enough space.

        Returns
        -------
        object
            What `compute` has returned.
        """
        while True:
            # `add_walls` keeps one entry per bin free for the wall that it adds.
            max_entries = self._entries_per_source[bin_count] * source_count + 2 * bin_count
            result = compute(AngularWallIndex.allocate(source_count, bin_count, max_entries))
            if result is not None:
                return result
            self._entries_per_source[bin_count] *= 2

    def snap_to_free_space(self, points: Array, name: str = "positions") -> tuple[Array, BoolArray]:
        """Convert points of the free space to grid coordinates.

        Points that are outside by no more than rounding (2 µm plus 1e-9 of the map's size) are moved to the
        nearest point inside.

        Parameters
        ----------
        points : (n, 2) array, m
        name : str
            Name of the points in messages.

        Returns
        -------
        grid_positions : (n, 2) array, grid steps
        is_inside : (n, c) bool array
            Whether each point is in the closure of each component of the free space.

        Raises
        ------
        InputError
            If the points have the wrong shape, are not finite, or are outside the free space.
        """
        points = np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2:
            raise InputError(
                f"{name}: expected an array of shape (n, 2), [x, y] in meters each, got shape {points.shape}"
            )
        grid_positions = self.grid.snap(points)
        # A point that is not finite counts as outside, like a point to the right of all walls, or above them.
        is_inside = self.count_windings(grid_positions) > 0
        for i in np.flatnonzero(~is_inside.any(axis=1)).tolist():
            grid_positions[i] = self._move_inside(points[i], f"{name}[{i}]")
            is_inside[i] = self.count_windings(grid_positions[i : i + 1])[0] > 0
        return grid_positions, is_inside

    def _move_inside(self, point: Array, name: str) -> Array:
        """Return the free grid point nearest to a point in meters; raise InputError if it is too far away."""
        coordinates = f"[{point[0]:.12g}, {point[1]:.12g}]"
        if not np.isfinite(point).all():
            raise InputError(f"{name}: expected finite numbers, got {coordinates}")
        grid_position = self.grid.snap(point)
        nearest = self._find_nearest_free(grid_position)
        depth = float(np.hypot(*(nearest - grid_position))) * self.grid.unit
        if depth > _MAX_DEPTH_M + _MAX_RELATIVE_DEPTH * self.size:
            raise InputError(
                f"{name}: expected a point inside the boundary and outside every obstacle of map "
                f"{self._name!r}, got {coordinates}, {depth:.3g} m outside the free space"
            )
        return nearest

    def count_windings(self, grid_positions: Array) -> IntArray:
        """Compute the winding numbers of the boundaries of the c components of the free space.

        Parameters
        ----------
        grid_positions : (n, 2) array, grid steps

        Returns
        -------
        (n, c) int array
            Number of times that the boundary of each component winds around each point: 0 outside the
            component, 1 inside, and more than 1 on the boundary.
        """
        windings = np.empty((len(grid_positions), len(self.free.geoms)), dtype=np.int64)
        count_windings(self.walls, np.ascontiguousarray(grid_positions), windings)
        return windings

    def _find_nearest_free(self, grid_position: Array) -> Array:
        """Return the nearest grid point of the closed free space, accurate to a few steps."""
        line = shapely.shortest_line(self.free, shapely.Point(grid_position))
        foot = np.rint(shapely.get_coordinates(line)[0])
        # The nearest point of a slanted wall is rarely a grid point, and rounded it may be behind the wall.
        # Take the nearest of the free grid points around it.
        steps = np.arange(-_SNAP_STEPS, _SNAP_STEPS + 1.0)
        around = foot + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        free = around[(self.count_windings(around) > 0).any(axis=1)]
        if len(free) == 0:
            # The vertices of walls are grid points of the closed free space in any case.
            free = self.walls.vertices
        distance = compute_lengths(free - grid_position)
        return np.asarray(free[distance.argmin()])

    def compute_distances(self, sources: Array, targets: Array) -> Array:
        """Compute the geodesic distances between points.

        Parameters
        ----------
        sources : (n, 2) array, m
        targets : (m, 2) array, m

        Returns
        -------
        (n, m) array, m
            inf if no path leads from the source to the target.

        Raises
        ------
        InputError
            If a point is outside the free space; see `snap_to_free_space`.
        """
        starts, _ = self.snap_to_free_space(sources, "sources")
        ends, _ = self.snap_to_free_space(targets, "targets")
        return self.compute_grid_distances(starts, ends) * self.grid.unit

    def compute_grid_distances(self, sources: Array, targets: Array) -> Array:
        """Compute the geodesic distances between points of the free space in grid coordinates.

        Parameters
        ----------
        sources : (n, 2) array, grid steps
        targets : (m, 2) array, grid steps

        Returns
        -------
        (n, m) array, grid steps
        """
        # A shortest path that is not straight leads from the source to its last corner, possibly via other
        # corners, and from there straight to the target.
        index, from_sources, _ = self._compute_corner_distances(sources, must_be_straight=False)
        distances = np.empty((len(sources), len(targets)))
        for first in range(0, len(targets), _TARGETS_PER_BLOCK):
            block = slice(first, first + _TARGETS_PER_BLOCK)
            _, to_targets, _ = self._compute_corner_distances(targets[block], must_be_straight=True)
            block_distances = np.empty((len(sources), len(to_targets)))
            _combine_distances(self.walls, index, from_sources, targets[block], to_targets, block_distances)
            distances[:, block] = block_distances
        return distances

    def _compute_corner_distances(
        self, grid_positions: Array, *, must_be_straight: bool
    ) -> tuple[AngularWallIndex, Array, CornerPaths]:
        """Compute the geodesic distances from n grid points to the k corners of the walls.

        With `must_be_straight`, the distance is infinite if the straight line from a point to a corner is
        blocked. Return an angular index of the walls, with the points as its sources, the distances, (n, k)
        in grid steps, and the paths from the last point to the corners.
        """
        corner_count = len(self.corners)
        distances = np.empty((len(grid_positions), corner_count))
        paths = CornerPaths.allocate(corner_count)

        def fill_index(index: AngularWallIndex) -> AngularWallIndex | None:
            """Fill the index and write the distances; return None if the index has too little space."""
            has_space = _find_corner_distances(
                self.walls, index, self.graph, grid_positions, must_be_straight, distances, paths
            )
            return index if has_space else None

        index = self.run_with_index(
            source_count=len(grid_positions), bin_count=SOURCE_BINS, compute=fill_index
        )
        return index, distances, paths

    def find_path(self, source: Array, target: Array) -> Array:
        """Find a shortest path between two points.

        Parameters
        ----------
        source, target : (2,) array, m

        Returns
        -------
        (w, 2) array, m
            Its ends and the corners between them; of shape (0, 2) if there is no path.

        Raises
        ------
        InputError
            If a point is outside the free space.
        """
        ends, _ = self.snap_to_free_space(np.stack([source, target]), "endpoints")
        index, from_source, paths = self._compute_corner_distances(ends[:1], must_be_straight=False)
        _, to_target, _ = self._compute_corner_distances(ends[1:], must_be_straight=True)
        distance = np.empty((1, 1))
        _combine_distances(self.walls, index, from_source, ends[1:], to_target, distance)
        if np.isinf(distance[0, 0]):
            return np.empty((0, 2))
        # The lengths of the paths that bend last at each corner. If none is a shortest path, the straight
        # line is.
        lengths = from_source[0] + to_target[0]
        corner = NO_CORNER
        if lengths.min(initial=np.inf) <= distance[0, 0]:
            corner = int(lengths.argmin())
        # Follow the path backwards from its last corner.
        bends = []
        while corner != NO_CORNER:
            bends.append(corner)
            corner = int(paths.previous_corner[corner])
        bends.reverse()
        points = self.grid.to_meters(ends)
        return np.concatenate([points[:1], self.corners[bends], points[1:]])


@kernel
def _find_corner_distances(
    walls: Walls,
    index: AngularWallIndex,
    graph: CornerGraph,
    points: Array,
    must_be_straight: bool,
    distances: Array,
    paths: CornerPaths,
) -> bool:
    """Write the distances from (n, 2) points to the corners, (n, k), along shortest paths around the walls.

    A path is straight, or leads from one of the corners that the point sees along links of the corner graph.
    With `must_be_straight`, only straight paths count, and other corners are infinitely far away. `paths` is
    overwritten for each point, and finally contains the paths from the last one. Return whether the index has
    enough space.
    """
    corner_count = len(walls.corners)
    queue = CornerQueue(np.empty(corner_count + 1, np.int64), np.empty(corner_count, np.bool_))
    squared_reach = np.inf
    entry_count = 0
    for i in range(len(points)):
        entry_count = add_walls(walls, index, i, points[i, 0], points[i, 1], squared_reach, entry_count)
        if entry_count == NO_SPACE:
            return False
        visible_count = _start_straight_paths(walls, index, i, paths, queue)
        if not must_be_straight:
            relax_paths(graph, paths, queue, visible_count)
        distances[i] = paths.length
    return True


@kernel
def _start_straight_paths(
    walls: Walls, index: AngularWallIndex, source: int, paths: CornerPaths, queue: CornerQueue
) -> int:
    """Write the straight paths from a source to the corners that it sees; return their number.

    The length of the paths to all other corners is infinite. The queue of corners from which paths continue
    starts with those that the source sees.
    """
    for corner in range(len(walls.corners)):
        paths.length[corner] = np.inf
        paths.source[corner] = 0
        paths.first_corner[corner] = corner
        paths.previous_corner[corner] = NO_CORNER
        queue.is_waiting[corner] = False
    first_corner = 0
    visible_count = find_visible_corners(walls, index, source, first_corner, queue.corners)
    for k in range(visible_count):
        corner = queue.corners[k]
        dx = walls.corners[corner, 0] - index.positions[source, 0]
        dy = walls.corners[corner, 1] - index.positions[source, 1]
        paths.length[corner] = np.sqrt(dx * dx + dy * dy)
        queue.is_waiting[corner] = True
    return visible_count


@kernel
def _combine_distances(
    walls: Walls,
    index: AngularWallIndex,
    from_sources: Array,
    targets: Array,
    to_targets: Array,
    distances: Array,
) -> None:
    """Write the distances from the sources of an index to (m, 2) targets, (n, m).

    A path is either straight, or bends last at a corner. Its length is then the sum of the distance from the
    source to that corner, in `from_sources`, (n, k), and the straight distance from there to the target, in
    `to_targets`, (m, k).
    """
    corners = np.empty(to_targets.shape[1], np.int64)
    for j in range(len(targets)):
        x = targets[j, 0]
        y = targets[j, 1]
        # List the corners from which there is a straight path to the target.
        corner_count = 0
        for corner in range(len(corners)):
            if to_targets[j, corner] < np.inf:
                corners[corner_count] = corner
                corner_count += 1
        for i in range(len(from_sources)):
            min_length = np.inf
            if is_visible(walls, index, i, x, y):
                dx = x - index.positions[i, 0]
                dy = y - index.positions[i, 1]
                min_length = np.sqrt(dx * dx + dy * dy)
            for k in range(corner_count):
                corner = corners[k]
                min_length = min(min_length, from_sources[i, corner] + to_targets[j, corner])
            distances[i, j] = min_length
