"""Drawing of the status line and of the message above the map."""

from __future__ import annotations

from collections.abc import Callable

import pygame

from robocov_app.look.theme import Theme
from robocov_app.toolkit.overlay import draw_message, draw_status
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.lessons.guide import LessonGuide
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.window.status import suggest_actions

_LESSON_HINT = "F2: back to the lesson · Esc: end it"


class StatusDisplay:
    """Draws what the viewer reports: facts and hints in the status line, messages above the map.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    lesson : LessonGuide
        The lesson, if there is one.
    hint : str
        Keys to show at the end of the status line.
    can_suggest : bool
        Whether suggestions are shown, too.
    """

    def __init__(self, viewer: Presenter, lesson: LessonGuide, hint: str, *, can_suggest: bool) -> None:
        self._viewer = viewer
        self._lesson = lesson
        self._hint = hint
        self.can_suggest = can_suggest
        self._dismissed_suggestion = ""
        self._suggestion = ""

    @property
    def seek_progress(self) -> float | None:
        """Fraction of the steps of a seek that are recomputed; None if there is no seek."""
        pending = self._viewer.session.timeline.pending_seek
        if pending is None:
            return None
        return pending.progress

    def draw_status_line(
        self, screen: pygame.Surface, layout: Layout, theme: Theme, facts: list[str], *, has_hint: bool
    ) -> None:
        """Draw the status line with facts, most important first, and possibly the hint."""
        hint = self._hint if has_hint else ""
        if has_hint and self._lesson.is_waiting:
            hint = _LESSON_HINT
        elif self._lesson.shown is not None:
            hint = ""  # the page of the lesson names its keys; Space has another meaning there
        elif not self._viewer.session.playback.is_playing:
            hint = hint.replace("Space: pause", "Space: play")
        draw_status(screen, layout.status, theme, layout.scale, facts=facts, hint=hint)

    def dismiss_suggestion(self) -> None:
        """Hide the suggestion that is shown, until there is another one."""
        self._dismissed_suggestion = self._suggestion

    def draw_message(
        self,
        screen: pygame.Surface,
        layout: Layout,
        theme: Theme,
        find_strip_texts: Callable[[], list[pygame.Rect]],
    ) -> pygame.Rect | None:
        """Draw the progress of a seek, the status message, or a suggestion.

        Parameters
        ----------
        screen : pygame.Surface
        layout : Layout
        theme : Theme
        find_strip_texts : callable
            Returns the boxes of the texts below the map, px. Those that the message would cover in part are
            hidden.

        Returns
        -------
        pygame.Rect or None
            Where a click removes it, px; None if nothing is drawn.
        """
        viewer = self._viewer
        message = viewer.message
        is_error = bool(message) and viewer.has_error_message
        progress = self.seek_progress
        if progress is not None and not is_error:
            message = f"Recomputing the session: {100 * progress:.0f}%"
        if not message and self.can_suggest and self._lesson.shown is None:
            message = self._choose_suggestion()
        # Without a panel, the text of a lesson is at the bottom of the map.
        is_at_top = self._lesson.shown is not None and not layout.has_panel
        return draw_message(
            screen,
            message,
            layout.arena,
            theme,
            layout.scale,
            is_error=is_error,
            is_at_top=is_at_top,
            strip_texts=find_strip_texts() if message else (),
        )

    def _choose_suggestion(self) -> str:
        """Return the suggestion for the present state; empty without one or if it was dismissed."""
        self._suggestion = suggest_actions(self._viewer)
        if self._suggestion != self._dismissed_suggestion:
            self._dismissed_suggestion = ""
            return self._suggestion
        return ""
