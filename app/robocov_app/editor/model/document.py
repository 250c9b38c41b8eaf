"""The map that is open in the editor, with its history, file and draft."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from typing import Self

from robocov.errors import MapError
from robocov.mapfile import load_map
from robocov_app.editor.model.history import UndoHistory
from robocov_app.editor.model.map_draft import KIND, MapDraft, build_draft_content
from robocov_app.editor.model.map_file import (
    SUFFIX,
    FileState,
    FileVersion,
    add_suffix,
    check_file,
    is_bundled,
    read_sketch,
    write_sketch,
)
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.storage import autosave

DEFAULT_BOUNDARY = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
"""Boundary of a new map, m."""
_DEFAULT_STEM = "map"
_CHECK_INTERVAL_S = 1.0
"""Time between two checks of the file."""


class Document:
    """A map with its history and file. Unsaved changes are stored in a draft.

    Parameters
    ----------
    sketch : Sketch
        Content of the map.
    draft_folder : Path or None
        Folder for drafts; None to save no drafts.
    path : Path, optional
        File of the map.
    version : FileVersion, optional
        Version of the file from which the map was read.
    resumed : Path, optional
        Folder of a draft from which the map was recovered; it continues to be used.
    is_saved : bool
        Whether the file contains this map.
    stem : str
        Suggested file name, without suffix, for a map without a file.

    Attributes
    ----------
    history : UndoHistory
        Current content of the map, and its changes.
    path : Path or None
        File of the map.
    version : FileVersion or None
        Version of the file that was read or written last.
    stem : str
        Suggested file name, without suffix.
    file_state : {"same", "changed", "gone"}
        State of the file at the last check.
    autosaver : Autosaver
        Writes the draft.
    """

    def __init__(
        self,
        sketch: Sketch,
        draft_folder: Path | None,
        path: Path | None = None,
        version: FileVersion | None = None,
        *,
        resumed: Path | None = None,
        is_saved: bool = True,
        stem: str = "",
    ) -> None:
        self.history = UndoHistory(sketch, is_saved=is_saved)
        self.path = path
        self.version = version
        self.stem = stem
        self.file_state: FileState = "same"
        self.autosaver = autosave.Autosaver(draft_folder, KIND, path, resumed)
        self._checked_at = 0.0
        self._overwrites_changed_file = False
        self._drafted: Sketch | None = None
        if is_saved:
            self._drafted = sketch
        self.update_draft()

    @classmethod
    def new(cls, draft_folder: Path | None, path: Path | None = None) -> Self:
        """Create a map that contains only the default boundary; its file need not exist yet."""
        return cls(Sketch(boundary=DEFAULT_BOUNDARY), draft_folder, path)

    @classmethod
    def open_file(cls, path: Path, draft_folder: Path | None) -> Self:
        """Open a map file. A bundled map is opened as a copy without a file."""
        sketch, version = read_sketch(path)
        if is_bundled(path):
            return cls(sketch, draft_folder, stem=path.stem)
        return cls(sketch, draft_folder, path.resolve(), version)

    @classmethod
    def recover(cls, draft: MapDraft, draft_folder: Path | None) -> Self:
        """Open the map of a draft, and continue to use the draft."""
        sketch = draft.read_sketch()
        return cls(sketch, draft_folder, draft.path, draft.version, resumed=draft.folder, is_saved=False)

    @property
    def title(self) -> str:
        """Name of the file or, if there is none, the suggested name or the name of the map."""
        if self.path is not None:
            return self.path.name
        return self.stem or self.history.sketch.name

    def get_folder(self, default: Path) -> Path:
        """Return the folder of the map's file, or a default folder if it has no file."""
        if self.path is None:
            return default
        return self.path.parent

    def suggest_path(self, folder: Path) -> Path:
        """Return the path of the map or, if it has none, an unused path in a folder, named after the map."""
        if self.path is not None:
            return self.path
        name = self.stem or "-".join(self.history.sketch.name.lower().split())
        stem = "".join(character for character in name if character.isalnum() or character in "-_.")
        stem = stem or _DEFAULT_STEM
        path = folder / f"{stem}{SUFFIX}"
        for number in count(1):
            if not path.exists():
                break
            path = folder / f"{stem}-{number}{SUFFIX}"
        return path

    def would_replace_valid_map(self, path: Path) -> bool:
        """Return whether saving to a path would replace a valid map by one that breaks the rules of maps."""
        with suppress(MapError):
            load_map(add_suffix(path))
            try:
                self.history.sketch.build_environment()
            except MapError:
                return True
        return False

    def save(self, path: Path, *, overwrites: bool = False) -> str:
        """Save the map to a file. A map without a name is named after the file.

        Parameters
        ----------
        path : Path
            Path of the file. A missing suffix is added.
        overwrites : bool
            Whether to replace a file that another program has changed, or that exists at a new path.

        Returns
        -------
        str
            Message for the user.

        Raises
        ------
        FileChangedError
            If another program has changed the file, or the path is new but a file exists there.
        MapError
            If the file is a bundled map.
        OutputError
            If the file cannot be written.
        """
        path = add_suffix(path)
        if is_bundled(path):
            raise MapError(f"{path.name}: expected another name, because this map comes with robocov")
        sketch = self.history.sketch.with_default_name(path.stem)
        expected = None
        if path == self.path:
            expected = self.version
            overwrites = overwrites or self._overwrites_changed_file
        self.version = write_sketch(sketch, path, expected=expected, overwrites=overwrites)
        if sketch is not self.history.sketch:
            self.history.rewrite_all(lambda state: state.with_default_name(path.stem))
        self.path = path
        self._mark_as_saved()
        return f"saved: {path}"

    def update_draft(self) -> None:
        """Save a draft if there are unsaved changes, or remove their draft if there are none."""
        previous = self._drafted
        self._drafted = self.history.sketch
        if self._drafted is previous:
            return
        if self.history.has_unsaved_changes:
            self.save_draft(self._drafted)
        else:
            self.autosaver.mark_saved(self.path)

    def save_draft(self, sketch: Sketch) -> None:
        """Save a draft of a sketch, which need not be in the history yet."""
        self._drafted = sketch
        self.autosaver.save_draft(partial(build_draft_content, sketch, self.version))

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait at most `timeout` seconds until the draft is written; return whether it is."""
        return self.autosaver.flush(timeout)

    def close(self, *, discard: bool) -> None:
        """Close the draft.

        Parameters
        ----------
        discard : bool
            Whether the draft is removed; otherwise the next start offers it.
        """
        self.autosaver.close(discard=discard)

    def check_disk(self, now: float) -> FileState:
        """Check whether another program has changed the file, and update `file_state`.

        Parameters
        ----------
        now : float, s
            Time on any clock. The file is checked at most once per second.

        Returns
        -------
        {"same", "changed", "gone"}
            A change is reported only once; after that, "same".
        """
        if self.version is None or now - self._checked_at < _CHECK_INTERVAL_S:
            return "same"
        self._checked_at = now
        previous = self.file_state
        self.file_state = check_file(self.version)
        if self.file_state in ("same", previous):
            return "same"
        # The file no longer contains any state of the history.
        self.history.saved_sketch = None
        return self.file_state

    def reload(self) -> None:
        """Read the file again, as a change that can be undone."""
        assert self.path is not None
        sketch, self.version = read_sketch(self.path)
        self.history.apply(Change(sketch, Selection(), "reloaded from the file"))
        self._mark_as_saved()

    def ignore_disk_change(self) -> None:
        """Allow the next save to replace the file even though another program has changed it."""
        self._overwrites_changed_file = True

    def _mark_as_saved(self) -> None:
        self.file_state = "same"
        self._overwrites_changed_file = False
        self.history.mark_saved()
        self._drafted = self.history.sketch
        self.autosaver.mark_saved(self.path)
