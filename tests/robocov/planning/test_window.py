"""Windows of rasters around a cell."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.observation.region import Region
from robocov.planning.raster import Raster
from robocov.planning.window import Window

RASTER = Raster(Region(np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]])), 0.1)


@settings(max_examples=count_examples(30))
@given(x=st.floats(0, 6), y=st.floats(0, 4), half_width=st.floats(0.1, 9.0), max_nodes=st.integers(4, 900))
def test_a_window_contains_the_surroundings_of_its_center(
    x: float, y: float, half_width: float, max_nodes: int
) -> None:
    window = Window.build_around(RASTER, np.array([x, y]), half_width, max_nodes)
    assert window.rows * window.columns <= max_nodes
    row, column = np.indices(RASTER.shape)
    distance = np.abs(RASTER.compute_centers(row, column) - [x, y]).max(axis=-1)
    is_near = distance < half_width - 0.1
    height, width = window.shape
    assert (row[is_near] >= window.first_row).all()
    assert (row[is_near] < window.first_row + height).all()
    assert (column[is_near] >= window.first_column).all()
    assert (column[is_near] < window.first_column + width).all()


def test_cells_beyond_the_raster_are_filled() -> None:
    window = Window(first_row=36, first_column=56, rows=3, columns=3, stride=3)
    cropped = window.crop(np.zeros(RASTER.shape, dtype=bool), True)
    assert cropped.shape == (9, 9)
    assert not cropped[:4, :4].any()
    assert cropped[4:].all()
    assert cropped[:, 4:].all()
