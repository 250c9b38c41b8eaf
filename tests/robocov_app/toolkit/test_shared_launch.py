"""Sizes and scales of windows, and the question about unsaved work."""

from __future__ import annotations

import pygame
import pytest

from robocov_app.toolkit.dialogs import Question, create_recovery_question
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


@pytest.mark.parametrize(
    ("requested", "has_display", "scale"),
    [
        pytest.param(1.5, True, 1.5, id="requested"),
        pytest.param(None, False, 1.0, id="without a display"),
        pytest.param(None, True, None, id="automatic"),
    ],
)
def test_a_requested_scale_has_priority_over_the_display(
    requested: float | None, has_display: bool, scale: float | None
) -> None:
    assert choose_scale(requested, has_display=has_display) == scale


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


def create_question(calls: list[str], other_count: int = 0) -> Question:
    """Return the question about a draft, whose answers append to `calls`."""
    return create_recovery_question(
        "Draft.",
        other_count=other_count,
        recover=lambda: calls.append("recover"),
        discard=lambda: calls.append("discard"),
        postpone=lambda: calls.append("postpone"),
    )


@pytest.mark.parametrize(
    ("other_count", "ending"),
    [(0, "Draft."), (1, "\n1 more draft is available."), (3, "\n3 more drafts are available.")],
)
def test_the_recovery_question_counts_other_drafts(other_count: int, ending: str) -> None:
    assert create_question([], other_count).text.endswith(ending)


def test_a_draft_is_recovered_discarded_or_postponed() -> None:
    calls: list[str] = []
    for answer in create_question(calls).answers:
        answer.call()
    assert calls == ["recover", "discard", "postpone"]


def test_cancelling_the_recovery_question_postpones_the_draft() -> None:
    calls: list[str] = []
    create_question(calls).handle_cancel()
    assert calls == ["postpone"]
