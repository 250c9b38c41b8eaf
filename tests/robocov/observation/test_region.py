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


def test_a_region_whose_corners_all_count_as_collinear_is_rejected() -> None:
    """The sine of the change of direction at the apex is tiny as well: it is almost a half turn."""
    with pytest.raises(InputError, match=r"at least 3 corners that are not collinear, got \[\[0\.0, 0\.0\]"):
        Region(np.array([[0.0, 0.0], [1e4, 0.0], [5e3, 1e-6]]))
