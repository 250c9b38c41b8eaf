"""Documents opened, saved and left, with the questions that have to be asked."""

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TypeAlias

from PIL import Image, UnidentifiedImageError

from robocov.errors import MapError
from robocov.mapfile import find_map_file, list_bundled_maps
from robocov.text import remove_controls
from robocov_app.editor.edits.properties import underlaid
from robocov_app.editor.model import require
from robocov_app.editor.model.background import picture_laid
from robocov_app.editor.model.document import SUFFIX, Autosave, ChangedError, Document, opened_elsewhere
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.ui.editor import MOST_RECENT, Editor
from robocov_app.editor.ui.import_dialog import ImportDialog
from robocov_app.editor.ui.importing import Imported, Importing
from robocov_app.formats import EXPORTERS, IMPORTERS, Importer, detect_format, export_map
from robocov_app.jobs.workers import DirectWorker, LatestWorker, Worker
from robocov_app.storage.regular_files import require_regular_file
from robocov_app.toolkit.dialogs import Option, file_choice, list_choice

Act: TypeAlias = Callable[[], object]
_PATIENCE = 2.0  # seconds after which an import with settings that have changed since is given up
_CANCEL = ("Cancel", "c", lambda: None)
OPENED = (SUFFIX, *(suffix for importer in IMPORTERS.values() for suffix in importer.suffixes))
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".webp", ".tif", ".tiff")


class FileCommands:
    """Commands on whole documents."""

    def __init__(self, editor: Editor, drafts: Path | None, fit: Act, *, patient: bool = False) -> None:
        self.editor, self.drafts, self._fit, self._patient = editor, drafts, fit, patient
        self.leaving = False
        self._pending: Document | None = None  # opened, until the present document may be left for it

    def leave(self, then: Act) -> None:
        document = self.editor.document

        def discard() -> None:
            then()
            document.close(discard=True)

        if not document.history.unsaved:
            discard()
            return
        save = partial(self.save, then=lambda: self.leave(then))
        words = f"“{document.title}” has changes that are in no file."
        answers = (("Save", "s", save), ("Discard", "d", discard), _CANCEL)
        self.editor.ask("Save the changes?", words, *answers)

    def _leave_for(self, document: Document, words: str) -> None:
        """Show another document, as soon as the present one may be left."""
        self._pending = document
        self.leave(lambda: self._put(document, words))

    def _close_pending(self) -> None:
        """Close a document that was opened, but for which the present one was not left."""
        if self._pending is not None:
            self._pending.close(discard=True)
            self._pending = None

    def _put(self, document: Document, words: str) -> None:
        if document is self._pending:
            self._pending = None
        self.editor.put(document)
        self._fit()
        if document.path is not None:
            self.remember(document.path)
        self.editor.say(words)

    def quit(self) -> None:
        self.leave(lambda: setattr(self, "leaving", True))

    def new(self) -> None:
        words = "a new map: 10 x 10 m; B draws another boundary"
        self.leave(lambda: self._put(Document.new(self.drafts), words))

    def ask_path(
        self, title: str, call: Callable[[Path], object], endings: Sequence[str], text: str = ""
    ) -> None:
        def chosen(path: Path) -> None:
            self.editor.carry_out(lambda: call(path))

        self.editor.dialogs.ask(file_choice(title, self.editor.folder, chosen, endings=endings, text=text))

    def ask_recent(self) -> None:
        names = [Option(path, "recent") for path in self.editor.recent if Path(path).exists()]
        names += [Option(name, "comes with robocov; opens as a copy") for name in list_bundled_maps()]

        def chosen(option: Option) -> None:
            self.editor.carry_out(lambda: self.open(find_map_file(option.text)))

        self.editor.dialogs.ask(list_choice("Open a recent or bundled map", lambda: names, chosen))

    def open(self, path: Path) -> None:
        require_regular_file(path)
        own = self.editor.document.path
        if own is not None and own.exists() and path.exists() and path.samefile(own):
            self.reload()
            return
        self._close_pending()
        if opened_elsewhere(self.drafts, path=path):
            raise MapError(f"{path.name}: another editor has it open")
        found = opened(path, self.drafts)
        if isinstance(found, Document):
            self._leave_for(found, heading(found))
        else:
            self.ask_import(path, found)

    def ask_import(self, path: Path, importer: Importer) -> None:
        def put(imported: Imported) -> None:
            sketch = Sketch.from_environment(imported.environment)
            self._close_pending()
            document = Document(sketch, self.drafts, saved=False, stem=path.stem)
            self._leave_for(document, f"imported: {path.name}, not saved yet")

        worker: Worker[Imported] = DirectWorker(Importing())
        if not self._patient:
            worker = LatestWorker(f"{Importing.__module__}:Importing", "imports", patience=_PATIENCE)
        self.editor.dialogs.ask(ImportDialog(path, importer, worker, put))

    def recover(self, draft: Autosave) -> None:
        self.leave(lambda: self._put(Document.recovered(draft, self.drafts), f"recovered: {draft.words()}"))

    def remember(self, path: Path) -> None:
        name = os.path.abspath(path)  # noqa: PTH100 - resolves no links, as people know the path
        self.editor.recent = [name, *(each for each in self.editor.recent if each != name)][:MOST_RECENT]

    def save(self, then: Act | None = None) -> str | None:
        if self.editor.document.path is None:
            self.ask_name(then)
            return None
        return self._save(self.editor.document.path, then)

    def ask_name(self, then: Act | None = None) -> None:
        folder = self.editor.folder
        suggested = self.editor.document.suggested(folder)
        text = suggested.name if suggested.parent == folder else str(suggested)
        self.ask_path("Save as", lambda path: self._save(path, then), [SUFFIX], text)

    def _save(self, path: Path, then: Act | None, *, over: bool = False, spoil: bool = False) -> str | None:
        editor = self.editor
        if not (over or spoil) and editor.document.spoils(path):
            words = f"{path.name} holds a valid map; this one cannot run yet."
            self._ask_over("Save a draft over it?", words, then, lambda: self._save(path, then, spoil=True))
            return None
        try:
            words = editor.document.save(path, over=over)
        except ChangedError as error:
            self._ask_over("Replace the file?", str(error), then, partial(self._save, path, then, over=True))
            return None
        assert editor.document.path is not None
        self.remember(editor.document.path)
        if grave := [problem for problem in editor.problems if problem.grave]:
            words += f", as a draft: {grave[0].words}"
        if then is not None:
            then()
        return words

    def _ask_over(self, title: str, words: str, then: Act | None, go_on: Act) -> None:
        answers = (("Save as…", "a", lambda: self.ask_name(then)), ("Replace it", "r", go_on), _CANCEL)
        self.editor.ask(title, words, *answers)

    def ask_export(self) -> None:
        self.editor.sketch.environment()
        suffixes = [suffix for exporter in EXPORTERS.values() for suffix in exporter.suffixes]
        title = f"Export to a file ending in {', '.join(suffixes)}"
        suggested = self.editor.document.suggested(self.editor.folder)
        self.ask_path(title, self._export, suffixes, f"{suggested.stem}.svg")

    def _export(self, path: Path, *, over: bool = False) -> str | None:
        if path.exists() and not over:
            over_it = ("Replace it", "r", lambda: self._export(path, over=True))
            answers = (("Another name…", "a", self.ask_export), over_it, _CANCEL)
            self.editor.ask("Replace the file?", f"{path} is there already.", *answers)
            return None
        report = export_map(self.editor.sketch.environment(), path)
        files = ", ".join(map(str, report.files))
        return "; ".join([f"exported: {files}", *report.warnings, *report.dropped])

    def look(self) -> None:
        editor = self.editor
        if isinstance(asked := editor.dialogs.asked, ImportDialog) and (imported := asked.poll()) is not None:
            editor.dialogs.close()
            editor.attempt(lambda: asked.call(imported))
        if editor.dialogs.asked is not None:
            return
        state = editor.document.look(editor.now)
        if state == "gone":
            editor.say(f"{editor.document.title} is no longer there; Ctrl S writes it again", trouble=True)
        elif state == "changed":
            words = f"Something else has changed {editor.document.title}. Reloading can be undone."
            answers = (("Reload", "r", self.reload), ("Keep mine", "k", editor.document.keep_mine))
            editor.ask("The file has changed", words, *answers)

    def reload(self) -> str:
        require(self.editor.document.path, "the map has no file yet")
        self.editor.document.reload()
        self.editor.measurement = None
        return f"read again: {self.editor.document.title}"

    def underlay(self, path: Path) -> None:
        lay_under(self.editor, path)
        self.editor.choose("picture")
        self._fit()


