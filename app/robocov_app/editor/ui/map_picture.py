"""The map of the editor without its buttons, drawn in the size of the screen of a phone."""

import pygame

from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.look.theme import get_theme
from robocov_app.toolkit.overlay import draw_message
from robocov_app.toolkit.window.layout import build_layout


class EditorMapPicture:
    """Draws the map and the message of an editor in another size. See `MapPicture`.

    Parameters
    ----------
    editor : Editor
        The editor.
    window_canvas : EditorCanvas
        The canvas of the window, whose section of the map the picture shows.
    """

    def __init__(self, editor: Editor, window_canvas: EditorCanvas) -> None:
        self._editor = editor
        self._window_canvas = window_canvas
        self._canvas = EditorCanvas(editor, has_tools=False)

    def draw(self, size: tuple[int, int], scale: float, *, is_controlling: bool) -> pygame.Surface:
        """Draw the map and the message. See `MapPicture`."""
        editor = self._editor
        layout = build_layout(size, scale, panel=False, plot=False, is_compact=True)
        surface = pygame.Surface(size, 0, 32)
        self._canvas.arrange(layout, get_theme(editor.theme))
        self._canvas.follow(self._window_canvas)
        self._canvas.draw(surface)
        draw_message(
            surface,
            editor.message,
            layout.arena,
            self._canvas.theme,
            scale,
            is_error=editor.has_error_message,
            strip_texts=self._canvas.strip_texts,
        )
        return surface

    def find_window_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of the picture.

        A point of the map that the window does not show becomes a pixel at the edge of its map.
        """
        window_pixel = self._window_canvas.to_pixel(self._canvas.to_world(pixel))
        return self._window_canvas.layout.arena.clamp(window_pixel)
