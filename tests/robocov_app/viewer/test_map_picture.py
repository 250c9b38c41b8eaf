"""The panes without controls, in the size of a phone."""

import pytest
from driven_window import Driver, get_position

PHONE = (400, 700)
SCALE = 1.5


def test_a_phone_gets_the_map_in_its_own_size(driver: Driver) -> None:
    picture = driver.window.map_pictures.draw(PHONE, SCALE)
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
    driver.window.map_pictures.draw(PHONE, SCALE)
    picture = driver.window.map_pictures._pictures[PHONE]
    position = get_position(driver, 2).tolist()
    pixel = picture._canvas.to_pixel(position)
    assert 0 <= pixel[0] < PHONE[0]
    assert 0 <= pixel[1] < PHONE[1]
    assert driver.window.map_pictures.find_window_pixel(PHONE, pixel) == pytest.approx(
        driver.find_robot_pixel(2)
    )


def test_points_that_the_window_does_not_show_stay_off_its_controls(driver: Driver) -> None:
    driver.turn_wheel(*driver.find_robot_pixel(2), 8)
    driver.window.map_pictures.draw(PHONE, SCALE)
    left, top, width, height = driver.window.layout.panes[0]
    for pixel in ((0, 0), (PHONE[0] - 1, PHONE[1] - 1)):
        x, y = driver.window.map_pictures.find_window_pixel(PHONE, pixel)
        assert left <= x < left + width
        assert top <= y < top + height


def test_each_controller_of_a_comparison_has_its_place(driver: Driver) -> None:
    driver.push_button("pane:add")
    driver.run_frames(2)
    assert driver.window.map_pictures.draw(PHONE, SCALE) is not None
    boxes = driver.window.map_pictures._pictures[PHONE]._canvas.layout.panes
    assert len(boxes) == 2
    assert boxes[1].top >= boxes[0].top + boxes[0].height, "one above the other on an upright screen"


def test_help_and_dialogs_are_shown_as_in_the_window(driver: Driver) -> None:
    driver.press_key("f1")
    assert driver.window.map_pictures.draw(PHONE, SCALE) is None
    assert driver.window.map_pictures.find_window_pixel(PHONE, (30, 40)) == (30, 40)
    driver.press_key("f1")
    assert driver.window.map_pictures.draw(PHONE, SCALE) is not None
