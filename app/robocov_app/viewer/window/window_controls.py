"""Controls of the viewer's window on the page of a phone: their state, and where a drag scrolls."""

from collections.abc import Sequence

from robocov_app.toolkit.dialogs import Dialogs
from robocov_app.toolkit.window.layout import Box, Layout, find_scroll_box
from robocov_app.toolkit.window.page_view import WindowControls
from robocov_app.toolkit.window_part import WindowPart
from robocov_app.viewer.canvas.layer_bar import BAR_HEIGHT_PX
from robocov_app.viewer.lessons.guide import LessonGuide
from robocov_app.viewer.presenter import Presenter


class WindowControlsReader:
    """Reads the state of the window that the page of a phone shows.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    lesson : LessonGuide
        The lesson, if there is one.
    dialogs : Dialogs
        Shows the open dialog.
    parts : sequence of WindowPart
        Top bar, tool rail and panel.
    """

    def __init__(
        self,
        viewer: Presenter,
        lesson: LessonGuide,
        dialogs: Dialogs,
        parts: Sequence[WindowPart],
    ) -> None:
        self._viewer = viewer
        self._lesson = lesson
        self._dialogs = dialogs
        self._parts = parts

    def read(self, size: tuple[int, int], layout: Layout, *, is_covered: bool) -> WindowControls:
        """Return the state of the window.

        Parameters
        ----------
        size : (width, height), px
            Size of the window.
        layout : Layout
            Layout of the window.
        is_covered : bool
            Whether a dialog, a menu or the help page covers the map.

        Returns
        -------
        WindowControls
        """
        viewer = self._viewer
        destination, _ = viewer.session.timeline.destination
        return WindowControls(
            theme=viewer.view.theme,
            is_compact=viewer.view.is_compact,
            is_playing=viewer.session.playback.is_playing,
            can_undo=destination.parent is not None,
            tool=viewer.tool.name,
            lesson=self._describe_lesson(),
            has_panel=viewer.view.has_panel,
            is_typing=self._dialogs.is_typing or any(part.is_typing for part in self._parts),
            scroll_box=find_scroll_box(size, layout, is_covered=is_covered),
            is_covered=is_covered,
            map_box=_find_map_box(layout),
            lesson_buttons_box=self._lesson.find_buttons_box(layout),
            lesson_answers=self._lesson.find_answers(layout),
        )

    def _describe_lesson(self) -> str:
        if self._lesson.shown is not None:
            return "shown"
        return "left" if self._lesson.is_waiting else ""


def _find_map_box(layout: Layout) -> Box:
    """Return the part of the arena below the chips of the layers."""
    left, top, width, height = layout.arena
    chips_height = min(round(BAR_HEIGHT_PX * layout.scale), height)
    return Box(left, top + chips_height, width, height - chips_height)
