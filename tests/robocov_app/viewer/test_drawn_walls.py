"""Walls drawn in the window: they leave no crack, and what they close is told."""

from pathlib import Path

import numpy as np
import pytest
from driven_window import opened
from sample_sessions import HALL, RAPF

from robocov.environment import CircleObstacle, Environment, WallObstacle
from robocov_app.viewer.session.map_edits import add_obstacle
from robocov_app.viewer.session.passages import describe_passage_changes
from robocov_app.viewer.tools.snapping import snap_point


def room(*walls: WallObstacle) -> Environment:
    return Environment("room", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)), walls)


def test_a_wall_drawn_nearly_from_wall_to_wall_closes_the_room_and_says_what_is_cut_off(
    tmp_path: Path,
) -> None:
    with opened(tmp_path, RAPF, environment=room(), robots=2) as driver:
        driver.key("w")
        driver.click_at((5.0, 0.02))  # cracks of two centimeters
        driver.click_at((5.0, 5.98))
        driver.key("return")
        assert len(driver.session.displayed.environment.free.geoms) == 2
        assert driver.session.displayed.environment.obstacles[-1].points == ((5.0, 0.0), (5.0, 6.0))
        assert driver.viewer.message == "wall drawn; the team is split into 2 groups"


def test_what_is_cut_off_is_where_no_robot_is_also_if_it_is_larger() -> None:
    wall = WallObstacle(((4.0, 0.0), (4.0, 6.0)), 0.1)
    before, after = room(), add_obstacle(room(), wall)
    left, right = np.array([[1.0, 1.0]]), np.array([[9.0, 1.0]])
    assert describe_passage_changes(before, after, 0.1, left) == "35.7 m² cut off"
    assert describe_passage_changes(before, after, 0.1, right) == "23.7 m² cut off"
    assert (
        describe_passage_changes(before, after, 0.1, np.vstack([left, right]))
        == "the team is split into 2 groups"
    )


def test_what_is_far_from_walls_stays_where_it_is_drawn(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, environment=room(), robots=2) as driver:
        driver.key("w")
        for point in ((5.0, 1.0), (5.0, 4.0)):
            driver.click_at(point)
        driver.key("return")
        wall = driver.session.displayed.environment.obstacles[-1]
        assert np.allclose(wall.points, ((5.0, 1.0), (5.0, 4.0)), atol=0.02)
        assert driver.viewer.message == "wall drawn"


def test_a_wall_is_drawn_by_a_drag_too_and_snaps(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, environment=room(), robots=2) as driver:
        driver.key("w")
        driver.drag_at((5.0, 0.02), (5.0, 5.98))
        (wall,) = driver.session.displayed.environment.obstacles
        assert wall.points == ((5.0, 0.0), (5.0, 6.0))
        assert driver.viewer.message.startswith("wall drawn; ")
        driver.drag_at((2.0, 3.0), (2.0, 3.01))  # a hand that shakes in a click
        assert driver.session.displayed.environment.obstacles == (wall,)
        driver.click_at((3.0, 3.0))
        driver.key("return")
        assert np.allclose(
            driver.session.displayed.environment.obstacles[1].points, ((2, 3), (3, 3)), atol=0.02
        )


def test_corners_come_before_walls() -> None:
    assert snap_point(HALL, (0.03, 0.04), 0.1) == (0.0, 0.0)
    assert snap_point(HALL, (1.3, 0.04), 0.1) == (1.3, 0.0)
    assert snap_point(HALL, (1.3, 0.2), 0.1) == (1.3, 0.2)


@pytest.mark.parametrize(("end", "words"), [
    (5.93, "a gap of 7 cm, too narrow for a robot"),
    (5.7, ""),
    (6.0, "23.7 m² cut off"),  # the floor, as the cost counts it
])  # fmt: skip
def test_a_gap_that_no_robot_passes_is_told_with_its_width(end: float, words: str) -> None:
    before, wall = room(), WallObstacle(((4.0, 0.0), (4.0, end)), 0.1)
    after = add_obstacle(before, wall)
    said = describe_passage_changes(before, after, 0.1)
    assert words in said and bool(said) == bool(words)
    # robots of 20 cm cannot pass where there are 7 cm: what is behind is cut off too
    assert ("cut off" in said) == (end > 5.9)
    pillar = CircleObstacle((8.0, 3.0), 0.5)
    assert describe_passage_changes(after, add_obstacle(after, pillar), 0.1) == "", "it was so before"
