"""Frames of a served window: their encoding, and which of them a page gets."""

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("websockets")

from page_client import connect_page, decode_frame

from robocov_app.web.frames import HEADER, BaseFrames, Frame, encode_frame

SIDES_PX = st.integers(1, 6)


def read_pixels(surface):
    return Frame.from_surface(surface, 0).pixels


@given(st.lists(st.tuples(SIDES_PX, SIDES_PX, st.integers(0, 2**32)), min_size=1, max_size=6))
def test_decoded_frames_equal_the_encoded_pictures(sizes_and_seeds):
    previous_frame = None
    picture = None
    for number, (width, height, seed) in enumerate(sizes_and_seeds):
        levels = np.random.default_rng(seed).integers(0, 3, (height, width))
        frame = Frame(number, levels.astype(np.uint32) * 0x10FF)
        picture = decode_frame(encode_frame(frame, previous_frame), picture)
        assert np.array_equal(picture, frame.pixels)
        previous_frame = frame


def test_the_frame_of_an_unchanged_picture_is_empty():
    frame = Frame(1, np.ones((4, 5), np.uint32))
    _, width, height, *box, starts_from_black = HEADER.unpack_from(encode_frame(frame, frame))
    assert (width, height) == (5, 4)
    assert box == [0, 0, 0, 0]
    assert not starts_from_black


def test_base_frames_stay_within_their_memory_limit():
    bases = BaseFrames(max_bytes=3 * 400)
    for number in range(1, 9):
        bases.add(Frame(number, np.zeros((10, 10), np.uint32)))
    assert bases.n_bytes <= 1200
    assert [number for number in (5, 6, 7, 8) if bases.get(number) is not None] == [6, 7, 8]
    bases.keep_only({7})
    assert len(bases) == 1


def test_a_page_gets_the_last_picture_and_no_picture_twice(display, teacher):
    surface = pygame.Surface((200, 200), 0, 32)
    for shade in range(0, 250, 5):
        surface.fill((shade, shade, 255), (shade // 2, 10, 40, 40))
        display.send(surface)
    display.send(surface)  # unchanged
    n_frames = 0
    while teacher.image is None or not np.array_equal(teacher.image, read_pixels(surface)):
        teacher.receive_frame()
        n_frames += 1
    assert n_frames <= 50
    with pytest.raises(TimeoutError):
        teacher.socket.recv(0.1)


def test_a_page_whose_base_frame_was_dropped_gets_a_complete_picture(display, monkeypatch):
    monkeypatch.setattr(display.shared.delivery, "bases", BaseFrames(max_bytes=1))
    surface = pygame.Surface((40, 30), 0, 32)
    with connect_page(display.link) as fast_page, connect_page(display.watch_link) as slow_page:
        fast_page.receive_message()
        slow_page.receive_message()
        for shade in (10, 20, 30):
            surface.fill((shade, 0, 0), (shade, 0, 5, 5))
            display.send(surface)
            fast_page.receive_frame()
            if shade != 20:
                slow_page.receive_frame()
        assert np.array_equal(fast_page.image, read_pixels(surface))
        while not np.array_equal(slow_page.image, read_pixels(surface)):
            slow_page.receive_frame()


def test_new_viewers_see_a_window_that_does_not_change(display):
    surface = pygame.Surface((40, 30), 0, 32)
    surface.fill((1, 2, 3))
    display.send(surface)
    for _ in range(5):
        with connect_page(display.watch_link) as viewer:
            viewer.receive_frame()
        assert np.array_equal(viewer.image, read_pixels(surface))
