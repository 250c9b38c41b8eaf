from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.geodesic.orientation import Grid, cross

whole = st.integers(-(2**49), 2**49)


@settings(max_examples=300, deadline=None)
@given(whole, whole, st.integers(-3, 3), st.integers(-3, 3), st.integers(1, 5), whole, whole)
def test_the_side_of_a_line_is_exact(ux, uy, near_x, near_y, multiple, wx, wy):
    pairs = [(ux // 5 * multiple + near_x, uy // 5 * multiple + near_y), (wx, wy)]
    for vx, vy in pairs:
        value = cross(*map(float, (ux, uy, vx, vy)))
        exact = ux * vy - uy * vx
        assert np.sign(value) == (exact > 0) - (exact < 0)
        assert value == pytest.approx(exact, rel=1e-12, abs=2.0**50)


def test_the_grid_keeps_dyadic_numbers():
    grid = Grid.over(np.array([-3.0, 5.0]), 10.0)
    points = np.array([[-2.875, 5.5], [7.0, 14.99]])
    assert grid.unit == 2.0**-44
    np.testing.assert_allclose(grid.metres(grid.snap(points)), points, rtol=0, atol=grid.unit)
    np.testing.assert_array_equal(grid.metres(grid.snap(points))[0], points[0])
