"""An editor without a display, and a driver that uses its window."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pygame
from driven_window import MODIFIERS, Driver

from robocov.mapfile import load_map
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.document import DEFAULT_BOUNDARY, Document
from robocov_app.editor.model.measurement import create_measurement_worker
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.settings import EditorSettings
from robocov_app.editor.ui.window import EditorWindow
from robocov_app.toolkit.dialogs import Choice
from robocov_app.toolkit.window.display import open_display

SIZE = (900, 600)


def build_sheet(*shapes: Any, **more: Any) -> Sketch:
    """Return a sketch of 10 x 10 m with some obstacles."""
    return Sketch(boundary=DEFAULT_BOUNDARY, **more).with_obstacles(shapes)[0]


def load_sketch(name: str) -> Sketch:
    return Sketch.from_environment(load_map(name))


def rewrite_file(path: Path, text: str) -> None:
    """Write a file whose modification time is later in any case."""
    path.write_text(text)
    stat = path.stat()
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 10_000_000))


@contextmanager
def open_editor(
    folder: Path,
    sketch: Sketch | None = None,
    *,
    size: tuple[int, int] = SIZE,
    scale: float = 1.0,
    drafts: Path | None = None,
    document: Document | None = None,
    theme: str = "light",
    readings: Any = None,
) -> Iterator[EditorDriver]:
    """Open the editor without a display."""
    with open_display(headless=True):
        if document is None:
            document = Document(sketch if sketch is not None else build_sheet(), drafts)
        editor = Editor(
            document, readings or create_measurement_worker(direct=True), folder, EditorSettings()
        )
        editor.theme = theme
        driver = EditorDriver(EditorWindow(editor, size, scale, drafts, waits_for_workers=True))
        driver.settle()
        driver.run_frames(2)
        try:
            yield driver
        finally:
            if pygame.display.get_init():  # Another window may have closed the display.
                pygame.key.set_mods(0)
            driver.window.close()
            editor.document.close(discard=False)


class EditorDriver(Driver):
    """Uses the editor with mouse and keys; each action takes one or more frames."""

    window: EditorWindow

    def __init__(self, window: EditorWindow) -> None:
        self.window = window
        window.guard.is_enabled = False
        self.editor = window.editor
        self.pixel = (5, 5)

    def settle(self) -> None:
        """Handle the posted events, also during a trial."""
        if self.window.play_mode.window is None:
            super().settle()
        for _ in range(4 if self.window.play_mode.window is not None else 0):
            self.window.run_frame(0.0)

    @property
    def sketch(self) -> Sketch:
        return self.editor.sketch

    @property
    def shapes(self) -> list[Any]:
        return [item.shape for item in self.editor.sketch.obstacles]

    def find_pixel(self, point: tuple[float, float], pane: int = 0) -> tuple[float, float]:
        return self.window.canvas.to_pixel(point)

    def hold_keys(self, *names: str) -> None:
        """Hold modifier keys down; without names, release all."""
        pygame.key.set_mods(sum(MODIFIERS[name] for name in names))

    def move_to(self, *points: tuple[float, float], held: int = 0) -> None:
        """Move the mouse to positions, m."""
        for point in points:
            self.move(*self.find_pixel(point), held=held)

    def click_all(self, *points: tuple[float, float]) -> None:
        """Click positions, m, one after the other, too slowly for double clicks."""
        for point in points:
            self.wait()
            self.click_at(point)

    def double_click(self, point: tuple[float, float]) -> None:
        """Double-click a position, m."""
        self.wait()
        self.click_at(point)
        self.click_at(point)

    def wait(self, seconds: float = 0.5) -> None:
        self.window.run_frame(seconds)

    def click_answer(self, text: str) -> None:
        """Click a button of the open question."""
        self.settle()
        widgets = self.window.dialogs.ui.widgets.values()
        button = next(widget for widget in widgets if widget.kind == "button" and widget.text == text)
        self.click(*button.rect.center)

    def read_dialog_error(self) -> str:
        """Return the error that the open dialog shows for the typed text, and close the dialog."""
        dialog = self.editor.dialogs.current
        assert isinstance(dialog, Choice)
        assert dialog.error, "the dialog shows no error"
        self.press_key("escape")
        assert self.editor.dialogs.current is None
        return dialog.error

    def select(self, *keys: Any) -> None:
        self.editor.select(Selection.of(*keys))
        self.settle()

    def run_command(self, text: str) -> None:
        """Type a command into the palette."""
        self.press_key("ctrl+k")
        self.type(text)
        self.press_key("return")

    @property
    def message(self) -> str:
        return self.editor.message
