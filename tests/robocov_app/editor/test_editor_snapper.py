"""Snap targets: computed immediately for small maps, and in the background for large ones."""

import time

from driven_editor import build_sheet

from robocov.environment import PolygonObstacle
from robocov_app.editor.tools.snap_targets import MANY_VERTICES, Snapper, count_vertices

SMALL = build_sheet(PolygonObstacle(((1, 1), (2, 1), (2, 2))))
LARGE = build_sheet(
    PolygonObstacle(tuple((5 + k * 1e-3, 5 + (k % 2) * 0.1) for k in range(MANY_VERTICES + 1)))
)


def test_targets_of_small_maps_are_available_at_once_and_cached() -> None:
    snapper = Snapper()
    first = snapper.find_targets(SMALL)
    assert first is not None and snapper.find_targets(SMALL) is first
    assert snapper.find_targets(SMALL, (0,)) is not first
    snapper.close()


def test_targets_of_large_maps_are_computed_in_the_background() -> None:
    assert count_vertices(LARGE) > MANY_VERTICES
    snapper = Snapper()
    first = snapper.find_targets(LARGE)
    began = time.monotonic()
    while first is None:
        assert time.monotonic() - began < 60
        time.sleep(0.01)
        first = snapper.find_targets(LARGE)
    snapper.close()
    patient = Snapper()
    patient.waits_for_targets = True
    assert patient.find_targets(LARGE) is not None
