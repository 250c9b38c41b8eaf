"""The lattice on which distance fields are interpolated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from robocov.cost import Sites
from robocov.typing import BoolArray, FloatArray, IntArray


class _Side(NamedTuple):
    """A side of a square of the lattice.

    Attributes
    ----------
    row_step, column_step : int
        Steps from the square to its neighbor across the side.
    corners : (int, int)
        Indices of the corners at the ends of the side.
    """

    row_step: int
    column_step: int
    corners: tuple[int, int]


_SIDES = (
    _Side(1, 0, (2, 3)),
    _Side(-1, 0, (0, 1)),
    _Side(0, 1, (1, 3)),
    _Side(0, -1, (0, 2)),
)


class FieldLattice:
    """Squares between the sites of a coverage cost, which all distance fields of a map share.

    The corners of a square are the centers of four lattice cells: lower left, lower right, upper left, upper
    right. The squares of the first and last rows and columns extend beyond the lattice.

    Parameters
    ----------
    sites : Sites

    Attributes
    ----------
    spacing : float, m
        Side of a square.
    origin : (2,) array, m
        Center of the lower left cell.
    corner_sites : (s, s, 4) int array
        Site at each corner of each square. A corner in an obstacle takes the site of another corner or, if
        no corner is free, the nearest site.
    is_corner_free : (s, s, 4) bool array
        Whether a site is at each corner.
    """

    def __init__(self, sites: Sites) -> None:
        side = sites.lattice
        self.spacing = sites.spacing
        first_row, first_column = divmod(int(sites.cells[0]), side)
        self.origin = sites.points[0] - np.array([first_column, first_row]) * sites.spacing
        # The site in each lattice cell; negative for cells without one.
        site_image = sites.to_grid(np.arange(len(sites.points)))
        rows = np.clip(np.arange(-1, side + 1), 0, side - 1)
        lower = rows[:-1]
        upper = rows[1:]
        corners = [site_image[np.ix_(y, x)] for y, x in _list_pairs(lower, upper)]
        corner_sites = np.stack(corners, axis=-1)
        replacements = corner_sites.max(axis=-1)
        nearest = _find_nearest_sites(site_image)[np.ix_(upper, upper)]
        replacements = np.where(replacements < 0, nearest, replacements)
        self.is_corner_free: BoolArray = corner_sites >= 0
        self.corner_sites: IntArray = np.where(self.is_corner_free, corner_sites, replacements[..., None])

    def to_steps(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Convert coordinates, m, to lattice steps from the origin."""
        return (x - self.origin[0]) / self.spacing, (y - self.origin[1]) / self.spacing

    def find_squares(self, x: FloatArray, y: FloatArray) -> tuple[IntArray, IntArray]:
        """Find the rows and columns of squares that contain coordinates.

        Parameters
        ----------
        x : (w,) array, m
        y : (h,) array, m

        Returns
        -------
        columns : (w,) int array
        rows : (h,) int array
        """
        x_steps, y_steps = self.to_steps(x, y)
        return self._find_intervals(x_steps), self._find_intervals(y_steps)

    def _find_intervals(self, steps: FloatArray) -> IntArray:
        last = len(self.corner_sites) - 1
        return np.asarray(np.clip(np.floor(steps) + 1, 0, last).astype(np.intp))

    def collect_sites(self, is_divided: BoolArray) -> tuple[BoolArray, IntArray]:
        """Collect the sites of squares that a border between geodesic cells may cross.

        A border may also cut off a corner of a square whose own sites all have the same owner. So neighbors
        of divided squares are selected as well, if both ends of the side between the squares are free.

        Parameters
        ----------
        is_divided : (s, s) bool array
            Squares whose sites have several owners.

        Returns
        -------
        is_selected : (s, s) bool array
            Divided squares and their neighbors.
        sites : (k, 20) int array
            For each selected square its own four sites, then four for each side: those of a divided neighbor
            because of which the square was selected, otherwise its own again.
        """
        is_selected = is_divided.copy()
        site_groups = [self.corner_sites]
        n_rows, n_columns = is_divided.shape
        for side in _SIDES:
            rows = np.clip(np.arange(n_rows) + side.row_step, 0, n_rows - 1)
            columns = np.clip(np.arange(n_columns) + side.column_step, 0, n_columns - 1)
            neighbors = np.ix_(rows, columns)
            is_open = self.is_corner_free[..., side.corners].all(axis=-1)
            is_next_to_divided = ~is_divided & is_divided[neighbors] & is_open
            is_selected |= is_next_to_divided
            neighbor_sites = self.corner_sites[neighbors]
            site_groups.append(np.where(is_next_to_divided[..., None], neighbor_sites, self.corner_sites))
        return is_selected, np.concatenate(site_groups, axis=-1)[is_selected]


def _list_pairs(lower: IntArray, upper: IntArray) -> list[tuple[IntArray, IntArray]]:
    """Return rows and columns of the lattice cells at the four corners of the squares, in their order."""
    return [(lower, lower), (lower, upper), (upper, lower), (upper, upper)]


def _find_nearest_sites(site_image: IntArray) -> IntArray:
    """Return the site nearest to each cell of the lattice; `site_image` is negative in cells without one."""
    rows, columns = distance_transform_edt(site_image < 0, return_distances=False, return_indices=True)
    return np.asarray(site_image[rows, columns])
