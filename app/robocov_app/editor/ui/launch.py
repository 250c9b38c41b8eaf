"""Opening the editor with or without a display, from the options of the command line."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path

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
from robocov_app.editor.tools.snapping import SNAPS
from robocov_app.editor.ui.file_commands import describe_opening, open_or_detect, set_reference_image
from robocov_app.editor.ui.window import EditorWindow
from robocov_app.storage.autosave import find_draft_folder, remove_draft
from robocov_app.storage.settings import (
    find_settings_file,
    load_settings,
    merge_changed_settings,
    save_settings,
)
from robocov_app.toolkit.dialogs import create_recovery_question
from robocov_app.toolkit.display import choose_scale, fit_to_screen, open_display
from robocov_app.toolkit.faults import FaultLog
from robocov_app.toolkit.window_settings import limit_window_size

NO_DISPLAY = (
    "no display: the editor needs one (over ssh, try ssh -X); --screenshot FILE renders it without, "
    "and map files can be edited by hand: robocov check --watch FILE"
)


@contextmanager
def editor_window(
    path: Path | None,
    folder: Path,
    *,
    background: Path | None = None,
    theme: str | None = None,
    size: tuple[int, int] | None = None,
    scale: float | None = None,
    headless: bool = False,
    served: bool = False,
) -> Iterator[EditorWindow]:
    """Open the editor.

    Parameters
    ----------
    path : Path or None
        Map to open, or foreign file to import; None for a new map.
    folder : Path
        Folder of files without a path, and of the drafts of a `served` window.
    background : Path, optional
        Picture to put under the map.
    theme : str, optional
        Colors: "light" or "dark".
    size : tuple of int, optional
        Width and height of the window, px.
    scale : float, optional
        Size of texts and widgets.
    headless : bool
        Draw without a display; keep neither settings nor drafts.
    served : bool
        Draw without a display, but live; keep no settings.

    Yields
    ------
    EditorWindow
        The window.

    Raises
    ------
    InputError
        If there is no display, or another editor has the map open.
    MapError
        If the file cannot be read.
    """
    has_display = not headless and not served
    drafts = None if headless else find_draft_folder(folder if served else None)
    if path is not None and is_open_elsewhere(drafts, path=path):
        raise InputError(f"{path}: another editor has it open; close that one, or open a copy")
    # The file is read before a window appears, so that its errors are reported without one.
    opened = Document.new(drafts) if path is None else open_or_detect(path, drafts)
    document = opened if isinstance(opened, Document) else Document.new(drafts)
    with ExitStack() as stack:
        # Does nothing if the document was closed by then.
        stack.callback(document.close, discard=False)
        worker = stack.enter_context(closing(create_measurement_worker(direct=headless)))
        stack.enter_context(open_display(headless=not has_display, missing_message=NO_DISPLAY))
        file = find_settings_file(SETTINGS_FILE) if has_display else None
        settings, settings_error = load_settings(EditorSettings, file)
        editor = Editor(document, worker, folder, settings)
        editor.theme = theme or settings.theme
        if background is not None:
            set_reference_image(editor, background)
            editor.choose_tool("picture", shows_hint=False)
        window_size = _choose_size(size, settings, has_display=has_display)
        window_scale = choose_scale(scale or settings.scale, has_display=has_display)
        if settings_error:
            editor.show_message(settings_error)
        elif path is not None and document is opened:
            editor.show_message(describe_opening(document))
        window = EditorWindow(editor, window_size, window_scale, drafts, patient=headless)
        window.faults = FaultLog(drafts)
        window.contains_faults = not headless
        window.panel.show_tab(settings.tab)
        if document.path is not None:
            window.documents.remember(document.path)
        offer_recovery(window, find_recoverable(drafts))
        if path is not None and not isinstance(opened, Document):
            window.documents.ask_import(path, opened)
        first_settings = read_settings(window, settings)
        is_discarded = False
        try:
            yield window
            changed = merge_changed_settings(settings, first_settings, read_settings(window, settings))
            save_settings(changed, file)
            is_discarded = window.documents.leaving
        finally:
            window.close()
            # Unsaved changes are kept to be offered, unless the user has decided about them.
            editor.document.close(discard=is_discarded)


def _choose_size(
    size: tuple[int, int] | None, settings: EditorSettings, *, has_display: bool
) -> tuple[int, int]:
    """Return the size of the window, px; that of the settings is limited to the display."""
    if size:
        return size
    saved = (settings.width, settings.height)
    return fit_to_screen(saved) if has_display else saved


def offer_recovery(window: EditorWindow, drafts: Sequence[MapDraft]) -> None:
    """Offer to recover the first of several drafts; after discarding it, the next one."""
    if not drafts:
        return
    draft = drafts[0]
    others = drafts[1:]

    def discard() -> None:
        remove_draft(draft.folder)
        offer_recovery(window, others)

    editor = window.editor
    question = create_recovery_question(
        f"An editor ended without saving: {draft.describe()}.",
        others=len(others),
        recover=partial(editor.attempt, partial(window.documents.recover, draft)),
        discard=partial(editor.attempt, discard),
        postpone=lambda: None,
    )
    editor.dialogs.ask(question)


def read_settings(window: EditorWindow, before: EditorSettings) -> EditorSettings:
    """Return the present settings of a window; what it does not change is as before."""
    editor = window.editor
    width, height = limit_window_size(window.windowed_size or window.screen.get_size())
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
