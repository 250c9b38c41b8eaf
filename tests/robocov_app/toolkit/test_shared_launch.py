"""Opening of both windows: sizes, scales, and the question about unsaved work."""

from __future__ import annotations

import pygame
import pytest

from robocov_app.toolkit.dialogs import create_recovery_question
from robocov_app.toolkit.window.display import choose_scale, find_suitable_scale
from robocov_app.toolkit.window.window_settings import WindowSettings, limit_window_size


@pytest.mark.parametrize(
    ("size", "limited"),
    [((1280, 720), (1280, 720)), ((1, 1), (900, 600)), ((100_000, 100_000), (7680, 4320))],
)
def test_window_sizes_are_limited_for_settings(size: tuple[int, int], limited: tuple[int, int]) -> None:
    width, height = limit_window_size(size)
    assert (width, height) == limited
    assert WindowSettings(width=width, height=height).width == width


def test_a_requested_scale_has_priority_over_the_display() -> None:
    assert choose_scale(1.5, has_display=True) == 1.5
    assert choose_scale(None, has_display=False) == 1.0
    assert choose_scale(None, has_display=True) is None


@pytest.mark.parametrize(
    ("size", "scale"),
    [((900, 600), 1.0), ((1280, 720), 1.0), ((1920, 1080), 1.25), ((2560, 1440), 1.5), ((2560, 720), 1.0)],
)
def test_the_scale_grows_with_the_window(
    size: tuple[int, int], scale: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [(1920, 1080)])
    assert find_suitable_scale(size) == scale


def test_the_scale_is_at_least_that_of_the_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [(3840, 2160)])
    assert find_suitable_scale((1280, 720)) == 2.0


@pytest.mark.parametrize(
    ("other_count", "ending"),
    [(0, "Draft."), (1, "\n1 more draft is available."), (3, "\n3 more drafts are available.")],
)
def test_the_recovery_question_counts_other_drafts(other_count: int, ending: str) -> None:
    calls: list[str] = []
    question = create_recovery_question(
        "Draft.",
        other_count=other_count,
        recover=lambda: calls.append("recover"),
        discard=lambda: calls.append("discard"),
        postpone=lambda: calls.append("postpone"),
    )
    assert question.text.endswith(ending)
    for answer in question.answers:
        answer.call()
    question.handle_cancel()
    assert calls == ["recover", "discard", "postpone", "postpone"]
