"""Visible and headless displays, and their environment variables."""

from __future__ import annotations

import os
import sys

import pytest

from robocov.errors import InputError
from robocov_app.toolkit.window.display import open_display


@pytest.mark.parametrize("previous", [None, "x11"])
def test_a_headless_display_does_not_hide_later_windows(
    monkeypatch: pytest.MonkeyPatch, previous: str | None
) -> None:
    if previous is None:
        monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    else:
        monkeypatch.setenv("SDL_VIDEODRIVER", previous)
    with open_display(headless=True):
        assert os.environ["SDL_VIDEODRIVER"] == "dummy"
    assert os.environ.get("SDL_VIDEODRIVER") == previous


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_a_visible_window_needs_a_screen_after_a_headless_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    with open_display(headless=True):
        pass
    with (
        pytest.raises(InputError, match="nothing to see"),
        open_display(headless=False, missing_message="nothing to see"),
    ):
        pass
