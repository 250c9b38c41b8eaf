"""The lesson in a window: starting, drawing, input of the user, leaving and ending."""

from collections.abc import Callable
from pathlib import Path

import pygame

from robocov_app.look.theme import Theme
from robocov_app.toolkit.window.layout import Box, Layout
from robocov_app.toolkit.window.page_view import LessonAnswers
from robocov_app.viewer.key_hints import explain_answering, explain_chapter_end
from robocov_app.viewer.lessons.page import ClickArea, draw_caption, draw_lesson_page
from robocov_app.viewer.lessons.player import FIRST_LESSON, LessonPlayer, LessonState, load_lesson
from robocov_app.viewer.lessons.sheet import draw_lesson_sheet
from robocov_app.viewer.presenter import Presenter

COMMANDS_WITHIN_LESSON = frozenset(
    {
        "help",
        "theme",
        "screenshot",
        "video",
        "panel",
        "fullscreen",
        "quit",
        "pause",
        "slower",
        "faster",
        "fit",
        "zoom:in",
        "zoom:out",
        "plot",
        "tour",
        "open:file",
        "open",
        "recover",
    }
)
"""Commands after which the lesson continues; with any other command, the user takes over."""

_BUTTON_NAMES = ("back", "next")
_ANSWER_PREFIX = "answer:"
_BUTTONS_MARGIN_PX = 4
"""Distance of the part with the buttons from the top of the buttons, and from the left edge of the panel."""
_ANSWER_TEXT_PX = 13
"""Size of the answers, at scale 1, on pages that cannot answer."""
_ANSWER_KEYS = ("1", "2", "3", "4")

_CHAPTER_STEPS = {"forward": 1, "back": -1}
"""Commands that go to another chapter while a lesson is shown."""


