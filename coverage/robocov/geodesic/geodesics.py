"""Exact shortest distances and paths in the free space of a map."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
import shapely

from robocov.arrays import compute_lengths
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
from robocov.geodesic.integer_grid import Grid
from robocov.geodesic.walls import Walls, build_walls, count_windings
from robocov.typing import BoolArray, FloatArray, IntArray

_Result = TypeVar("_Result")

SOURCE_BINS = 128
"""Number of angular bins for a source."""
_CORNER_BINS = 256
"""Number of angular bins for a corner. There are more of them, because many points are tested from a
corner."""
_CORNERS_PER_BATCH = 64
"""Number of corners that are processed between two progress reports."""
_TARGETS_PER_BLOCK = 1024
"""Number of targets that are indexed at the same time, to limit memory."""
_INITIAL_ENTRIES_PER_SOURCE = {SOURCE_BINS: 256, _CORNER_BINS: 1 << 14}
"""Initial number of index entries per source, by number of bins. It is doubled whenever it is too small."""
_MAX_DEPTH_M = 2.0 * GRID_M
"""Points outside the free space by at most this distance, plus `_MAX_RELATIVE_DEPTH`, are moved inside."""
_MAX_RELATIVE_DEPTH = 1e-9
"""Addition to `_MAX_DEPTH_M` for large maps, as a fraction of the size of the map."""
_SNAP_STEPS = 2
"""Number of grid steps around the nearest point of a slanted wall in which a free grid point is searched
for."""


class CornerComputation(Protocol):
    """A function that computes rows of two tables for the corners from `first` up to `end`.

    It writes whole numbers, such as the indices of corners, to the rows of `indices`, and lengths to the same
    rows of `lengths`. The function decides on the meaning of the columns. It returns the number of rows that
    it has written, or `NO_SPACE` if these tables or the wall index are too small.
    """

    def __call__(
        self, first: int, end: int, wall_index: AngularWallIndex, indices: IntArray, lengths: FloatArray, /
    ) -> int:
        """Write rows of `indices` and `lengths`, and return their number."""


class _CornerDistances(NamedTuple):
    """The distances from n grid points to the k corners of the walls."""

    wall_index: AngularWallIndex
    """Index of the walls around the points."""
    lengths: FloatArray
    """(n, k) Distances from the points to the corners, grid steps."""
    last_paths: CornerPaths
    """The paths from the last of the points to the corners."""


class Geodesics:
    """The shortest paths in the free space of one environment.

    The distance between two points is the infimum of the lengths of the paths in the *open* free space,
    extended to its closure: no path leads through a point or along an edge where two obstacles touch. A
    shortest path is a chain of segments that bends only at corners.

    Parameters
    ----------
    environment : Environment
        The map.
    heartbeat : callable, optional
        Called regularly while the graph of the corners is computed. It may raise an exception to stop.

    Attributes
    ----------
    grid : Grid
        The grid to whose points all coordinates are rounded.
    size : float, m
        Side of the square around the region's bounding box.
    free : shapely.MultiPolygon, grid steps
        The free space, one polygon for each component.
    walls : Walls
        The boundary of the free space.
    corners : (k, 2) array, m
        All points where a shortest path can bend.
    graph : CornerGraph
        The links between the corners.

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
        corner_count = len(self.corners)
        visible_buffer = np.empty(corner_count, np.int64)  # Scratch space of `find_links`.
        pairs, lengths = self.run_for_corners(
            partial(find_links, self.walls, visible_buffer),
            index_columns=2,
            length_columns=1,
            progress=None if heartbeat is None else lambda _: heartbeat(),
        )
        return build_corner_graph(corner_count, pairs, lengths[:, 0])

    def run_for_corners(
        self,
        compute: CornerComputation,
        index_columns: int,
        length_columns: int,
        progress: Callable[[float], None] | None = None,
    ) -> tuple[IntArray, FloatArray]:
        """Compute two tables of rows for the corners, one batch of corners after another.

        Parameters
        ----------
        compute : callable
            Computes the rows for one batch of corners; see `CornerComputation`. Its wall index has space for
            one source.
        index_columns, length_columns : int
            Number of columns of `indices` and of `lengths`.
        progress : callable, optional
            Called with the completed fraction. It may raise an exception to stop.

        Returns
        -------
        indices : (r, index_columns) int array
            All rows of `indices` that `compute` has written, in the order of the batches.
        lengths : (r, length_columns) array, grid steps
            All rows of `lengths` that `compute` has written, in the order of the batches.
        """
        corner_count = len(self.corners)
        all_indices = [np.empty((0, index_columns), np.int64)]
        all_lengths = [np.empty((0, length_columns))]
        for first in range(0, corner_count, _CORNERS_PER_BATCH):
            if progress is not None:
                progress(first / corner_count)
            end = min(first + _CORNERS_PER_BATCH, corner_count)
            compute_batch = partial(compute, first, end)
            indices, lengths = self._run_for_batch(compute_batch, index_columns, length_columns)
            all_indices.append(indices)
            all_lengths.append(lengths)
        return np.concatenate(all_indices), np.concatenate(all_lengths)

    def _run_for_batch(
        self,
        compute: Callable[[AngularWallIndex, IntArray, FloatArray], int],
        index_columns: int,
        length_columns: int,
    ) -> tuple[IntArray, FloatArray]:
        """Return the rows of `indices` and `lengths` that a computation writes for one batch of corners.

        The computation returns the number of rows, or `NO_SPACE` if the tables or the wall index are too
        small. It is then repeated with more space.
        """

        def compute_rows(wall_index: AngularWallIndex) -> tuple[IntArray, FloatArray] | None:
            """Return the indices and lengths; None if there is not enough space."""
            # The tables get as many rows as the index has entries, so that all of them grow together.
            max_rows = len(wall_index.entry_walls)
            indices = np.empty((max_rows, index_columns), np.int64)
            lengths = np.empty((max_rows, length_columns))
            row_count = compute(wall_index, indices, lengths)
            if row_count == NO_SPACE:
                return None
            return indices[:row_count].copy(), lengths[:row_count].copy()

        return self.run_with_index(source_count=1, bin_count=_CORNER_BINS, compute=compute_rows)

    def run_with_index(
        self, source_count: int, bin_count: int, compute: Callable[[AngularWallIndex], _Result | None]
    ) -> _Result:
        """Run a computation with a new wall index; repeat it with a larger one until there is enough space.

        Parameters
        ----------
        source_count : int
            Number of sources of the index.
        bin_count : int
            Number of angular bins of each source: `SOURCE_BINS`, for example.
        compute : callable
            Called with the index, which is not initialized. It returns None if the index was too small.

        Returns
        -------
        object
            The result of `compute`.
        """
        while True:
            # `add_walls` needs one free entry per bin before it adds a wall. The index has two, so that
            # it is less often too small.
            max_entries = self._entries_per_source[bin_count] * source_count + 2 * bin_count
            result = compute(AngularWallIndex.allocate(source_count, bin_count, max_entries))
            if result is not None:
                return result
            self._entries_per_source[bin_count] *= 2

    def snap_to_free_space(self, points: FloatArray, name: str = "positions") -> tuple[FloatArray, BoolArray]:
        """Convert points of the free space to grid coordinates.

        Points that are only slightly outside the free space (2 µm plus 1e-9 of the map's size) are moved to
        the nearest grid point inside.

        Parameters
        ----------
        points : (n, 2) array, m
            The points.
        name : str
            Name of the points in error messages.

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
        # The winding number of a point that is not finite is 0, so it counts as outside.
        is_inside = self.count_windings(grid_positions) > 0
        for i in np.flatnonzero(~is_inside.any(axis=1)).tolist():
            grid_positions[i] = self._move_inside(points[i], f"{name}[{i}]")
            is_inside[i] = self.count_windings(grid_positions[i : i + 1])[0] > 0
        return grid_positions, is_inside

    def _move_inside(self, point: FloatArray, name: str) -> FloatArray:
        """Return the free grid point nearest to a point in meters; raise InputError if it is too far away."""
        coordinates = f"[{point[0]:.12g}, {point[1]:.12g}]"
        if not np.isfinite(point).all():
            raise InputError(f"{name}: expected finite numbers, got {coordinates}")
        if self.free.is_empty:
            raise InputError(f"{name}: map {self._name!r} has no free space")
        grid_position = self.grid.snap(point)
        nearest = self._find_nearest_free(grid_position)
        depth = float(np.hypot(*(nearest - grid_position))) * self.grid.spacing
        if depth > _MAX_DEPTH_M + _MAX_RELATIVE_DEPTH * self.size:
            raise InputError(
                f"{name}: expected a point inside the boundary and outside every obstacle of map "
                f"{self._name!r}, got {coordinates}, {depth:.3g} m outside the free space"
            )
        return nearest

    def count_windings(self, grid_positions: FloatArray) -> IntArray:
        """Compute the winding number of the boundary of each component of the free space around points.

        Parameters
        ----------
        grid_positions : (n, 2) array, grid steps
            The points.

        Returns
        -------
        (n, c) int array
            For each point and each of the c components: 0 outside the component, 1 inside, and more than 1 on
            its boundary.
        """
        windings = np.empty((len(grid_positions), len(self.free.geoms)), dtype=np.int64)
        count_windings(self.walls, np.ascontiguousarray(grid_positions), windings)
        return windings

    def _find_nearest_free(self, grid_position: FloatArray) -> FloatArray:
        """Return the nearest grid point of the closed free space, or one that is a few steps farther away."""
        line = shapely.shortest_line(self.free, shapely.Point(grid_position))
        foot = np.rint(shapely.get_coordinates(line)[0])
        # The nearest point of a slanted wall is rarely a grid point, and after rounding it may be behind the
        # wall. Take the nearest of the free grid points around it.
        steps = np.arange(-_SNAP_STEPS, _SNAP_STEPS + 1.0)
        around = foot + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        free_points = around[(self.count_windings(around) > 0).any(axis=1)]
        if len(free_points) == 0:
            # The vertices of the walls are always grid points of the closed free space.
            free_points = self.walls.vertices
        distances = compute_lengths(free_points - grid_position)
        return np.asarray(free_points[distances.argmin()])

    def compute_distances(self, sources: FloatArray, targets: FloatArray) -> FloatArray:
        """Compute the geodesic distances from each source to each target.

        Parameters
        ----------
        sources : (n, 2) array, m
        targets : (m, 2) array, m
            Points in the free space.

        Returns
        -------
        (n, m) array, m
            Lengths of the shortest paths; inf if no path leads from the source to the target.

        Raises
        ------
        InputError
            If a point is outside the free space; see `snap_to_free_space`.
        """
        starts, _ = self.snap_to_free_space(sources, "sources")
        ends, _ = self.snap_to_free_space(targets, "targets")
        return self.compute_grid_distances(starts, ends) * self.grid.spacing

    def compute_grid_distances(self, sources: FloatArray, targets: FloatArray) -> FloatArray:
        """Compute the geodesic distances from each source to each target, in grid coordinates.

        Parameters
        ----------
        sources : (n, 2) array, grid steps
        targets : (m, 2) array, grid steps
            Points in the free space, which is not checked.

        Returns
        -------
        (n, m) array, grid steps
            inf if no path leads from the source to the target.
        """
        # A shortest path that is not straight leads from the source to a last corner, possibly via other
        # corners, and from there straight to the target.
        from_sources = self._compute_corner_distances(sources, must_be_straight=False)
        distances = np.empty((len(sources), len(targets)))
        for first in range(0, len(targets), _TARGETS_PER_BLOCK):
            block = slice(first, first + _TARGETS_PER_BLOCK)
            to_targets = self._compute_corner_distances(targets[block], must_be_straight=True)
            distances[:, block] = self._combine(from_sources, targets[block], to_targets)
        return distances

    def _compute_corner_distances(
        self, grid_positions: FloatArray, *, must_be_straight: bool
    ) -> _CornerDistances:
        """Compute the geodesic distances from n grid points to the k corners of the walls.

        With `must_be_straight`, the distance is infinite unless a straight path leads from the point to the
        corner.
        """
        corner_count = len(self.corners)
        lengths = np.empty((len(grid_positions), corner_count))
        paths = CornerPaths.allocate(corner_count)

        def fill_index(index: AngularWallIndex) -> AngularWallIndex | None:
            """Fill the index, `lengths` and `paths`; return None if the index has too little space."""
            has_space = _find_corner_distances(
                self.walls, index, self.graph, grid_positions, must_be_straight, lengths, paths
            )
            return index if has_space else None

        index = self.run_with_index(
            source_count=len(grid_positions), bin_count=SOURCE_BINS, compute=fill_index
        )
        return _CornerDistances(wall_index=index, lengths=lengths, last_paths=paths)

    def _combine(
        self, from_sources: _CornerDistances, targets: FloatArray, to_targets: _CornerDistances
    ) -> FloatArray:
        """Return the distances from the n sources to (m, 2) targets, (n, m), all in grid steps.

        The distances in `to_targets` are those of straight paths.
        """
        distances = np.empty((len(from_sources.lengths), len(targets)))
        _combine_distances(
            self.walls, from_sources.wall_index, from_sources.lengths, targets, to_targets.lengths, distances
        )
        return distances

    def find_path(self, source: FloatArray, target: FloatArray) -> FloatArray:
        """Find a shortest path between two points.

        Parameters
        ----------
        source, target : (2,) array, m
            The ends of the path, in the free space.

        Returns
        -------
        (w, 2) array, m
            The source, the corners at which the path bends, and the target; of shape (0, 2) if there is no
            path. A corner that a straight path touches may be among them, even if it is an end of the path.

        Raises
        ------
        InputError
            If a point is outside the free space.
        """
        ends, _ = self.snap_to_free_space(np.stack([source, target]), "endpoints")
        from_source = self._compute_corner_distances(ends[:1], must_be_straight=False)
        to_target = self._compute_corner_distances(ends[1:], must_be_straight=True)
        distance = float(self._combine(from_source, ends[1:], to_target)[0, 0])
        if np.isinf(distance):
            return np.empty((0, 2))
        # The length of the shortest path that bends last at each corner. If none of them is as short as the
        # distance, the shortest path is straight.
        lengths = from_source.lengths[0] + to_target.lengths[0]
        corner = NO_CORNER
        if lengths.min(initial=np.inf) <= distance:
            corner = int(lengths.argmin())
        # Follow the path backward from its last corner.
        path_corners = []
        while corner != NO_CORNER:
            path_corners.append(corner)
            corner = int(from_source.last_paths.previous_corners[corner])
        path_corners.reverse()
        end_points = self.grid.to_meters(ends)
        return np.concatenate([end_points[:1], self.corners[path_corners], end_points[1:]])


@kernel
def _find_corner_distances(
    walls: Walls,
    index: AngularWallIndex,
    graph: CornerGraph,
    points: FloatArray,
    must_be_straight: bool,
    distances: FloatArray,
    paths: CornerPaths,
) -> bool:
    """Write the distances from (n, 2) points to the corners, (n, k), along shortest paths around the walls.

    A path is straight, or leads to one of the corners that the point sees, and on along links of the corner
    graph. With `must_be_straight`, only straight paths count, and the distance to all other corners is
    infinite. `paths` is overwritten for each point, and finally contains the paths from the last one. Return
    whether the index has enough space.
    """
    corner_count = len(walls.corners)
    # Kernels cannot call class methods, such as `CornerQueue.allocate`.
    queue = CornerQueue(np.empty(corner_count + 1, np.int64), np.empty(corner_count, np.bool_))
    squared_range = np.inf
    entry_count = 0
    for i in range(len(points)):
        entry_count = add_walls(walls, index, i, points[i, 0], points[i, 1], squared_range, entry_count)
        if entry_count == NO_SPACE:
            return False
        visible_count = _start_straight_paths(walls, index, i, paths, queue)
        if not must_be_straight:
            relax_paths(graph, paths, queue, visible_count)
        distances[i] = paths.lengths
    return True


@kernel
def _start_straight_paths(
    walls: Walls, index: AngularWallIndex, source: int, paths: CornerPaths, queue: CornerQueue
) -> int:
    """Write the straight paths from a source to the corners that it sees; return the number of these corners.

    The length of the paths to all other corners is infinite. The visible corners are the first in the queue
    of corners from which other paths may be shortened.
    """
    for corner in range(len(walls.corners)):
        paths.lengths[corner] = np.inf
        paths.sources[corner] = 0
        paths.first_corners[corner] = corner
        paths.previous_corners[corner] = NO_CORNER
        queue.is_waiting[corner] = False
    first_corner = 0
    visible_count = find_visible_corners(walls, index, source, first_corner, queue.corners)
    for k in range(visible_count):
        corner = queue.corners[k]
        dx = walls.corners[corner, 0] - index.positions[source, 0]
        dy = walls.corners[corner, 1] - index.positions[source, 1]
        paths.lengths[corner] = np.sqrt(dx * dx + dy * dy)
        queue.is_waiting[corner] = True
    return visible_count


@kernel
def _combine_distances(
    walls: Walls,
    index: AngularWallIndex,
    from_sources: FloatArray,
    targets: FloatArray,
    to_targets: FloatArray,
    distances: FloatArray,
) -> None:
    """Write the distances from the sources of an index to (m, 2) targets, (n, m).

    A path is either straight, or bends last at some corner. In the second case, its length is the distance
    from the source to that corner, in `from_sources`, (n, k), plus the straight distance from the corner to
    the target, in `to_targets`, (m, k).
    """
    last_corners = np.empty(to_targets.shape[1], np.int64)
    for j in range(len(targets)):
        x = targets[j, 0]
        y = targets[j, 1]
        # List the corners from which there is a straight path to the target.
        last_corner_count = 0
        for corner in range(len(last_corners)):
            if to_targets[j, corner] < np.inf:
                last_corners[last_corner_count] = corner
                last_corner_count += 1
        for i in range(len(from_sources)):
            min_length = np.inf
            if is_visible(walls, index, i, x, y):
                dx = x - index.positions[i, 0]
                dy = y - index.positions[i, 1]
                min_length = np.sqrt(dx * dx + dy * dy)
            for k in range(last_corner_count):
                corner = last_corners[k]
                min_length = min(min_length, from_sources[i, corner] + to_targets[j, corner])
            distances[i, j] = min_length
