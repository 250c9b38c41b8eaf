"""The convex region is built from any points, unless they are unusable."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.errors import InputError
from robocov.observation.region import Region


@pytest.mark.parametrize(
    "vertices",
    [
        [],
        "abc",
        None,
        [[0.0, 0.0], [1.0, 0.0], [np.inf, 1.0]],
        [[np.nan, 0.0], [1.0, 0.0], [0.0, 1.0]],
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    ],
)
def test_vertices_that_are_not_points_are_rejected(vertices: object) -> None:
    with pytest.raises(InputError, match=r"region: expected .*\[x, y\] of each vertex in meters, got"):
        Region(vertices)  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_region_without_area_is_rejected(count: int) -> None:
    line = np.arange(count)[:, None] * np.array([[1.0, 2.0]])
    with pytest.raises(InputError, match="region: expected an outer boundary with an area above 0"):
        Region(line)