class LessonGuide:
    """Runs a lesson in a window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    fit_view : callable
        Shows the whole map.
    is_unattended : bool
        Whether there is no user who could answer questions and do tasks.

    Attributes
    ----------
    player : LessonPlayer or None
        The lesson, if there is one.
    click_areas : list of ClickArea
        Answers and chapters on the page that can be clicked.
    """

    def __init__(self, viewer: Presenter, fit_view: Callable[[], None], *, is_unattended: bool) -> None:
        self.player: LessonPlayer | None = None
        self.click_areas: list[ClickArea] = []
        self.is_unattended = is_unattended
        self._path = FIRST_LESSON  # of the current lesson, or of the last one
        self._viewer = viewer
        self._fit_view = fit_view
        self._scroll_key: object = None  # the text that is scrolled
        self._scroll_offset: float | None = None  # px; None until the user scrolls it
        self._shown_offset = 0.0
        self._max_offset = 0.0

    @property
    def shown(self) -> LessonPlayer | None:
        """The lesson while it is shown; None while the user has taken over, or if there is none."""
        if self.player is None or self.player.state is LessonState.LEFT:
            return None
        return self.player

    @property
    def is_waiting(self) -> bool:
        """Whether the user has taken over from a chapter, and can return to it."""
        return self.player is not None and self.shown is None

    @property
    def frame_key(self) -> object:
        """Everything that determines how the lesson is drawn."""
        player = self.player
        if player is None:
            return None
        return player.state, player.number, player.progress, player.answer, self._scroll_offset

    def start(self, path: Path = FIRST_LESSON) -> None:
        """Start a lesson.

        Raises
        ------
        MapError
            If the lesson cannot be loaded.
        """
        saved = load_lesson(path)
        self._path = path
        self.player = LessonPlayer(self._viewer, self._fit_view, saved, is_unattended=self.is_unattended)

    def toggle(self) -> None:
        """Leave the lesson or return to it; else start the one in the open file or the last one."""
        if self.player is None:
            self.start(self._find_file())
        elif self.player.state is LessonState.LEFT:
            self.player.skip(0)
        else:
            self.player.leave(during_task=True)

    def _find_file(self) -> Path:
        """Return the file of the open session if it is a lesson, or else that of the last lesson."""
        file = self._viewer.files.workspace.path
        is_lesson = self._viewer.session.timeline.document.lesson is not None
        if is_lesson and file is not None:
            return file
        return self._path

    def leave(self) -> None:
        """Let the user take over from the lesson."""
        if self.player is not None:
            self.player.leave()

    def end(self) -> bool:
        """End the lesson; return whether there was one."""
        if self.player is None:
            return False
        self.player.end()
        self.player = None
        return True

    def advance(self, seconds: float) -> None:
        """Advance the lesson by real time, s."""
        if self.player is None:
            return
        self.player.advance(seconds)
        if self.player.is_done:
            self.player = None

    def handle_command(self, name: str) -> bool:
        """Let the lesson handle a command of the window; return whether it has done so."""
        if self.shown is not None and name in _CHAPTER_STEPS:
            self.shown.skip(_CHAPTER_STEPS[name])
            return True
        if name == "pause" and self.player is not None:
            return self._handle_pause(self.player)
        if name == "cancel" and self.end():
            return True
        if name not in COMMANDS_WITHIN_LESSON:
            self.leave()
        return False

    def _handle_pause(self, player: LessonPlayer) -> bool:
        """Explain why the chapter does not play on; return False if it can be paused or continued."""
        if player.state is LessonState.ASKING:
            self._viewer.show_message(explain_answering(self._viewer.view))
            return True
        if player.state is LessonState.ENDED and not player.session.playback.is_playing:
            self._viewer.show_message(explain_chapter_end(self._viewer.view))
            return True
        return False

    def handle_key(self, character: str) -> bool:
        """Answer the question by a number key; return whether the lesson has used the key.

        While no question is open, the keys of answers do nothing: pressed too late or twice, they would
        switch layers and leave the lesson. During a task they switch layers, which does not leave it.
        """
        player = self.shown
        if player is None or player.state is LessonState.TASK or character not in _ANSWER_KEYS:
            return False
        if player.state is LessonState.ASKING:
            player.reply(int(character))
        else:
            self._viewer.show_message("no question is open")
        return True

    def click(self, pixel: tuple[int, int]) -> bool:
        """Answer the question or choose a chapter by a click; return whether something was clicked."""
        for area in self.click_areas:
            if area.box.collidepoint(pixel):
                area.action()
                return True
        return False

    def find_buttons_box(self, layout: Layout) -> Box | None:
        """Return the part of the panel from *Back* and *Next* to its lower end; None without them."""
        tops = [area.box.top for area in self.click_areas if area.name in _BUTTON_NAMES]
        if not tops:
            return None
        margin = round(_BUTTONS_MARGIN_PX * layout.scale)
        left, top, width, height = layout.panel
        buttons_top = min(tops) - margin
        return Box(left + margin, buttons_top, width - margin, top + height - buttons_top)

    def find_answers(self, layout: Layout) -> LessonAnswers | None:
        """Return the answers that can be clicked, and the area that shows them; None without a question."""
        boxes = [area.box for area in self.click_areas if area.name.startswith(_ANSWER_PREFIX)]
        if self.shown is None or not boxes:
            return None
        union = boxes[0].unionall(boxes[1:])
        return LessonAnswers(
            box=Box(union.left, union.top, union.width, union.height),
            texts=[answer.text for answer in self.shown.marked_answers],
            text_size=_ANSWER_TEXT_PX * layout.scale,
        )

    def scroll(self, distance: float) -> bool:
        """Scroll the text in the sheet down by a distance, px; return whether there is more than fits."""
        if self.shown is None or not self._max_offset:
            return False
        self._scroll_offset = min(max(self._shown_offset + distance, 0.0), self._max_offset)
        return True

    def draw(self, screen: pygame.Surface, layout: Layout, theme: Theme) -> bool:
        """Draw the lesson in place of the panel, or as a caption; return whether there is one to draw."""
        self.click_areas = []
        self._max_offset = 0.0
        if self.shown is None:
            return False
        if layout.has_sheet:
            self._draw_sheet(screen, layout, theme, self.shown)
        elif layout.has_panel:
            self.click_areas = draw_lesson_page(screen, layout, theme, self.shown)
        else:
            draw_caption(screen, layout, theme, self.shown)
        return True

    def _draw_sheet(self, screen: pygame.Surface, layout: Layout, theme: Theme, player: LessonPlayer) -> None:
        key = (player.number, player.state)
        if key != self._scroll_key:
            self._scroll_key = key
            self._scroll_offset = None
        self.click_areas, self._shown_offset, self._max_offset = draw_lesson_sheet(
            screen, layout, theme, player, self._scroll_offset
        )
