"""Phones that show the map of a window instead of the window."""

import time

import pygame
import pytest

from robocov_app.toolkit.window.display import open_display

pytest.importorskip("websockets")

from page_client import wait_until

WINDOW_SIZE_PX = (1280, 720)
PHONE_SIZE_PX = (390, 800)
MAP_OFFSET_PX = 1000
"""Distance of a point in the window from the same point in the map of a phone."""


class FakeWindow:
    """A window with a red map, which a green dialog can cover."""

    replacement = None
    controls = None
    status_text = ""

    def __init__(self):
        self.screen = pygame.Surface(WINDOW_SIZE_PX, 0, 32)
        self.map_pictures = self
        self.is_covered = False
        self.shade = 0

    def set_appearance(self, appearance):
        self.is_motion_reduced = appearance.is_motion_reduced

    def draw(self, size, scale, *, is_controlling):
        return fill_picture(size, (self.shade, 0, 0))

    def draw_cover(self, size, scale):
        return fill_picture(size, (0, self.shade, 0))

    def find_window_pixel(self, size, pixel):
        x, y = pixel
        return x + MAP_OFFSET_PX, y


def fill_picture(size, color):
    picture = pygame.Surface(size, 0, 32)
    picture.fill(color)
    return picture


@pytest.fixture
def window():
    return FakeWindow()


def run_window_until(display, window, condition):
    """Let the window receive input and send frames until a condition is true."""

    def is_met():
        if condition():
            return True
        display.receive(window)
        display.send(window.screen)
        return False

    wait_until(is_met)


def connect_projector_and_phone(display, window, projector, phone, **settings):
    """Report the sizes of both pages, and wait until the window draws the map for the phone."""
    projector.report_page(*WINDOW_SIZE_PX, **settings)
    phone.report_page(*PHONE_SIZE_PX, **settings)
    run_window_until(display, window, lambda: display.shared.delivery.maps.frames)


def receive_frames_until(page, condition):
    while page.image is None or not condition(page.image):
        page.receive_frame()


def has_size(picture, size):
    width, height = size
    return picture.shape == (height, width)


def change_window(display, window, shade, *, is_covered=False):
    """Change the map and the window, and send both."""
    window.shade = shade
    window.is_covered = is_covered
    window.screen.fill((1, 2, shade))
    display.send(window.screen)
    time.sleep(0.1)  # Maps are drawn at most 15 times a second.
    display.receive(window)
    display.send(window.screen)


def test_a_watching_phone_shows_the_map_even_while_a_dialog_covers_it(display, window, teacher, viewer):
    projector = teacher
    phone = viewer
    connect_projector_and_phone(display, window, projector, phone)
    receive_frames_until(phone, lambda picture: has_size(picture, PHONE_SIZE_PX))
    change_window(display, window, 7)
    receive_frames_until(phone, lambda picture: picture[0, 0] == 7 << 16)
    assert has_size(projector.receive_frame(), WINDOW_SIZE_PX)
    change_window(display, window, 9, is_covered=True)
    receive_frames_until(phone, lambda picture: picture[0, 0] == 9 << 16)
    assert has_size(phone.image, PHONE_SIZE_PX)


def test_a_controlling_phone_shows_the_dialog_alone(display, window, teacher, viewer):
    maps = display.shared.delivery.maps
    with open_display(headless=True):
        connect_projector_and_phone(display, window, teacher, viewer)
        teacher.pass_control(2)
        run_window_until(display, window, lambda: any(size.is_controlling for size in maps.frames))
        change_window(display, window, 7)
        receive_frames_until(viewer, lambda picture: picture[0, 0] == 7 << 16)
        change_window(display, window, 9, is_covered=True)
        receive_frames_until(viewer, lambda picture: picture[0, 0] == 9 << 8)
        assert has_size(viewer.image, PHONE_SIZE_PX)


def test_the_pointer_of_a_controlling_phone_is_at_the_same_point_of_the_map(display, window, teacher, viewer):
    projector = teacher
    phone = viewer
    pages = display.shared.pages
    with open_display(headless=True):
        connect_projector_and_phone(display, window, projector, phone, reduced_motion=True)
        projector.pass_control(2)
        run_window_until(
            display, window, lambda: pages.controlling is not None and pages.controlling.number == 2
        )
        pygame.event.clear()
        phone.send(kind="move", x=30.0, y=40.0)
        run_window_until(display, window, lambda: pygame.event.peek(pygame.MOUSEMOTION))
        assert pygame.event.get(pygame.MOUSEMOTION)[-1].pos == (30 + MAP_OFFSET_PX, 40)
        assert window.is_motion_reduced
