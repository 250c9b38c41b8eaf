"""The handle that closes the sheet of a window."""

import pygame
import pytest

from robocov_app.toolkit.sheet_handle import SheetHandle
from robocov_app.toolkit.window.layout import build_layout

LAYOUT = build_layout((360, 640), 1.0, 1, 4 / 3, is_compact=True)
ON_HANDLE = (180, LAYOUT.handle.top + 2)
ON_MAP = (180, 100)


def build_press(position: tuple[int, int], button: int = 1) -> pygame.event.Event:
    return pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=position, button=button)


def build_release(position: tuple[int, int], button: int = 1) -> pygame.event.Event:
    return pygame.event.Event(pygame.MOUSEBUTTONUP, pos=position, button=button)


@pytest.mark.parametrize(
    ("events", "count"),
    [
        ([build_press(ON_HANDLE), build_release(ON_HANDLE)], 1),
        ([build_press(ON_HANDLE), build_release((180, LAYOUT.handle.top + 100))], 1),
        ([build_press(ON_HANDLE), build_release(ON_MAP)], 0),
        ([build_press(ON_HANDLE), build_release(ON_HANDLE, button=3)], 0),
        ([build_press(ON_MAP), build_release(ON_HANDLE)], 0),
        # The first release is lost, for example because a dialog has opened.
        ([build_press(ON_HANDLE), build_press(ON_MAP), build_release(ON_HANDLE)], 0),
    ],
    ids=["tap", "drag down", "drag up", "other button", "press elsewhere", "lost release"],
)
def test_a_tap_or_a_drag_down_closes_the_sheet(events: list[pygame.event.Event], count: int) -> None:
    closed: list[bool] = []
    handle = SheetHandle(lambda: closed.append(True))
    for event in events:
        handle.handle_event(event, LAYOUT)
    assert len(closed) == count
