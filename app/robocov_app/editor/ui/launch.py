"""Opening the editor: with a display or without, from the command line's options."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import InputError
from robocov_app.editor.model.autosave import opened_elsewhere, recoverable
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.measurement_worker import measurement_worker
from robocov_app.editor.ui.editor import Editor, Pasteboard
from robocov_app.editor.ui.file_commands import heading, lay_under, opened
from robocov_app.editor.ui.pasteboard import OwnPasteboard
from robocov_app.editor.ui.settings import FILE, SHOWN, SNAPS, EditorSettings
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.autosave import autosave_folder, discard
from robocov_app.toolkit.settings import changed_settings, loaded, save_settings, settings_file
from robocov_app.toolkit.window import display, fitting, screen_scale

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov_app.editor.model.autosave import Autosave
    from robocov_app.editor.model.measurement import Measurement
    from robocov_app.editor.ui.window import EditorWindow
    from robocov_app.toolkit.worker import Worker

NO_DISPLAY = (
    "no display: the editor needs one (over ssh, try ssh -X); --screenshot FILE renders it without, "
    "and map files can be edited by hand: robocov check --watch FILE"
)


class EditorLauncher:
    """How the editor is opened."""

    def __init__(
        self,
        path: Path | None,
        folder: Path,
        *,
        background: Path | None = None,
        theme: str | None = None,
        size: tuple[int, int] | None = None,
        scale: float | None = None,
        headless: bool = False,
    ) -> None:
        self.path, self.folder, self.background = path, folder, background
        self.theme, self.size, self.scale, self.headless = theme, size, scale, headless

    @contextmanager
    def window(self) -> Iterator[EditorWindow]:
        """Give the window; settings are read before and kept afterwards."""
        drafts = None if self.headless else autosave_folder()
        if self.path is not None and not self.headless and opened_elsewhere(drafts, self.path):
            raise InputError(f"{self.path}: another editor has it open; close that one, or open a copy")
        # what is wrong with the file is told before a window flashes up
        found = Document.new(drafts) if self.path is None else opened(self.path, drafts)
        document = found if isinstance(found, Document) else Document.new(drafts)
        ended = False
        readings = measurement_worker(direct=self.headless)
        try:
            with display(headless=self.headless, otherwise=NO_DISPLAY):
                file = None if self.headless else settings_file(FILE)
                settings, trouble = loaded(EditorSettings, file)
                editor = self._editor(document, readings, settings)
                window = self._opened(editor, settings, drafts)
                editor.say(
                    trouble or (heading(document) if self.path is not None and document is found else "")
                )
                if document.path is not None:
                    window.documents.remember(document.path)
                if not self.headless:
                    offer(window, recoverable(drafts))
                if self.path is not None and not isinstance(found, Document):
                    window.documents.ask_import(self.path, found)
                begun = settings_of(window, settings)
                try:
                    yield window
                    save_settings(changed_settings(settings, begun, settings_of(window, settings)), file)
                    ended = True
                finally:
                    window.close()
                    # what was not saved stays to be offered, unless it was decided about
                    editor.document.close(discard=ended and window.documents.leaving)
        except BaseException:
            if not ended:
                document.close(discard=False)
            raise
        finally:
            readings.close()

    def _editor(self, document: Document, readings: Worker[Measurement], settings: EditorSettings) -> Editor:
        pasteboard: Pasteboard = OwnPasteboard() if self.headless else clipboard
        editor = Editor(document, readings, pasteboard, self.folder)
        editor.theme = self.theme or settings.theme
        editor.shown = set(settings.shown) & set(SHOWN)
        editor.snaps = set(settings.snaps) & set(SNAPS)
        editor.grid, editor.snap_angle = settings.grid, settings.angle
        editor.radius, editor.robots, editor.wall_width = settings.radius, settings.robots, settings.wall
        editor.recent = list(settings.recent)
        if self.background is not None:
            lay_under(editor, self.background)
            editor.choose("picture", tell=False)
        return editor

    def _opened(self, editor: Editor, settings: EditorSettings, drafts: Path | None) -> EditorWindow:
        from robocov_app.editor.ui.window import EditorWindow

        size = self.size or (settings.width, settings.height)
        scale = self.scale or settings.scale or (1.0 if self.headless else screen_scale())
        if self.size is None and not self.headless:
            size = fitting(size)
        window = EditorWindow(editor, size, scale, drafts, patient=self.headless)
        window.panel.show_tab(settings.tab)
        return window


def offer(window: EditorWindow, found: tuple[Autosave, ...]) -> None:
    """Offer work that was left behind, the newest first."""
    if not found:
        return
    draft, rest = found[0], found[1:]
    editor = window.editor

    def recover() -> None:
        window.documents.leave(lambda: window.documents.recover(draft))

    def throw_away() -> None:
        discard(draft.folder)
        offer(window, rest)

    answers = (("Recover", "r", recover), ("Discard", "d", throw_away), ("Later", "l", lambda: None))
    words = f"An editor ended without saving: {draft.words()}."
    if rest:
        words += f"\n{len(rest)} more {'are' if len(rest) > 1 else 'is'} kept besides."
    editor.ask("Recover unsaved work?", words, *answers)


def settings_of(window: EditorWindow, before: EditorSettings) -> EditorSettings:
    """Return what is worth remembering of a window."""
    editor = window.editor
    width, height = window.windowed or window.screen.get_size()
    changes = {
        "theme": editor.theme,
        "tab": window.panel.tab,
        "grid": editor.grid,
        "angle": editor.snap_angle,
        "snaps": tuple(name for name in SNAPS if name in editor.snaps),
        "shown": tuple(name for name in SHOWN if name in editor.shown),
        "radius": editor.radius,
        "robots": editor.robots,
        "wall": editor.wall_width,
        "recent": tuple(editor.recent),
        "width": min(max(width, 900), 7680),
        "height": min(max(height, 600), 4320),
    }
    return before.model_copy(update=changes)
