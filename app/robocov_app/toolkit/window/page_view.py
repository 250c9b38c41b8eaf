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
    """

    scale: float
    theme: str
    shows_panel: bool | None
    is_compact: bool
    is_motion_reduced: bool


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


class MapDrawing(Protocol):
    """Draws the map of a window without its controls, for small screens."""

    def draw(self, size: tuple[int, int], scale: float) -> Surface | None:
        """Draw the map.

        Parameters
        ----------
        size : (width, height), px
        scale : float
            Size of texts and symbols.

        Returns
        -------
        pygame.Surface or None
            None if the window itself must be seen now, because it shows a dialog, for example.
        """

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same point of the map.

        Parameters
        ----------
        size : (width, height), px
            Size of a picture that `draw` has returned.
        pixel : (x, y)
            Pixel of that picture.

        Returns
        -------
        (x, y)
        """
