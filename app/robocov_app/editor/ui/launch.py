"""Opens the editor with the options of the command line, with or without a display."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from robocov.errors import InputError
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.map_draft import MapDraft, find_recoverable, is_open_elsewhere
from robocov_app.editor.model.measurement import create_measurement_worker
from robocov_app.editor.settings import (
    LAYERS,
    SETTING_ATTRIBUTES,
    SETTINGS_FILE,
    EditorSettings,
)
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.editor.ui.file_commands import describe_opening, open_or_detect, set_background_file
from robocov_app.editor.ui.window import EditorWindow
from robocov_app.formats import Importer
from robocov_app.storage.autosave import find_draft_folder, remove_draft
from robocov_app.storage.settings import (
    find_settings_file,
    load_settings,
    save_changed_settings,
)
from robocov_app.terminal.output import echo
from robocov_app.toolkit.dialogs import create_recovery_question
from robocov_app.toolkit.window.display import choose_scale, fit_to_screen, open_display
from robocov_app.toolkit.window.exceptions import ExceptionLog
from robocov_app.toolkit.window.layout import explain_reduced_scale
from robocov_app.toolkit.window.window_settings import limit_window_size

NO_DISPLAY = (
    "no display: the editor needs one. Add --serve to use it in a browser, or try ssh -X over ssh. "
    "--screenshot FILE renders it without a display. Map files can also be edited by hand: see robocov check "
    "--watch FILE."
)


@dataclass
class EditorLauncher:
    """Opens the editor.

    Attributes
    ----------
    path : Path or None
        Map to open, or file in another format to import; None for a new map.
    folder : Path
        Working folder for files; if `served`, also the folder in which drafts are stored.
    background : Path or None
        File of the background image.
    theme : str or None
        ``light`` or ``dark``; None for the theme that was used last.
    size : tuple of int or None
        Width and height, px; None for the size that was used last.
    scale : float or None
        Size of text and widgets; None for that of the settings, or one that suits the window.
    headless : bool
        Whether to draw without a display. Neither settings nor drafts are saved.
    served : bool
        Whether to draw for a browser: without a display, but in real time. Settings are not saved.
    """

    path: Path | None
    folder: Path
    background: Path | None = None
    theme: Literal["light", "dark"] | None = None
    size: tuple[int, int] | None = None
    scale: float | None = None
    headless: bool = False
    served: bool = False

    @contextmanager
    def window(self) -> Iterator[EditorWindow]:
        """Open the window with the saved settings, and save those that have changed when it closes.

        Raises
        ------
        InputError
            If there is no display, or another editor has the map open.
        MapError
            If the file cannot be read.
        """
        # The file is read before a window appears, so that its errors are reported without one.
        opened = self._read_file()
        document = opened
        if not isinstance(document, Document):
            document = Document.new(self._draft_folder)
        with ExitStack() as stack:
            # This does nothing if the document has been closed before.
            stack.callback(document.close, discard=False)
            worker = stack.enter_context(closing(create_measurement_worker(direct=self.headless)))
            stack.enter_context(open_display(headless=not self._has_display, missing_message=NO_DISPLAY))
            file = None
            if self._has_display:
                file = find_settings_file(SETTINGS_FILE)
            settings, settings_message = load_settings(EditorSettings, file)
            editor = Editor(document, worker, self.folder, settings)
            self._prepare_editor(editor, settings)
            editor.show_message(settings_message or self._describe_opening(opened))
            window = self._open_window(editor, settings)
            if not isinstance(opened, Document) and self.path is not None:
                window.file_commands.ask_import(self.path, opened)
            is_discarded = False
            try:
                with save_changed_settings(settings, file, partial(read_settings, window)):
                    yield window
                is_discarded = window.file_commands.may_close
            finally:
                window.close()
                # Unsaved changes are kept as a draft, unless the user has decided to save or discard them.
                editor.document.close(discard=is_discarded)

    @property
    def _has_display(self) -> bool:
        return not self.headless and not self.served

    @property
    def _draft_folder(self) -> Path | None:
        """Folder for drafts; None if no drafts are saved."""
        if self.headless:
            return None
        if self.served:
            return find_draft_folder(self.folder)
        return find_draft_folder(None)

    def _read_file(self) -> Document | Importer:
        """Open the document to edit, or return the importer for a file in another format."""
        draft_folder = self._draft_folder
        if self.path is None:
            return Document.new(draft_folder)
        if is_open_elsewhere(draft_folder, path=self.path):
            raise InputError(f"{self.path}: already open in another editor; close that one, or open a copy")
        return open_or_detect(self.path, draft_folder)

    def _describe_opening(self, opened: Document | Importer) -> str:
        if self.path is not None and isinstance(opened, Document):
            return describe_opening(opened)
        return ""

    def _prepare_editor(self, editor: Editor, settings: EditorSettings) -> None:
        """Apply the theme, and set the background image."""
        editor.theme = self.theme or settings.theme
        if self.background is not None:
            set_background_file(editor, self.background)
            editor.choose_tool("background", shows_hint=False)

    def _open_window(self, editor: Editor, settings: EditorSettings) -> EditorWindow:
        """Open the window of an editor, and offer to recover drafts."""
        draft_folder = self._draft_folder
        scale = choose_scale(self.scale or settings.scale, has_display=self._has_display)
        size = self._choose_size(settings)
        window = EditorWindow(editor, size, scale, draft_folder, waits_for_workers=self.headless)
        window.guard.log = ExceptionLog(draft_folder)
        window.guard.is_enabled = not self.headless
        window.panel.show_tab(settings.tab)
        if not self.served:  # In a browser, the page chooses the scale.
            self._report_scale(window)
        if editor.document.path is not None:
            window.file_commands.remember(editor.document.path)
        offer_recovery(window, find_recoverable(draft_folder))
        return window

    def _report_scale(self, window: EditorWindow) -> None:
        """Report if the window is too small for the requested scale; a dialog may cover its message."""
        message = explain_reduced_scale(self.scale, window.screen.get_size())
        if message:
            echo(f"robocov: {message}", to_stderr=True)
            window.editor.show_message(message)

    def _choose_size(self, settings: EditorSettings) -> tuple[int, int]:
        """Return the size of the window, px: the given size, or the saved size limited to the display."""
        if self.size:
            return self.size
        saved = (settings.width, settings.height)
        if self._has_display:
            return fit_to_screen(saved)
        return saved


def offer_recovery(window: EditorWindow, drafts: Sequence[MapDraft]) -> None:
    """Open a dialog that offers to recover the first draft; if it is discarded, offer the next one."""
    if not drafts:
        return
    draft = drafts[0]
    others = drafts[1:]

    def discard() -> None:
        remove_draft(draft.folder)
        offer_recovery(window, others)

    editor = window.editor
    question = create_recovery_question(
        f"An editor was closed without saving: {draft.describe()}.",
        other_count=len(others),
        recover=partial(editor.attempt, partial(window.file_commands.recover, draft)),
        discard=partial(editor.attempt, discard),
        postpone=lambda: None,
    )
    editor.dialogs.ask(question)


def read_settings(window: EditorWindow, before: EditorSettings) -> EditorSettings:
    """Return the current settings of a window; settings that cannot change there are as in `before`."""
    editor = window.editor
    width, height = limit_window_size(window.display.windowed_size or window.screen.get_size())
    changes: dict[str, object] = {
        setting: getattr(editor, attribute) for setting, attribute in SETTING_ATTRIBUTES.items()
    }
    changes["theme"] = editor.theme
    changes["tab"] = window.panel.tab
    changes["snaps"] = tuple(name for name in SNAPS if name in editor.snaps)
    changes["shown"] = tuple(name for name in LAYERS if name in editor.shown)
    changes["recent"] = tuple(editor.recent)
    changes["width"] = width
    changes["height"] = height
    return before.model_copy(update=changes)
