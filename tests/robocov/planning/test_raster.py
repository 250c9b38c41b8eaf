"""Rasters: the cells of points, inside and outside."""

from __future__ import annotations

import numpy as np

from robocov.observation.region import Region
from robocov.planning.raster import Raster

TRIANGLE = Region(np.array([[1.0, 2.0], [4.0, 2.0], [1.0, 4.0]]))


def test_cells_contain_their_centers() -> None:
    raster = Raster(TRIANGLE, 0.1)
    rows, columns = np.indices(raster.shape)
    centers = raster.compute_centers(rows, columns)
    assert all(
        np.array_equal(*pair) for pair in zip(raster.find_cells(centers), (rows, columns), strict=True)
    )
    assert np.array_equal(raster.is_outside, ~TRIANGLE.contains(centers))


def test_points_next_to_the_raster_belong_to_the_nearest_cell() -> None:
    raster = Raster(TRIANGLE, 0.5)
    rows, columns = raster.find_cells(np.array([[-9.0, 3.1], [9.0, 99.0]]))
    assert rows.tolist() == [2, 3]
    assert columns.tolist() == [0, 5]


def test_a_region_that_ends_at_a_border_of_cells_has_no_further_row() -> None:
    assert Raster(TRIANGLE, 0.1).shape == (20, 30)
