"""The view of a window in a browser page: its appearance, the state of the page's buttons, and its map."""

from dataclasses import dataclass
from typing import Protocol

from pygame import Surface

from robocov_app.toolkit.window.layout import Box


@dataclass(frozen=True)
class PageAppearance:
    """The appearance of a window that suits the browser page that shows it.

    Attributes
    ----------
    scale : float
        Size of texts and widgets.
    theme : str
        ``light`` or ``dark``.
    shows_panel : bool or None
        Whether the panel is shown; None to leave it as it is.
    is_compact : bool
        Whether the buttons of the bar and of the rail are left to the page of a phone.
    is_motion_reduced : bool
        Whether the user's system asks for reduced motion.
    max_dialog_width : float or None
        Maximum width of dialogs at scale 1, px, so that a phone can show them; None for their usual width.
    """

    scale: float
    theme: str
    shows_panel: bool | None
    is_compact: bool
    is_motion_reduced: bool
    max_dialog_width: float | None = None


@dataclass(frozen=True)
class LessonAnswers:
    """Answers to the open question of a lesson.

    Attributes
    ----------
    box : Box
        Part of the window that shows them.
    texts : list of str
        The answers in their order.
    text_size : float, px
        Size of their text in the window.
    """

    box: Box
    texts: list[str]
    text_size: float


@dataclass(frozen=True)
class WindowControls:
    """State of a window that the buttons of a phone's page show.

    Attributes
    ----------
    theme : str
        ``light`` or ``dark``.
    is_compact : bool
        Whether the window leaves its buttons to the page.
    is_playing : bool
        Whether time passes.
    can_undo : bool
        Whether there is an edit to undo.
    tool : str
        Name of the tool in use.
    lesson : str
        ``shown`` while a lesson is shown, ``left`` while the user has taken over from it, or else empty.
    has_panel : bool
        Whether the panel is open.
    is_typing : bool
        Whether typed text goes to a text field.
    scroll_box : Box or None
        Part of the window that a vertical drag of a finger scrolls.
    kind : str
        ``viewer``, ``editor``, or ``trial`` for a viewer that was opened by the editor.
    is_drawing : bool
        Whether a drawing of the editor is unfinished.
    can_delete : bool
        Whether something is selected in the editor.
    is_covered : bool
        Whether a dialog, a menu or the help page covers the map.
    map_box : Box or None
        Part of the window that shows the map and no controls.
    lesson_buttons_box : Box or None
        Part of the window that shows the buttons of a lesson.
    lesson_answers : LessonAnswers or None
        Answers of a lesson that can be clicked.
    """

    theme: str
    is_compact: bool
    is_playing: bool
    can_undo: bool
    tool: str
    lesson: str
    has_panel: bool
    is_typing: bool
    scroll_box: Box | None
    kind: str = "viewer"
    is_drawing: bool = False
    can_delete: bool = False
    is_covered: bool = False
    map_box: Box | None = None
    lesson_buttons_box: Box | None = None
    lesson_answers: LessonAnswers | None = None


class MapDrawing(Protocol):
    """Draws the map of a window without its controls, for small screens."""

    @property
    def is_covered(self) -> bool:
        """Whether a dialog, a menu or the help page covers the map in the window."""

    def draw(self, size: tuple[int, int], scale: float, *, is_controlling: bool) -> Surface:
        """Draw the map.

        Parameters
        ----------
        size : (width, height), px
        scale : float
            Size of texts and symbols.
        is_controlling : bool
            Whether the picture is for the page that controls the window, on which buttons can be used.

        Returns
        -------
        pygame.Surface
        """

    def draw_cover(self, size: tuple[int, int], scale: float) -> Surface:
        """Draw what covers the map, for the user who controls the window on a small screen.

        Parameters
        ----------
        size : (width, height), px
        scale : float
            Size of texts and symbols.

        Returns
        -------
        pygame.Surface
        """

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of the newest picture of a size.

        Parameters
        ----------
        size : (width, height), px
        pixel : (x, y)

        Returns
        -------
        (x, y)
        """
