"""The window without its buttons, in the size of a phone."""

import pygame
import pytest
from driven_window import Driver, get_position

from robocov_app.toolkit.window.page_view import PageAppearance

PHONE = (400, 700)
SCALE = 1.5


def test_a_phone_gets_the_map_in_its_own_size(driver: Driver) -> None:
    picture = driver.window.map_pictures.draw(PHONE, SCALE, is_controlling=True)
    assert picture is not None
    assert picture.get_size() == PHONE
    width = driver.window.screen.get_width()
    assert picture.get_bounding_rect().width == PHONE[0]
    assert width > PHONE[0]


@pytest.mark.parametrize("notches", [0, 4])
def test_pixels_of_the_map_have_pixels_of_the_window(driver: Driver, notches: int) -> None:
    x, y = driver.find_robot_pixel(2)
    if notches:
        driver.turn_wheel(x, y, notches)
    driver.window.map_pictures.draw(PHONE, SCALE, is_controlling=True)
    picture = driver.window.map_pictures._pictures[PHONE, True]
    position = get_position(driver, 2).tolist()
    pixel = picture._canvas.to_pixel(position)
    assert 0 <= pixel[0] < PHONE[0]
    assert 0 <= pixel[1] < PHONE[1]
    assert driver.window.map_pictures.find_window_pixel(PHONE, pixel) == pytest.approx(
        driver.find_robot_pixel(2)
    )


def test_a_finger_next_to_a_robot_in_a_picture_reaches_it(driver: Driver) -> None:
    driver.window.map_pictures.draw(PHONE, SCALE, is_controlling=True)
    canvas = driver.window.map_pictures._pictures[PHONE, True]._canvas
    position = get_position(driver, 2).tolist()
    x, y = canvas.to_pixel(position)
    driver.window.run_command("tool:failure")
    driver.click(*driver.window.map_pictures.find_window_pixel(PHONE, (x - 23 * SCALE, y)))
    assert driver.viewer.message == "Robot 2 failed"
    x, y = driver.find_robot_pixel(3)
    appearance = PageAppearance(
        scale=1.0, theme="light", shows_panel=True, is_compact=False, is_motion_reduced=True
    )
    driver.window.set_appearance(appearance)
    driver.settle()
    driver.click(x - 20, y)
    assert driver.viewer.message.startswith("No robot here"), "the mouse of a large page is exact"


def test_points_that_the_window_does_not_show_stay_off_its_controls(driver: Driver) -> None:
    driver.turn_wheel(*driver.find_robot_pixel(2), 8)
    driver.window.map_pictures.draw(PHONE, SCALE, is_controlling=True)
    left, top, width, height = driver.window.layout.panes[0]
    arena = pygame.Rect(driver.window.map_pictures._pictures[PHONE, True]._canvas.layout.arena)
    for pixel in (arena.topleft, (arena.right - 1, arena.bottom - 1)):
        x, y = driver.window.map_pictures.find_window_pixel(PHONE, pixel)
        assert left <= x < left + width
        assert top <= y < top + height


def test_each_controller_of_a_comparison_has_its_place(driver: Driver) -> None:
    driver.add_pane()
    driver.run_frames(2)
    assert driver.window.map_pictures.draw(PHONE, SCALE, is_controlling=True) is not None
    boxes = driver.window.map_pictures._pictures[PHONE, True]._canvas.layout.panes
    assert len(boxes) == 2
    assert boxes[1].top >= boxes[0].top + boxes[0].height, "one above the other on an upright screen"


def test_a_lesson_is_read_and_done_in_a_picture(driver: Driver) -> None:
    driver.window.lesson.is_unattended = False
    driver.press_key("f2")
    player = driver.window.lesson.player
    assert player is not None
    pictures = driver.window.map_pictures
    for name, number in (("next", 1), ("next", 2), ("back", 1)):
        driver.settle()
        assert pictures.draw(PHONE, SCALE, is_controlling=True) is not None
        areas = pictures._pictures[PHONE, True]._lesson_areas
        box = next(area.box for area in areas if area.name == name)
        assert box.height >= 48 * pictures._pictures[PHONE, True]._canvas.layout.scale
        driver.click(*pictures.find_window_pixel(PHONE, box.center))
        assert player.number == number
    text = pygame.Rect(pictures._pictures[PHONE, True]._canvas.layout.panel)
    driver.click(*pictures.find_window_pixel(PHONE, (text.left + 3, text.top + 3)))
    assert driver.window.lesson.shown is player, "a tap on the text does not leave the lesson"


