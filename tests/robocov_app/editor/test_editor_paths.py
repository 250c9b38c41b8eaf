"""Moving obstacles in the editor: drawing, editing and saving their paths, and showing their motion."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_editor import EditorDriver, build_sheet, open_editor

from robocov.environment import CircleObstacle, ObstaclePath, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov.mapfile import load_map
from robocov_app.editor.canvas.overlay import draw_ghost
from robocov_app.editor.edits import paths, properties, transform
from robocov_app.editor.edits.transform import Affine
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch, dump_sketch
from robocov_app.editor.ui.typed_commands import run_typed_command
from robocov_app.look.hues import choose_robot_hues
from robocov_app.look.theme import LIGHT
from robocov_app.render.camera import Camera
from robocov_app.render.canvas import Canvas

CART = CircleObstacle((2.0, 2.0), 0.5)
ROUND = ObstaclePath(((2.0, 2.0), (8.0, 2.0), (8.0, 6.0)), 0.5)
MOVING = replace(CART, path=ROUND)
DESK = PolygonObstacle(((5.0, 7.0), (7.0, 7.0), (7.0, 8.0), (5.0, 8.0)))


def get_path(sketch: Sketch, key: int = 0) -> ObstaclePath:
    path = sketch.get_item(key).shape.path
    assert path is not None
    return path


# the model


def test_the_first_waypoint_starts_a_path_at_the_center() -> None:
    sketch = build_sheet(DESK)
    change = paths.add_waypoint(sketch, 0, (1.0, 3.00004), speed=0.3)
    assert get_path(change.sketch) == ObstaclePath(((6.0, 7.5), (1.0, 3.0)), 0.3, "back-and-forth")
    assert change.selection == Selection.of(0)
    # At time 0, the obstacle is where it was drawn.
    assert change.sketch.build_environment().at(0.0).obstacles[0].polygon.equals(DESK.polygon)
    more = paths.add_waypoint(change.sketch, 0, (1.0, 1.0)).sketch
    between = paths.add_waypoint(more, 0, (3.0, 6.0), 1).sketch
    assert get_path(between).points == ((6.0, 7.5), (3.0, 6.0), (1.0, 3.0), (1.0, 1.0))


def test_waypoints_are_moved_and_removed() -> None:
    sketch = build_sheet(MOVING)
    moved = paths.move_waypoint(sketch, 0, 1, (7.0, 3.0)).sketch
    assert get_path(moved).points[1] == (7.0, 3.0)
    fewer = paths.remove_waypoint(moved, 0, 0).sketch
    assert get_path(fewer).points == ((7.0, 3.0), (8.0, 6.0))
    assert paths.remove_waypoint(fewer, 0, 1).sketch.get_item(0).shape.path is None
    with pytest.raises(MapError, match="no longer exists"):
        paths.move_waypoint(sketch, 0, 3, (1.0, 1.0))
    with pytest.raises(MapError, match="at the same point"):
        paths.move_waypoint(fewer, 0, 0, (8.0, 6.0))
    with pytest.raises(MapError, match="too far away"):
        paths.move_waypoint(sketch, 0, 0, (float("nan"), 0.0))


def test_speed_and_repetition_are_set() -> None:
    sketch = build_sheet(MOVING, DESK, replace(CART, center=(5.0, 5.0), path=ROUND))
    both = Selection.of(0, 1, 2)
    turned = paths.toggle_repeat(sketch, both).sketch
    assert [get_path(turned, key).repeat for key in (0, 2)] == ["back-and-forth"] * 2
    assert get_path(paths.toggle_repeat(turned, both).sketch).repeat == "loop"
    paced = paths.set_speed(sketch, both, 0.25).sketch
    assert get_path(paced, 2).speed == 0.25 and paced.get_item(1).shape.path is None
    gone = paths.remove_path(sketch, both).sketch
    assert paths.list_moving_obstacles(sketch) == (0, 2) and paths.list_moving_obstacles(gone) == ()
    for act in (
        paths.toggle_repeat,
        paths.remove_path,
        lambda *two: paths.set_speed(*two, 1.0),
    ):
        with pytest.raises(MapError, match="select an obstacle that moves"):
            act(sketch, Selection.of(1))


@pytest.mark.parametrize("text", ["0", "-1", "11", "fast", "nan"])
def test_invalid_speeds_raise_a_map_error(text: str) -> None:
    with pytest.raises(MapError, match=r"expected .*m/s"):
        paths.parse_speed(text)


def test_the_nearest_waypoint_and_leg_are_found() -> None:
    assert paths.find_waypoint(ROUND, (8.1, 2.1), 0.2) == 1
    assert paths.find_waypoint(ROUND, (5.0, 2.0), 0.2) is None
    assert paths.find_leg(ROUND, (5.0, 2.1), 0.2) == 1
    # Only loops have a leg back to the first waypoint.
    assert paths.find_leg(ROUND, (5.0, 4.0), 0.2) == 3
    assert paths.find_leg(replace(ROUND, repeat="back-and-forth"), (5.0, 4.0), 0.2) is None


@pytest.mark.parametrize("points", [(), ((1.0, 1.0),), ((1.0, 1.0), (1.0, 1.0))])
def test_a_path_that_leads_nowhere_is_harmless(points, tmp_path: Path) -> None:
    broken = replace(CART, path=ObstaclePath(points, 0.0))
    assert not paths.is_moving(broken.path)
    assert paths.describe_path(broken.path) == "leads nowhere"
    paths.find_waypoint(broken.path, (0.0, 0.0), 1.0)
    assert paths.find_leg(broken.path, (9.0, 9.0), 0.1) is None
    with open_editor(tmp_path, build_sheet(broken)) as driver:
        driver.editor.select(Selection.of(0))
        driver.press_key("l")
        driver.press_key("o")
        driver.run_frames(3)
        driver.move_to((5.0, 5.0))


@pytest.mark.parametrize(
    "shape", [CART, DESK, WallObstacle(((2.0, 2.0), (3.0, 4.0)), 0.2)], ids=["circle", "polygon", "wall"]
)
def test_transforms_apply_to_paths(shape) -> None:
    sketch = build_sheet(replace(shape, path=ROUND))
    one = Selection.of(0)
    moved = transform.move(sketch, one, 1.0, -0.5).sketch
    assert get_path(moved).points == ((3.0, 1.5), (9.0, 1.5), (9.0, 5.5))
    turned = transform.rotate(sketch, one, 90.0, (2.0, 2.0)).sketch
    assert get_path(turned).points == ((2.0, 2.0), (2.0, 8.0), (-2.0, 8.0))
    stretched = Affine.scaling(2.0, 1.0, (2.0, 2.0)).transform(replace(shape, path=ROUND))
    assert stretched.path == replace(ROUND, points=((2.0, 2.0), (14.0, 2.0), (14.0, 6.0)))


def test_a_circle_that_becomes_a_polygon_keeps_its_path() -> None:
    change = properties.convert_to_polygons(build_sheet(MOVING), Selection.of(0))
    (item,) = change.sketch.obstacles
    assert isinstance(item.shape, PolygonObstacle) and item.shape.path == ROUND


def test_paths_are_saved() -> None:
    sketch = paths.add_waypoint(build_sheet(DESK), 0, (1.0, 3.0)).sketch
    again = parse_sketch(dump_sketch(sketch), "map")
    assert get_path(again) == get_path(sketch)
    assert again.build_environment().has_moving_obstacles


# the tool


@pytest.fixture
def cart_driver(tmp_path: Path) -> Iterator[EditorDriver]:
    """An editor with a cart and a desk; clicks are not snapped."""
    with open_editor(tmp_path, build_sheet(CART, DESK)) as driver:
        driver.editor.snaps = set()
        yield driver


def draw_path(driver: EditorDriver) -> None:
    """Give the cart a path of three waypoints."""
    driver.press_key("o")
    driver.click_all((2.0, 2.0), (6.0, 2.0), (6.0, 5.0))


def test_an_obstacle_is_chosen_before_its_path_is_drawn(cart_driver: EditorDriver) -> None:
    cart_driver.press_key("o")
    cart_driver.click_all((4.0, 4.0))
    assert "Click the obstacle" in cart_driver.editor.message
    # The second click is also on the cart, so it adds no waypoint.
    cart_driver.click_all((2.0, 2.0), (2.1, 2.1))
    assert cart_driver.editor.selection == Selection.of(0)
    assert paths.list_moving_obstacles(cart_driver.sketch) == ()


def test_clicks_add_waypoints_and_each_is_undone(cart_driver: EditorDriver) -> None:
    draw_path(cart_driver)
    points = get_path(cart_driver.sketch).points
    np.testing.assert_allclose(points, [[2, 2], [6, 2], [6, 5]], atol=0.03)
    cart_driver.press_key("ctrl+z")
    assert len(get_path(cart_driver.sketch).points) == 2
    cart_driver.press_key("ctrl+z")
    assert paths.list_moving_obstacles(cart_driver.sketch) == ()


def test_a_waypoint_is_inserted_dragged_and_deleted(cart_driver: EditorDriver) -> None:
    draw_path(cart_driver)
    before = get_path(cart_driver.sketch)
    # A click on a leg inserts a waypoint.
    cart_driver.click_all((4.0, 2.0))
    assert len(get_path(cart_driver.sketch).points) == 4
    np.testing.assert_allclose(get_path(cart_driver.sketch).points[1], (4.0, 2.0), atol=0.03)
    cart_driver.wait()
    cart_driver.drag_at((4.0, 2.0), (4.0, 2.5), (4.0, 3.0))
    np.testing.assert_allclose(get_path(cart_driver.sketch).points[1], (4.0, 3.0), atol=0.03)
    cart_driver.press_key("backspace")
    np.testing.assert_allclose(get_path(cart_driver.sketch).points, before.points, atol=1e-9)
    # The three edits are undone one by one.
    cart_driver.press_key("ctrl+z", times=3)
    assert get_path(cart_driver.sketch) == before


def test_speed_and_repetition_are_changed_by_keys(cart_driver: EditorDriver) -> None:
    draw_path(cart_driver)
    before = get_path(cart_driver.sketch)
    cart_driver.type("0.25")
    cart_driver.press_key("return")
    assert get_path(cart_driver.sketch).speed == 0.25
    cart_driver.press_key("shift+o")
    assert get_path(cart_driver.sketch).repeat == "loop"
    cart_driver.press_key("ctrl+z", times=2)
    assert get_path(cart_driver.sketch) == before


def test_the_tool_continues_with_another_obstacle(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(MOVING, DESK)) as driver:
        driver.press_key("o")
        driver.click_all((2.0, 2.3), (6.0, 7.3), (2.0, 7.5))
        assert paths.list_moving_obstacles(driver.sketch) == (0, 1)
        assert get_path(driver.sketch) == ROUND
        driver.press_key("return")
        assert not driver.editor.selection and driver.editor.tool.name == "path"
        driver.click_all((6.0, 7.3))
        driver.press_key("escape")
        assert (
            driver.editor.tool is driver.editor.toolbox.selector
            and driver.editor.selection == Selection.of(1)
        )
        driver.press_key("alt+o")
        assert paths.list_moving_obstacles(driver.sketch) == (0,)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_paths_are_drawn_and_obstacles_shown_in_motion(tmp_path: Path, theme: str) -> None:
    still = build_sheet(CART)
    with open_editor(tmp_path, still, theme=theme) as driver:
        driver.press_key("l")
        assert "No obstacle moves" in driver.editor.message
        driver.editor.message = ""
        driver.run_frames(2)
        before = driver.copy_frame()
        change = paths.add_waypoint(driver.sketch, 0, (8.0, 2.0))
        driver.editor.apply(replace(change, selection=Selection(), description=""))
        driver.editor.message = ""
        driver.run_frames(2)
        with_path = driver.copy_frame()
        x, y = map(round, driver.find_pixel((5.0, 2.0)))
        assert (with_path[y - 8 : y + 9, x - 30 : x + 30] != before[y - 8 : y + 9, x - 30 : x + 30]).any()
        driver.press_key("l")
        driver.editor.message = ""
        driver.run_frames(1, 4.0)
        (shift,) = [
            get_path(driver.sketch).compute_displacement(driver.editor.now - driver.editor.motion_start_s)
        ]
        assert shift[0] > 1.0
        x, y = map(round, driver.find_pixel((2.0 + float(shift[0]), 2.2)))
        assert (driver.copy_frame()[y, x] != with_path[y, x]).any()
        driver.press_key("l")
        assert driver.editor.motion_start_s is None


def test_the_map_shows_through_the_holes_of_an_obstacle_in_motion() -> None:
    hole = ((3.0, 3.0), (7.0, 3.0), (7.0, 7.0), (3.0, 7.0))
    frame = PolygonObstacle(((1.0, 1.0), (9.0, 1.0), (9.0, 9.0), (1.0, 9.0)), (hole,))
    surface = pygame.Surface((200, 200), 0, 32)
    surface.fill(LIGHT.background)
    camera = Camera.fit((0.0, 0.0, 10.0, 10.0), (0.0, 0.0, 200.0, 200.0), 0.0)
    draw_ghost(Canvas(surface, camera, LIGHT, 1.0, choose_robot_hues(1), frozenset()), frame.polygon)
    assert surface.get_at((100, 100))[:3] == LIGHT.background
    assert surface.get_at((40, 100))[:3] != LIGHT.background


def test_saved_obstacles_move_in_a_run(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    with open_editor(tmp_path, build_sheet(CART)) as driver:
        driver.editor.apply(paths.add_waypoint(driver.sketch, 0, (8.0, 2.0)))
        driver.editor.document.save(path)
    environment = load_map(path)
    assert environment.at(4.0).obstacles[0].center == pytest.approx((4.0, 2.0))


def test_commands_and_buttons_change_paths(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(MOVING)) as driver:
        driver.editor.select(Selection.of(0))
        run_typed_command(driver.editor, "speed", "0.75")
        assert get_path(driver.sketch).speed == 0.75
        driver.push_button("tab:object")
        driver.push_button("path:repeat")
        assert get_path(driver.sketch).repeat == "back-and-forth"
        driver.push_button("path:none")
        assert paths.list_moving_obstacles(driver.sketch) == ()
