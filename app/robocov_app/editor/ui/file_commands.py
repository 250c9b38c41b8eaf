"""Commands on files: open, save, import, export and recover, with the dialogs that they need."""

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

from PIL import Image, UnidentifiedImageError

from robocov.errors import MapError, describe_error, to_one_line
from robocov.mapfile import find_map_file, list_bundled_maps
from robocov.text import remove_controls
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits.properties import set_background
from robocov_app.editor.model import require
from robocov_app.editor.model.background import create_background
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.map_draft import MapDraft, is_open_elsewhere
from robocov_app.editor.model.map_file import SUFFIX, FileChangedError
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.settings import MAX_RECENT
from robocov_app.editor.ui.importing.dialog import ImportDialog
from robocov_app.editor.ui.importing.service import Imported, ImportService
from robocov_app.formats import (
    EXPORTERS,
    IMPORTERS,
    Importer,
    WriteOptions,
    choose_exporter,
    detect_format,
    export_map,
)
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.toolkit.dialogs import Option, create_file_choice, create_list_choice

Action: TypeAlias = Callable[[], object]
IMPORT_PATIENCE_S = 2.0  # an import that takes longer is aborted when its settings change
MIN_BACKGROUND_WIDTH_M = 1.0
MAX_PARENT_FOLDERS = 1  # maximum number of ".." in the path of a background image relative to its map
HEADER_BYTES = 4096  # first bytes of a file, in which the format of a map is named
OPEN_SUFFIXES = (SUFFIX, *(suffix for importer in IMPORTERS.values() for suffix in importer.suffixes))
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".webp", ".tif", ".tiff")
_CANCEL = ("Cancel", "c", lambda: None)
# Errors that decoders raise for files that are not images, are broken, or are too large.
_IMAGE_ERRORS = (
    OSError,
    UnidentifiedImageError,
    Image.DecompressionBombError,
    ValueError,
    SyntaxError,
)