def test_the_lesson_of_a_page_that_watches_has_no_buttons(driver: Driver) -> None:
    driver.press_key("f2")
    driver.settle()
    pictures = driver.window.map_pictures
    controlling = pictures.draw(PHONE, SCALE, is_controlling=True)
    watching = pictures.draw(PHONE, SCALE, is_controlling=False)
    assert pictures._pictures[PHONE, True]._lesson_areas
    assert not pictures._pictures[PHONE, False]._lesson_areas
    assert pygame.image.tobytes(controlling, "RGB") != pygame.image.tobytes(watching, "RGB")


def test_a_finger_on_the_time_slider_of_a_picture_moves_that_of_the_window(driver: Driver) -> None:
    for _ in range(60):
        driver.session.playback.step()
    driver.settle()
    pictures = driver.window.map_pictures
    pictures.draw(PHONE, SCALE, is_controlling=True)
    chart = pictures._pictures[PHONE, True]._chart
    time = 0.5 * driver.session.timeline.end_time
    slider = pygame.Rect(chart.layout.time_slider)
    driver.click(*pictures.find_window_pixel(PHONE, (chart.to_column(time), slider.centery)))
    assert driver.session.displayed.time == pytest.approx(time, abs=0.1)


def test_a_message_is_shown_in_a_picture(driver: Driver) -> None:
    pictures = driver.window.map_pictures
    driver.viewer.clear_message()
    before = pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=True), "RGB")
    driver.viewer.show_message("robot 2 failed")
    assert pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=True), "RGB") != before


@pytest.mark.parametrize("command", ["help", "palette", "share", "layers"])
def test_a_picture_shows_the_map_while_something_covers_it_in_the_window(
    driver: Driver, command: str
) -> None:
    pictures = driver.window.map_pictures
    before = pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=True), "RGB")
    assert not driver.window.controls.is_covered
    driver.window.run_command(command)
    driver.run_frames(2)
    assert driver.window.controls.is_covered
    assert pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=True), "RGB") == before
    driver.window.run_command("cancel")
    driver.run_frames(2)


def test_the_menu_of_layers_is_used_in_a_picture(driver: Driver) -> None:
    window = driver.window
    window.run_command("layers")
    driver.run_frames(2)
    window.map_pictures.draw_cover(PHONE, SCALE)
    menu = window.layer_bar.menu_box
    row = next(box for chip, box in window.layer_bar.rows if chip.command == "layer:grid")
    factor = PHONE[0] / menu.width
    left = (row.centerx - menu.left) * factor
    target_top = round(0.1 * PHONE[1])
    pixel = (left, target_top + (row.centery - menu.top) * factor)
    x, y = window.map_pictures.find_window_pixel(PHONE, pixel)
    had_grid = "grid" in driver.viewer.view.layers
    driver.click(round(x), round(y))
    assert ("grid" in driver.viewer.view.layers) != had_grid


def test_dialogs_and_menus_are_not_wider_than_the_phone_that_controls_the_window(driver: Driver) -> None:
    window = driver.window
    appearance = PageAppearance(
        scale=1.0,
        theme="light",
        shows_panel=None,
        is_compact=False,
        is_motion_reduced=True,
        max_dialog_width=374.0,
    )
    window.set_appearance(appearance)
    window.run_command("palette")
    driver.run_frames(2)
    assert window.dialogs.box is not None
    assert window.dialogs.box.width <= 374
    window.run_command("cancel")
    window.dialogs.close()
    window.run_command("layers")
    driver.run_frames(2)
    assert window.layer_bar.menu_box.width <= 374
