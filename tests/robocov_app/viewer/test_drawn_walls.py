"""Walls drawn in the window: they leave no cracks, and the message describes what they cut off."""

from pathlib import Path

import numpy as np
import pytest
from driven_window import open_viewer
from sample_sessions import HALL, RAPF

from robocov.environment import CircleObstacle, Environment, WallObstacle
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.editing.passages import describe_passage_changes
from robocov_app.viewer.tools.snapping import MapSnapper

RADIUS = 0.1


def build_room(*walls: WallObstacle) -> Environment:
    return Environment("room", ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)), walls)


def test_a_wall_that_ends_near_walls_closes_the_room(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, environment=build_room(), robots=2) as driver:
        driver.press_key("w")
        # Without snapping there would be cracks of two centimeters.
        driver.click_at((5.0, 0.02))
        driver.click_at((5.0, 5.98))
        driver.press_key("return")
        environment = driver.session.displayed.environment
        assert len(environment.free.geoms) == 2
        assert environment.obstacles[-1].points == ((5.0, 0.0), (5.0, 6.0))
        assert driver.viewer.message == "Wall drawn; the team is split into 2 groups"


def test_a_wall_far_from_others_stays_where_it_is_drawn(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, environment=build_room(), robots=2) as driver:
        driver.press_key("w")
        for point in ((5.0, 1.0), (5.0, 4.0)):
            driver.click_at(point)
        driver.press_key("return")
        wall = driver.session.displayed.environment.obstacles[-1]
        assert np.allclose(wall.points, ((5.0, 1.0), (5.0, 4.0)), atol=0.02)
        assert driver.viewer.message == "Wall drawn"


def test_a_wall_can_be_drawn_by_dragging(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, environment=build_room(), robots=2) as driver:
        driver.press_key("w")
        driver.drag_at((5.0, 0.02), (5.0, 5.98))
        (wall,) = driver.session.displayed.environment.obstacles
        assert wall.points == ((5.0, 0.0), (5.0, 6.0))
        assert driver.viewer.message.startswith("Wall drawn; ")


def test_a_very_short_drag_counts_as_a_click(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, environment=build_room(), robots=2) as driver:
        driver.press_key("w")
        driver.drag_at((2.0, 3.0), (2.0, 3.01))
        assert driver.session.displayed.environment.obstacles == ()
        driver.click_at((3.0, 3.0))
        driver.press_key("return")
        (wall,) = driver.session.displayed.environment.obstacles
        assert np.allclose(wall.points, ((2, 3), (3, 3)), atol=0.02)


def test_corners_come_before_walls() -> None:
    snapper = MapSnapper()
    assert snapper.snap(HALL, (0.03, 0.04), 0.1) == (0.0, 0.0)
    assert snapper.snap(HALL, (1.3, 0.04), 0.1) == pytest.approx((1.3, 0.0))
    assert snapper.snap(HALL, (1.3, 0.2), 0.1) == (1.3, 0.2)
    # Another map has other walls.
    assert snapper.snap(build_room(), (9.98, 3.0), 0.1) == pytest.approx((10.0, 3.0))


def test_a_wall_in_a_doorway_is_in_line_with_the_walls_next_to_it(tmp_path: Path) -> None:
    below = WallObstacle(((5.0, 0.0), (5.0, 2.5)), 0.2)
    above = WallObstacle(((5.0, 3.5), (5.0, 6.0)), 0.2)
    with open_viewer(tmp_path, RAPF, environment=build_room(below, above), robots=2) as driver:
        driver.press_key("w")
        # Near the left corner of one wall and the right corner of the other.
        driver.drag_at((4.92, 2.48), (5.08, 3.52))
        wall = driver.session.displayed.environment.obstacles[-1]
    assert isinstance(wall, WallObstacle)
    assert np.allclose(wall.points, ((5.0, 2.5), (5.0, 3.5)))


def test_ends_of_walls_are_short_edges_that_stick_out() -> None:
    snapper = MapSnapper()
    wall = WallObstacle(((5.0, 0.0), (5.0, 2.5)), 0.2)
    block = WallObstacle(((1.0, 3.0), (3.0, 3.0)), 1.0)
    environment = build_room(wall, block)
    assert snapper.snap(environment, (4.92, 2.45), 0.2) == pytest.approx((5.0, 2.5))
    # The block is too wide to be continued by a wall, and the wall does not end at the boundary.
    assert snapper.snap(environment, (1.03, 3.45), 0.2) == pytest.approx((1.0, 3.5))
    assert snapper.snap(environment, (4.92, 0.03), 0.2) == pytest.approx((4.9, 0.0))


def test_the_area_without_robots_is_cut_off() -> None:
    before = build_room()
    after = add_obstacle(before, WallObstacle(((4.0, 0.0), (4.0, 6.0)), 0.1))
    left = np.array([[1.0, 1.0]])
    right = np.array([[9.0, 1.0]])
    both = np.vstack([left, right])
    assert describe_passage_changes(before, after, RADIUS, left) == "about 36 m² cut off"
    assert describe_passage_changes(before, after, RADIUS, right) == "about 24 m² cut off"
    assert describe_passage_changes(before, after, RADIUS, both) == "the team is split into 2 groups"


def test_a_robot_next_to_a_closed_gap_belongs_to_one_side() -> None:
    """The free positions on both sides of a short gap are less than a diameter apart."""
    before = build_room()
    after = before
    for ends in (((5.0, 0.0), (5.0, 2.905)), ((5.0, 3.095), (5.0, 6.0))):
        after = add_obstacle(after, WallObstacle(ends, 0.02))
    near_left = [(4.955, 3.0)]
    near_both = [(4.955, 3.0), (5.045, 3.0)]
    cut_off = "about 30 m² cut off; a passage of 19 cm, too narrow for a robot"
    split = "the team is split into 2 groups; a passage of 19 cm, too narrow for a robot"
    assert describe_passage_changes(before, after, RADIUS, near_left) == cut_off
    assert describe_passage_changes(before, after, RADIUS, near_both) == split


def test_a_map_without_space_for_robots_is_split_into_no_groups() -> None:
    before = build_room()
    after = add_obstacle(before, WallObstacle(((0.0, 3.0), (10.0, 3.0)), 5.7))
    assert "groups" not in describe_passage_changes(before, after, RADIUS, [(1.0, 0.1)])


@pytest.mark.parametrize(
    ("end", "description", "is_cut_off"),
    [
        (5.93, "a passage of 7 cm, too narrow for a robot", True),
        (5.7, "", False),
        (6.0, "about 24 m² cut off", True),
    ],
)
def test_a_gap_that_is_too_narrow_is_described(end: float, description: str, is_cut_off: bool) -> None:
    before = build_room()
    after = add_obstacle(before, WallObstacle(((4.0, 0.0), (4.0, end)), 0.1))
    text = describe_passage_changes(before, after, RADIUS)
    assert description in text
    assert bool(text) == bool(description)
    assert ("cut off" in text) == is_cut_off


def test_a_gap_that_existed_before_is_not_described() -> None:
    before = build_room(WallObstacle(((4.0, 0.0), (4.0, 5.93)), 0.1))
    after = add_obstacle(before, CircleObstacle((8.0, 3.0), 0.5))
    assert describe_passage_changes(before, after, RADIUS) == ""