class FileCommands:
    """Commands on files.

    Parameters
    ----------
    editor : Editor
        The editor.
    draft_folder : Path or None
        Folder for drafts; None to save no drafts.
    fit : callable
        Fits the view to the whole map.
    waits_for_workers : bool
        Whether to import in this process and wait, instead of in the background.

    Attributes
    ----------
    may_close : bool
        Whether the editor may be closed.
    """

    def __init__(
        self, editor: Editor, draft_folder: Path | None, fit: Action, *, waits_for_workers: bool = False
    ) -> None:
        self.editor = editor
        self.draft_folder = draft_folder
        self.may_close = False
        self._fit = fit
        self._waits_for_workers = waits_for_workers
        # A document that is open, but not shown until the current one may be closed.
        self._document_to_open: Document | None = None

    def close_document_then(self, then: Action) -> None:
        """Run an action and close the document, after asking the user about unsaved changes."""
        document = self.editor.document

        def discard() -> None:
            # The document is kept if the action fails.
            then()
            document.close(discard=True)

        if not document.history.has_unsaved_changes:
            discard()
            return
        save = partial(self.save, then=lambda: self.close_document_then(then))
        text = f"“{document.title}” has changes that are not saved."
        answers = (("Save", "s", save), ("Discard", "d", discard), _CANCEL)
        self.editor.ask_question("Save the changes?", text, *answers)

    def _open_when_closed(self, document: Document, message: str) -> None:
        """Show a document as soon as the current one may be closed, which may need an answer of the user."""
        self._document_to_open = document
        self.close_document_then(lambda: self._show(document, message))

    def _close_document_to_open(self) -> None:
        """Close a document that was opened but never shown, because the user kept the current one."""
        if self._document_to_open is not None:
            self._document_to_open.close(discard=True)
            self._document_to_open = None

    def _show(self, document: Document, message: str) -> None:
        if document is self._document_to_open:
            self._document_to_open = None
        self.editor.open_document(document)
        self._fit()
        if document.path is not None:
            self.remember(document.path)
        self.editor.show_message(message)

    def quit(self) -> None:
        """Close the editor, after asking the user about unsaved changes."""

        def allow_closing() -> None:
            self.may_close = True

        self.close_document_then(allow_closing)

    def new(self) -> None:
        """Open a new map in place of the current one."""
        message = "new map, 10 m × 10 m. Use Boundary to redraw its outline"
        self.close_document_then(lambda: self._show(Document.new(self.draft_folder), message))

    def ask_path(
        self, title: str, action: Callable[[Path], object], suffixes: Sequence[str], text: str = ""
    ) -> None:
        """Open a dialog for a path, and call an action with the path that the user chooses.

        Parameters
        ----------
        title : str
            Title of the dialog.
        action : callable
            Takes the path.
        suffixes : sequence of str
            Suffixes of the files that are offered.
        text : str
            Suggested path.
        """

        def choose(path: Path) -> None:
            self.editor.carry_out(lambda: action(path))

        dialog = create_file_choice(
            title,
            self.editor.folder,
            choose,
            suffixes=suffixes,
            text=text,
            hides_folder=self.editor.hidden_folder is not None,
        )
        self.editor.dialogs.ask(dialog)

    def ask_recent(self) -> None:
        """Open a dialog with recent and bundled maps, and open the one that the user chooses."""
        options = [Option(path, "recent") for path in self.editor.recent if Path(path).exists()]
        options += [Option(name, "comes with robocov; opens as a copy") for name in list_bundled_maps()]

        def choose(option: Option) -> None:
            self.editor.carry_out(lambda: self.open(find_map_file(option.text)))

        self.editor.dialogs.ask(create_list_choice("Recent and bundled maps", lambda: options, choose))

    def open(self, path: Path) -> str | None:
        """Open a map, or import a file of another format. If the map is open already, it is reloaded.

        Returns
        -------
        str or None
            Status message of a reload. Other results are shown when the document is open.

        Raises
        ------
        MapError
            If the file cannot be read, or another editor has it open.
        """
        require_regular_file(path)
        current_path = self.editor.document.path
        if (
            current_path is not None
            and current_path.exists()
            and path.exists()
            and path.samefile(current_path)
        ):
            return self.reload()
        self._close_document_to_open()
        if is_open_elsewhere(self.draft_folder, path=path):
            raise MapError(f"{path.name}: already open in another editor; close it there first")
        result = open_or_detect(path, self.draft_folder)
        if isinstance(result, Document):
            self._open_when_closed(result, describe_opening(result))
        else:
            self.ask_import(path, result)
        return None

    def ask_import(self, path: Path, importer: Importer) -> None:
        """Open the import dialog for a file of another format, and then open the imported map.

        The file is imported in a separate process, which the dialog controls.
        """

        def accept(imported: Imported) -> None:
            sketch = Sketch.from_environment(imported.environment)
            self._close_document_to_open()
            document = Document(sketch, self.draft_folder, is_saved=False, stem=path.stem)
            self._open_when_closed(document, f"imported: {path.name}, not saved yet")

        self.editor.dialogs.ask(ImportDialog(path, importer, self._create_import_worker(), accept))

    def _create_import_worker(self) -> Worker[Imported]:
        """Create the worker that imports, in a separate process unless the editor waits for it."""
        if self._waits_for_workers:
            return DirectWorker(ImportService())
        service = f"{ImportService.__module__}:{ImportService.__name__}"
        return LatestWorker(service, "imports", patience=IMPORT_PATIENCE_S)

    def recover(self, draft: MapDraft) -> None:
        """Open the map of a draft that another editor left behind."""
        message = f"recovered: {draft.describe()}"
        self.close_document_then(lambda: self._show(Document.recover(draft, self.draft_folder), message))

    def remember(self, path: Path) -> None:
        """Move a path to the top of the recent maps."""
        # Links are not resolved, so that the user recognizes the path.
        name = os.path.abspath(path)  # noqa: PTH100
        others = [recent for recent in self.editor.recent if recent != name]
        self.editor.recent = [name, *others][:MAX_RECENT]

    def save(self, then: Action | None = None) -> str | None:
        """Save the map, and then run an action; return the status message, or None if a dialog was opened."""
        if self.editor.document.path is None:
            self.ask_name(then)
            return None
        return self._save(self.editor.document.path, then)

    def ask_name(self, then: Action | None = None) -> None:
        """Open a dialog for a path, save the map there, and then run an action."""
        folder = self.editor.folder
        suggested = self.editor.document.suggest_path(folder)
        text = str(suggested)
        if suggested.parent == folder:
            text = suggested.name
        self.ask_path("Save as", lambda path: self._save(path, then), [SUFFIX], text)

    def _save(
        self, path: Path, then: Action | None, *, overwrites: bool = False, replaces_valid_map: bool = False
    ) -> str | None:
        """Save the map, and then run an action; return the status message, or None if a dialog was opened.

        The user is asked first if the file has changed, or if an invalid map would replace a valid one.
        """
        document = self.editor.document
        may_replace = overwrites or replaces_valid_map
        if not may_replace and document.would_replace_valid_map(path):
            text = f"{path.name} contains a valid map; this one cannot run yet."
            save_draft = partial(self._save, path, then, replaces_valid_map=True)
            self._ask_overwrite("Save a draft over it?", text, then, save_draft)
            return None
        try:
            message = document.save(path, overwrites=overwrites)
        except FileChangedError as error:
            overwrite = partial(self._save, path, then, overwrites=True)
            self._ask_overwrite("Replace the file?", str(error), then, overwrite)
            return None
        assert document.path is not None
        self.remember(document.path)
        errors = [problem for problem in self.editor.problems if problem.is_error]
        if errors:
            message += f", as a draft: {errors[0].message}"
        if then is not None:
            then()
        return message

    def _ask_overwrite(self, title: str, text: str, then: Action | None, overwrite: Action) -> None:
        save_as = ("Save as…", "a", lambda: self.ask_name(then))
        self.editor.ask_question(title, text, save_as, ("Replace it", "r", overwrite), _CANCEL)

    def ask_export(self) -> None:
        """Open a dialog for a path, and export the map there; raise MapError if the map is invalid."""
        # This raises an error before the dialog is opened if the map cannot be exported.
        self.editor.sketch.build_environment()
        suffixes = [suffix for exporter in EXPORTERS.values() for suffix in exporter.suffixes]
        title = f"Export to a file ending in {', '.join(suffixes)}"
        suggested = self.editor.document.suggest_path(self.editor.folder)
        self.ask_path(title, self._export, suffixes, f"{suggested.stem}.svg")

    def _export(self, path: Path, *, overwrites: bool = False) -> str | None:
        # Some formats write further files, such as the image of a ROS map.
        files_to_write = choose_exporter(path).list_files(path, WriteOptions())
        existing_files = [str(file) for file in files_to_write if file.exists()]
        if existing_files and not overwrites:
            another_name = ("Another name…", "a", self.ask_export)
            overwrite = ("Replace", "r", lambda: self._export(path, overwrites=True))
            is_single = len(existing_files) == 1
            title = "Replace the file?" if is_single else "Replace the files?"
            text = f"{' and '.join(existing_files)} already {'exists' if is_single else 'exist'}."
            self.editor.ask_question(title, text, another_name, overwrite, _CANCEL)
            return None
        report = export_map(self.editor.sketch.build_environment(), path)
        files = ", ".join(map(str, report.files))
        return "; ".join([f"exported: {files}", *report.warnings, *report.dropped])

    def poll(self) -> None:
        """Accept a finished import, and report changes of the file by other programs."""
        editor = self.editor
        dialog = editor.dialogs.current
        if isinstance(dialog, ImportDialog):
            imported = dialog.poll()
            if imported is not None:
                editor.dialogs.close()
                editor.attempt(lambda: dialog.call(imported))
        if editor.dialogs.current is not None:
            return
        state = editor.document.check_disk(editor.now)
        title = editor.document.title
        if state == "gone":
            editor.show_message(f"{title} no longer exists. Press Ctrl+S to save it again.", is_error=True)
        elif state == "changed":
            text = f"Another program has changed {title}. Reloading can be undone."
            reload = ("Reload", "r", self.reload)
            keep = ("Keep mine", "k", editor.document.ignore_disk_change)
            editor.ask_question("The file has changed", text, reload, keep)

    def reload(self) -> str:
        """Read the file again, as a change that can be undone; return the status message."""
        require(self.editor.document.path, "the map has no file yet")
        self.editor.document.reload()
        self.editor.measurement = None
        return f"reloaded: {self.editor.document.title}"

    def open_background(self, path: Path) -> None:
        """Set the background image, and choose the tool that scales and moves it."""
        set_background_file(self.editor, path)
        self.editor.choose_tool("background")
        self._fit()


