"""Distances to the nearest robot at every pixel of a picture, and the borders of geodesic cells.

The coverage cost provides the exact distance of each site of a lattice, and the last corner at which the path
to it bends. The shortest path to a pixel in a square between four sites nearly always comes from the last
corner, or directly from the robot, of one of these sites. Each such path is a candidate: its length up to the
last corner plus the straight line from there to the pixel. The shortest candidate gives the distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.cost import CoverageCost, CoverageResult, TimeVaryingCost
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.render.distance_map.site_lattice import FieldLattice

_MIN_DISTANCE_GROWTH = 0.05
"""Minimum growth of the difference of two distances per meter, so that the division below stays finite.

For small angles it is the angle between the directions of the paths, rad.
"""
_BLOCK_PX = 4
"""Side of the blocks of pixels that are evaluated at their middle first."""
_NEAR_BLOCK_SIDES = 1.5
"""Distance from a border, in block sides, within which pixels are evaluated: about a diagonal.

Half of it reaches the corners of a block; the rest allows for curved borders.
"""
_MAX_CANDIDATES = 5
"""Maximum number of paths that are compared at a point."""
_TOLERANCE_STEPS = 1e-9
_MIN_LENGTH_M = 1e-12


@dataclass(frozen=True, eq=False)
class BorderPixels:
    """Pixels near the border between the geodesic cells of two robots.

    Attributes
    ----------
    rows, columns : (k,) int array
    owners : (k,) int array
        The nearest robot.
    distances : (k,) array, m
        Distance to the border; inf if there is none.
    """

    rows: IntArray
    columns: IntArray
    owners: IntArray
    distances: FloatArray

    def select_within(self, max_distance: float) -> BorderPixels:
        """Return the pixels within a distance of the border, m."""
        indices = (self.distances <= max_distance).nonzero()[0]
        return BorderPixels(
            rows=self.rows[indices],
            columns=self.columns[indices],
            owners=self.owners[indices],
            distances=self.distances[indices],
        )


class _Candidates(NamedTuple):
    """Sites whose paths may lead to the points of some squares.

    Attributes
    ----------
    indices : (s, s) int array
        Row of each square in `sites` and `is_free`; -1 for squares without candidates.
    sites : (k, r) int array
        The candidates of each such square.
    is_free : (k, 4, r) bool array
        Whether the straight line from the last bend of each candidate to each corner of the square is free.
        Through a wall, the candidate would be shorter than the exact distance of the corner.
    """

    indices: IntArray
    sites: IntArray
    is_free: BoolArray


class DistanceField:
    """The distance to the nearest robot, and the row of this robot, for one set of positions.

    Parameters
    ----------
    lattice : FieldLattice
        Built from the sites of the same coverage cost as the result.
    result : CoverageResult

    Attributes
    ----------
    lattice : FieldLattice
    result : CoverageResult
    """

    def __init__(self, lattice: FieldLattice, result: CoverageResult) -> None:
        self.lattice = lattice
        self.result = result
        owners = result.owners
        last_corners = result.last_corners
        # The last bend of the path to each site, or the position of its robot.
        bends = result.positions[owners]
        is_bent = last_corners >= 0
        bends[is_bent] = result.corners[last_corners[is_bent]]
        # The length of the path up to the last bend: 0 for straight paths.
        lengths = np.maximum(result.distances - np.hypot(*(result.points - bends).T), 0.0)
        lengths[~is_bent & (owners >= 0)] = 0.0
        self._bend_x, self._bend_y = np.ascontiguousarray(bends.T)
        self._lengths_to_bend = lengths
        self._owners = owners
        # Sites whose paths come from the same corner (0 and above) or straight from the same robot (-2 and
        # below; -1 without a robot) give the same distances.
        sources = np.where(last_corners >= 0, last_corners, -2 - owners)
        corner_sites = lattice.corner_sites
        is_mixed = _find_rows_with_differences(sources[corner_sites])
        self._distance_candidates = self._build_candidates(is_mixed, corner_sites[is_mixed])
        is_divided = _find_rows_with_differences(owners[corner_sites])
        is_selected, sites = lattice.collect_sites(is_divided)
        self._border_candidates = self._build_candidates(
            is_selected, _select_different(sites, sources[sites])
        )

    def _build_candidates(self, is_selected: BoolArray, sites: IntArray) -> _Candidates:
        """Build the candidates of the selected squares of the lattice.

        Parameters
        ----------
        is_selected : (s, s) bool array
        sites : (k, r) int array
            Candidates of each selected square, row by row.
        """
        indices = np.full(is_selected.shape, -1, dtype=np.intp)
        indices[is_selected] = np.arange(len(sites))
        corner_sites = self.lattice.corner_sites[is_selected]
        corners = self.result.points[corner_sites]
        lengths = self._compute_distances(sites[:, None], corners[..., 0, None], corners[..., 1, None])
        tolerance = _TOLERANCE_STEPS * self.lattice.spacing
        is_free = lengths >= self.result.distances[corner_sites][..., None] - tolerance
        return _Candidates(indices, sites, is_free)

    def _compute_distances(self, sites: IntArray, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the lengths of the paths to sites, m, if each led from its last bend to (x, y) instead."""
        dx = x - self._bend_x[sites]
        dy = y - self._bend_y[sites]
        return np.asarray(np.sqrt(dx * dx + dy * dy) + self._lengths_to_bend[sites])

    def _compare_candidates(
        self, candidates: _Candidates, indices: IntArray, x: FloatArray, y: FloatArray
    ) -> FloatArray:
        """Return the distance of each point along each candidate of its square.

        Parameters
        ----------
        candidates : _Candidates
        indices : (k,) int array
            Row of the square of each point in `candidates.sites`.
        x, y : (k,) array, m

        Returns
        -------
        (k, r) array, m
            inf for candidates that a wall separates from the corner nearest to the point.
        """
        distances = self._compute_distances(candidates.sites[indices], x[:, None], y[:, None])
        x_steps, y_steps = self.lattice.to_steps(x, y)
        # Corners 0 to 3: lower left, lower right, upper left, upper right.
        nearest_corners = 2 * _get_half_index(y_steps) + _get_half_index(x_steps)
        return np.where(candidates.is_free[indices, nearest_corners], distances, np.inf)

    @property
    def max_distance(self) -> float:
        """The largest distance among the sites that a robot can reach, m; nan if there is no such site."""
        reached = self.result.distances[self._owners >= 0]
        if not len(reached):
            return float("nan")
        return float(reached.max())

    def compute_distances(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Compute the distance to the nearest robot for a grid of points.

        Parameters
        ----------
        x : (w,) array, m
        y : (h,) array, m

        Returns
        -------
        (h, w) array, m
            inf if no robot can reach the point.
        """
        columns, rows = self.lattice.find_squares(x, y)
        # Most squares have a single candidate, which is that of their first corner.
        sites = self.lattice.corner_sites[..., 0][rows[:, None], columns]
        distances = self._compute_distances(sites, np.broadcast_to(x, sites.shape), y[:, None])
        indices = self._distance_candidates.indices[rows[:, None], columns]
        point_rows, point_columns = (indices >= 0).nonzero()
        choices = self._compare_candidates(
            self._distance_candidates,
            indices[point_rows, point_columns],
            x[point_columns],
            y[point_rows],
        )
        distances[point_rows, point_columns] = choices.min(axis=1)
        return distances

    def compute_cells(
        self, x: FloatArray, y: FloatArray, max_distance: float
    ) -> tuple[IntArray, BorderPixels]:
        """Compute the nearest robot for a grid of points, and the points near a border between robots.

        Parameters
        ----------
        x : (w,) array, m
            Equally spaced.
        y : (h,) array, m
            Equally spaced.
        max_distance : float, m
            Maximum distance of the returned pixels from a border.

        Returns
        -------
        owners : (h, w) int array
            The nearest robot; -1 if no robot can reach the point.
        borders : BorderPixels
        """
        columns, rows = self.lattice.find_squares(x, y)
        square_owners = self._owners[self.lattice.corner_sites[..., 0]]
        owners = square_owners.take(rows, axis=0).take(columns, axis=1)
        coarse, fine = self._evaluate_borders(x, y, max_distance)
        for pixels in (coarse, fine):
            owners[pixels.rows, pixels.columns] = pixels.owners
        return owners, fine.select_within(max_distance)

    def compute_borders(self, x: FloatArray, y: FloatArray, max_distance: float) -> BorderPixels:
        """Compute only the pixels near borders of geodesic cells; see `compute_cells` for the parameters."""
        _, fine = self._evaluate_borders(x, y, max_distance)
        return fine.select_within(max_distance)

    def _evaluate_borders(
        self, x: FloatArray, y: FloatArray, max_distance: float
    ) -> tuple[BorderPixels, BorderPixels]:
        """Find owners and border distances: once per block of pixels, then per pixel near borders.

        Returns
        -------
        coarse : BorderPixels
            Pixels of the blocks whose middle is in a square with candidates, each with the values at that
            middle.
        fine : BorderPixels
            Pixels that may be within the maximum distance, m, of a border, with their own values.
        """
        block_rows, block_columns = self._find_blocks(x, y)
        middle_x = compute_block_middles(x, _BLOCK_PX)
        middle_y = compute_block_middles(y, _BLOCK_PX)
        columns, rows = self.lattice.find_squares(middle_x, middle_y)
        has_candidates = self._border_candidates.indices[rows[block_rows], columns[block_columns]] >= 0
        blocks = self._evaluate_points(
            block_rows[has_candidates], block_columns[has_candidates], middle_x, middle_y
        )
        pixel_spacing = abs(x[1] - x[0]) if len(x) > 1 else self.lattice.spacing
        is_near = blocks.distances <= max_distance + _NEAR_BLOCK_SIDES * _BLOCK_PX * pixel_spacing
        fine_block_rows = np.append(blocks.rows[is_near], block_rows[~has_candidates])
        fine_block_columns = np.append(blocks.columns[is_near], block_columns[~has_candidates])
        fine_rows, fine_columns, _ = _list_block_pixels(fine_block_rows, fine_block_columns, len(y), len(x))
        fine = self._evaluate_points(fine_rows, fine_columns, x, y)
        return _spread_over_pixels(blocks, len(y), len(x)), fine

    def _find_blocks(self, x: FloatArray, y: FloatArray) -> tuple[IntArray, IntArray]:
        """Return rows and columns of the blocks of pixels with a corner in a square that has candidates."""
        columns, rows = self.lattice.find_squares(x, y)
        has_candidates = self._border_candidates.indices >= 0
        has_corner = [
            has_candidates[np.ix_(block_rows, block_columns)]
            for block_rows in _get_block_ends(rows)
            for block_columns in _get_block_ends(columns)
        ]
        block_rows, block_columns = np.logical_or.reduce(has_corner).nonzero()
        return block_rows, block_columns

    def _evaluate_points(
        self, rows: IntArray, columns: IntArray, x: FloatArray, y: FloatArray
    ) -> BorderPixels:
        """Return the nearest robot of points, and their distance to the border with the second nearest.

        Parameters
        ----------
        rows, columns : (k,) int array
            Rows and columns of points of the grid `x`, `y` (pixels or middles of blocks). Points in squares
            without candidates are left out.
        x : (w,) array, m
        y : (h,) array, m

        Returns
        -------
        BorderPixels
        """
        square_columns, square_rows = self.lattice.find_squares(x, y)
        indices = self._border_candidates.indices[square_rows[rows], square_columns[columns]]
        has_candidates = (indices >= 0).nonzero()[0]
        rows = rows[has_candidates]
        columns = columns[has_candidates]
        owners, distances = self._compare_owners(indices[has_candidates], x[columns], y[rows])
        return BorderPixels(rows, columns, owners, distances)

    def _compare_owners(
        self, indices: IntArray, pixel_x: FloatArray, pixel_y: FloatArray
    ) -> tuple[IntArray, FloatArray]:
        """Return the nearest robot of pixels, and the distance to the border with the second nearest.

        Parameters
        ----------
        indices : (k,) int array
            Row of the candidates of each pixel's square.
        pixel_x, pixel_y : (k,) array, m

        Returns
        -------
        owners : (k,) int array
        border_distances : (k,) array, m
            inf if there is no border.
        """
        sites = self._border_candidates.sites[indices]
        distances = self._compare_candidates(self._border_candidates, indices, pixel_x, pixel_y)
        owners = self._owners[sites]
        pixel_indices = np.arange(len(sites))
        nearest_candidates = distances.argmin(axis=1)
        nearest_owners = owners[pixel_indices, nearest_candidates]
        other_distances = np.where(owners == nearest_owners[:, None], np.inf, distances)
        second_candidates = other_distances.argmin(axis=1)
        nearest_sites = sites[pixel_indices, nearest_candidates]
        second_sites = sites[pixel_indices, second_candidates]
        nearest_dx, nearest_dy = self._compute_directions(nearest_sites, pixel_x, pixel_y)
        second_dx, second_dy = self._compute_directions(second_sites, pixel_x, pixel_y)
        # Away from the border, the difference of the two distances grows by this much per meter.
        growth = np.maximum(np.hypot(nearest_dx - second_dx, nearest_dy - second_dy), _MIN_DISTANCE_GROWTH)
        # inf - inf is nan: without a second robot, or without any, there is no border.
        with np.errstate(invalid="ignore"):
            differences = (
                other_distances[pixel_indices, second_candidates]
                - distances[pixel_indices, nearest_candidates]
            )
            border_distances = differences / growth
        return nearest_owners, np.nan_to_num(border_distances, nan=np.inf, posinf=np.inf)

    def _compute_directions(
        self, sites: IntArray, x: FloatArray, y: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return dx and dy of the unit vectors from the last bends of the paths of sites to points."""
        dx = x - self._bend_x[sites]
        dy = y - self._bend_y[sites]
        lengths = np.maximum(np.hypot(dx, dy), _MIN_LENGTH_M)
        return dx / lengths, dy / lengths


class DistanceFields:
    """Computes the distance fields of a map for any positions and times.

    Parameters
    ----------
    cost : CoverageCost
    limit : float, m
        End of the color scale of the distances.

    Attributes
    ----------
    limit : float, m
    """

    def __init__(self, cost: CoverageCost, limit: float) -> None:
        self.limit = limit
        self._time_varying_cost = TimeVaryingCost(cost)
        self._lattice_cost = cost
        self._lattice = FieldLattice(cost.sites)

    def compute_at(self, positions: FloatArray, time: float = 0.0) -> DistanceField | None:
        """Compute the distance field of robots at given positions.

        Parameters
        ----------
        positions : (n, 2) array, m
            Robots below moving obstacles are left out.
        time : float, s

        Returns
        -------
        DistanceField or None
            None if all robots are below moving obstacles.

        Raises
        ------
        InputError
            If a robot is in an obstacle at rest, or outside the map.
        """
        result = self._time_varying_cost.evaluate_all_robots(time, positions)
        if result is None:
            return None
        cost = self._time_varying_cost.get_cost(time)
        if cost is not self._lattice_cost:
            self._lattice_cost = cost
            self._lattice = FieldLattice(cost.sites)
        return DistanceField(self._lattice, result)


def compute_block_middles(coordinates: FloatArray, size: int) -> FloatArray:
    """Return the middles of blocks of adjacent pixels along an axis.

    Parameters
    ----------
    coordinates : (n,) array
        Middles of the pixels, equally spaced.
    size : int
        Number of pixels of a block. The last block may reach beyond the last pixel.

    Returns
    -------
    (ceil(n / size),) array
    """
    step = coordinates[1] - coordinates[0] if len(coordinates) > 1 else 0.0
    return np.asarray(coordinates[::size] + 0.5 * (size - 1) * step)


def _find_rows_with_differences(values: IntArray) -> BoolArray:
    """Return a mask of the rows of an array, (..., k), that contain different values."""
    return np.asarray((values[..., 1:] != values[..., :1]).any(axis=-1))


def _get_half_index(steps: FloatArray) -> IntArray:
    """Return 1 for coordinates, in lattice steps, in the upper half of a square, and 0 in its lower half."""
    return (np.floor(steps - 0.5) - np.floor(steps)).astype(np.intp) + 1


def _get_block_ends(values: IntArray) -> tuple[IntArray, IntArray]:
    """Return the values of the first and of the last pixel of each block along an axis."""
    first = np.arange(0, len(values), _BLOCK_PX)
    last = np.minimum(first + _BLOCK_PX - 1, len(values) - 1)
    return values[first], values[last]


def _list_block_pixels(
    block_rows: IntArray, block_columns: IntArray, height: int, width: int
) -> tuple[IntArray, IntArray, IntArray]:
    """List the pixels of blocks that are inside a picture.

    Returns
    -------
    rows, columns : (m,) int array
    block_indices : (m,) int array
        Index of the block of each pixel.
    """
    inner_rows, inner_columns = np.divmod(np.arange(_BLOCK_PX**2), _BLOCK_PX)
    rows = (block_rows[:, None] * _BLOCK_PX + inner_rows).ravel()
    columns = (block_columns[:, None] * _BLOCK_PX + inner_columns).ravel()
    inside = ((rows < height) & (columns < width)).nonzero()[0]
    return rows[inside], columns[inside], inside // _BLOCK_PX**2


def _spread_over_pixels(blocks: BorderPixels, height: int, width: int) -> BorderPixels:
    """Return the pixels of blocks that are inside a picture, with the values of their block."""
    rows, columns, block_indices = _list_block_pixels(blocks.rows, blocks.columns, height, width)
    return BorderPixels(rows, columns, blocks.owners[block_indices], blocks.distances[block_indices])


def _select_different(sites: IntArray, sources: IntArray) -> IntArray:
    """Return, for each row, up to `_MAX_CANDIDATES` sites with distinct sources.

    Parameters
    ----------
    sites, sources : (k, m) int array
        Sites of each square, and the last bend or robot that each of them is reached from.

    Returns
    -------
    (k, r) int array
        Rows with fewer different sources are filled with their first site.
    """
    is_new = np.ones(sites.shape, dtype=bool)
    for column in range(1, sites.shape[1]):
        is_new[:, column] = (sources[:, column, None] != sources[:, :column]).all(axis=1)
    # A stable sort moves the sites with new sources to the front of each row.
    order = np.argsort(~is_new, axis=1, kind="stable")[:, :_MAX_CANDIDATES]
    chosen = np.take_along_axis(sites, order, axis=1)
    return np.where(np.take_along_axis(is_new, order, axis=1), chosen, sites[:, :1])
