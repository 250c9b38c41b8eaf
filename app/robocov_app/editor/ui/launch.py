"""Opening the editor: with a display or without, from the command line's options."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path

from robocov.errors import InputError
from robocov_app.editor.model.document import Autosave, Document, opened_elsewhere, recoverable
from robocov_app.editor.model.measurement import measurement_worker
from robocov_app.editor.tools.snapping import SNAPS
from robocov_app.editor.ui.editor import FILE, KEPT, SHOWN, Editor, EditorSettings
from robocov_app.editor.ui.file_commands import heading, lay_under, opened
from robocov_app.editor.ui.window import EditorWindow
from robocov_app.storage.autosave import find_draft_folder, remove_draft
from robocov_app.storage.settings import (
    find_settings_file,
    load_settings,
    merge_changed_settings,
    save_settings,
)
from robocov_app.toolkit.display import fit_to_screen, get_screen_scale, open_display
from robocov_app.toolkit.faults import FaultLog

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
        Folder for what is saved without a path. Drafts of a `served` window are in it, too.
    headless : bool
        Draw without a display; keep neither settings nor drafts.
    served : bool
        Draw without a display, but live; keep no settings.
    """
    alone = headless or served
    drafts = None if headless else find_draft_folder(folder if served else None)
    if path is not None and opened_elsewhere(drafts, path=path):
        raise InputError(f"{path}: another editor has it open; close that one, or open a copy")
    # what is wrong with the file is told before a window flashes up
    found = Document.new(drafts) if path is None else opened(path, drafts)
    document = found if isinstance(found, Document) else Document.new(drafts)
    with ExitStack() as stack:
        stack.callback(document.close, discard=False)  # unless it was closed by then
        readings = stack.enter_context(closing(measurement_worker(direct=headless)))
        stack.enter_context(open_display(headless=alone, missing_message=NO_DISPLAY))
        file = None if alone else find_settings_file(FILE)
        settings, trouble = load_settings(EditorSettings, file)
        editor = Editor(document, readings, folder, settings)
        editor.theme = theme or settings.theme
        if background is not None:
            lay_under(editor, background)
            editor.choose("picture", tell=False)
        wanted = size or (settings.width, settings.height)
        wanted = wanted if size or alone else fit_to_screen(wanted)
        scale = scale or settings.scale or (1.0 if alone else get_screen_scale())
        editor.say(trouble or (heading(document) if path is not None and document is found else ""))
        window = EditorWindow(editor, wanted, scale, drafts, patient=headless)
        window.faults = FaultLog(drafts)
        window.contains_faults = not headless
        window.panel.show_tab(settings.tab)
        if document.path is not None:
            window.documents.remember(document.path)
        offer(window, recoverable(drafts))
        if path is not None and not isinstance(found, Document):
            window.documents.ask_import(path, found)
        begun, discarding = settings_of(window, settings), False
        try:
            yield window
            save_settings(merge_changed_settings(settings, begun, settings_of(window, settings)), file)
            discarding = window.documents.leaving
        finally:
            window.close()
            # what was not saved stays to be offered, unless it was decided about
            editor.document.close(discard=discarding)


def offer(window: EditorWindow, found: Sequence[Autosave]) -> None:
    if not found:
        return
    draft, rest = found[0], found[1:]

    def throw_away() -> None:
        remove_draft(draft.folder)
        offer(window, rest)

    recover = partial(window.documents.recover, draft)
    answers = (("Recover", "r", recover), ("Discard", "d", throw_away), ("Later", "l", lambda: None))
    words = f"An editor ended without saving: {draft.words()}."
    if rest:
        words += f"\n{len(rest)} more {'are' if len(rest) > 1 else 'is'} kept besides."
    window.editor.ask("Recover unsaved work?", words, *answers)


def settings_of(window: EditorWindow, before: EditorSettings) -> EditorSettings:
    editor = window.editor
    width, height = window.windowed or window.screen.get_size()
    changes = {
        **{name: getattr(editor, attribute) for name, attribute in KEPT.items()},
        "theme": editor.theme,
        "tab": window.panel.tab,
        "snaps": tuple(name for name in SNAPS if name in editor.snaps),
        "shown": tuple(name for name in SHOWN if name in editor.shown),
        "recent": tuple(editor.recent),
        "width": min(max(width, 900), 7680),
        "height": min(max(height, 600), 4320),
    }
    return before.model_copy(update=changes)