def set_background_file(editor: Editor, path: Path) -> None:
    """Set the background image to an image file.

    The first image becomes as wide as the map. One that replaces another gets the default width.

    Raises
    ------
    MapError
        If the file cannot be read, is not an image, or its path cannot be written to a map.
    """
    require_regular_file(path)
    try:
        with Image.open(path) as image:
            pixels = image.size
    except _IMAGE_ERRORS as error:
        # Pillow raises an OSError without a number for a file that is not an image.
        if isinstance(error, OSError) and error.errno is not None:
            raise MapError(f"{to_one_line(path)}: cannot be read: {describe_error(error)}") from None
        raise MapError(f"{to_one_line(path)}: cannot be read as an image") from None
    name = _describe_image_path(path, editor.document.path)
    if remove_controls(name) != name:
        raise MapError(f"{path}: expected an image whose path is text, got control characters or other bytes")
    background = create_background(name, pixels)
    bounds = editor.sketch.bounds
    if bounds is not None and editor.sketch.background is None:
        low_x, _, high_x, _ = bounds
        background = create_background(name, pixels, max(high_x - low_x, MIN_BACKGROUND_WIDTH_M))
    editor.shown.add("picture")
    editor.apply(set_background(editor.sketch, background))


def _describe_image_path(path: Path, map_path: Path | None) -> str:
    """Return the path of an image as written in a map: relative if the map is nearby, otherwise absolute."""
    path = path.resolve()
    if map_path is not None:
        try:
            relative = Path(os.path.relpath(path, map_path.resolve().parent))
        except ValueError:
            # The image is on another drive.
            return path.as_posix()
        parent_folders = relative.parts.count("..")
        if parent_folders <= MAX_PARENT_FOLDERS:
            return relative.as_posix()
    return path.as_posix()