def lay_under(editor: Editor, path: Path) -> None:
    """Put a picture under the map, as wide as the map is, or 20 m."""
    require_regular_file(path)
    try:
        with Image.open(path) as picture:
            pixels = picture.size
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError, ValueError, SyntaxError):
        raise MapError(f"{path}: not a picture that can be read") from None
    bounds = editor.sketch.bounds
    name = _from_map(path, editor.document.path)
    if remove_controls(name) != name:
        raise MapError(
            f"{path}: expected a picture whose path is text, got control characters or other bytes"
        )
    laid = picture_laid(name, pixels)
    if bounds is not None and editor.sketch.background is None:
        laid = picture_laid(laid.path, pixels, max(bounds[2] - bounds[0], 1.0))
    editor.shown.add("picture")
    editor.change(underlaid(editor.sketch, laid))


def _from_map(path: Path, of: Path | None) -> str:
    """Return how a map names a picture: from its own folder where that is near, else from the root."""
    path = path.resolve()
    with suppress(ValueError):  # on another drive
        if of is not None and (near := os.path.relpath(path, of.resolve().parent)).count("..") < 2:
            return Path(near).as_posix()
    return path.as_posix()


def opened(path: Path, drafts: Path | None) -> Document | Importer:
    """Return the document of a file; or the format of one that has to be imported."""
    require_regular_file(path)
    if path.suffix.lower() == SUFFIX and not path.exists():
        return Document.new(drafts, path)
    try:
        return Document.opened(path, drafts)
    except MapError as error:
        if path.is_file() and not (path.suffix.lower() == SUFFIX and _is_map(path)):
            try:
                return detect_format(path)
            except MapError:  # which names it for what it is
                if path.suffix.lower() != SUFFIX and not _is_map(path):
                    raise
        raise error from None


def heading(document: Document) -> str:
    if document.path is None:
        return f"{document.title}: opened as a copy"
    if not document.path.exists():
        return f"a new map, {document.path.name}: 10 x 10 m; B draws another boundary"
    return f"opened: {document.title}"


def _is_map(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return b"robocov-map" in file.read(4096)
    except OSError:
        return True
