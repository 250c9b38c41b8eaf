"""Neighboring cells have different hues at every frame of a replay, in teams of any size."""

import numpy as np
import pytest
from moving_teams import build_moving_record, list_hues

from robocov.voronoi import partition
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.look.hues import MAX_OWN_HUES, N_SHARED_HUES
from robocov_app.report.embedded_hues import embed_hues
from robocov_app.report.embedding import MAX_RATE_HZ, ReplayRun, embed_run

RAPF = choose_controller_styles(["rapf"])["rapf"]


def embed(robots: int, **settings) -> tuple:
    """Return a record and its data in a page."""
    record = build_moving_record(robots, **settings)
    return record, embed_run(ReplayRun(record, None, "a run"), 0, RAPF, MAX_RATE_HZ, include_goals=False)


@pytest.mark.parametrize("robots", [12, 20, 30])
def test_neighbors_never_share_a_hue(robots) -> None:
    record, data = embed(robots)
    assert data["count"] > 20
    hues = list_hues(data["hues"], range(data["count"]))
    for frame, hue in enumerate(np.array(hues)):
        assert hue.min() >= 0
        assert hue.max() < N_SHARED_HUES
        time = min(frame * data["step"], data["end"])
        for later in (time, min(time + 0.5 * data["step"], data["end"])):
            positions = np.array(
                [
                    [np.interp(later, record.time, record.positions[:, robot, axis]) for axis in (0, 1)]
                    for robot in range(robots)
                ]
            )
            first, second = partition(positions, record.environment.region).adjacency.T
            shared = hue[first] == hue[second]
            # Between two frames, one pair may become neighbors for less than a step.
            assert not shared.any() or (later > time and shared.sum() <= 1)


def test_hues_rarely_change() -> None:
    _, data = embed(30)
    assert len(data["hues"]["changes"]) < 0.1 * 30 * data["count"]


def test_small_teams_have_a_hue_for_each_robot() -> None:
    _, data = embed(MAX_OWN_HUES)
    assert data["hues"] == {"first": list(range(MAX_OWN_HUES)), "changes": []}


def test_failed_robots_have_no_cell() -> None:
    record = build_moving_record(12)
    positions = record.positions[::5].copy()
    is_working = np.ones(positions.shape[:2], dtype=bool)
    is_working[:, 3] = False
    positions[:, 3] = np.nan
    hues = list_hues(embed_hues(record, positions, is_working), range(len(positions)))
    robots = np.flatnonzero(is_working[0])
    for hue, row in zip(np.array(hues), positions[:, robots], strict=True):
        first, second = robots[partition(row, record.environment.region).adjacency.T]
        assert (hue[first] != hue[second]).all()