def open_or_detect(path: Path, draft_folder: Path | None) -> Document | Importer:
    """Open a map, or detect the format of another file.

    Parameters
    ----------
    path : Path
        Path of a map, of a file in another format, or of a new map.
    draft_folder : Path or None
        Folder for drafts; None to save no drafts.

    Returns
    -------
    Document or Importer
        The opened map, or the importer for the format of the file.

    Raises
    ------
    MapError
        If the file is neither a valid map nor in a known format.
    """
    require_regular_file(path)
    has_map_suffix = path.suffix.lower() == SUFFIX
    if has_map_suffix and not path.exists():
        return Document.new(draft_folder, path)
    try:
        return Document.open_file(path, draft_folder)
    except MapError as error:
        map_error = error
    if not path.is_file() or (has_map_suffix and _is_map(path)):
        raise map_error
    try:
        return detect_format(path)
    except MapError:
        # For a broken map, the first error is more useful, because it names the mistake.
        if has_map_suffix or _is_map(path):
            raise map_error from None
        raise


def describe_opening(document: Document) -> str:
    """Return the status message for a document that was opened."""
    if document.path is None:
        return f"{document.title}: opened as a copy"
    if not document.path.exists():
        return f"new map {document.path.name}, 10 m × 10 m. Use Boundary to redraw its outline"
    return f"opened: {document.title}"


def _is_map(path: Path) -> bool:
    """Return whether a file seems to be a map by its first bytes; also true if it cannot be read."""
    try:
        with path.open("rb") as file:
            return b"robocov-map" in file.read(HEADER_BYTES)
    except OSError:
        return True
