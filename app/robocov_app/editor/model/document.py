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
    """A map with its history and file. Unsaved changes are kept in a draft.

    Parameters
    ----------
    sketch : Sketch
    drafts : Path or None
        Folder for the draft; None to keep none.
    path : Path, optional
        File of the map.
    version : FileVersion, optional
        Version of the file that was read.
    resumed : Path, optional
        Folder of an earlier draft, which is continued.
    saved : bool
        Whether the file has this content.
    stem : str
        Suggested name for a map without a file.

    Attributes
    ----------
    history : UndoHistory
    path : Path or None
    version : FileVersion or None
    stem : str
    file_state : {"same", "changed", "gone"}
        State of the file at the last check.
    autosaver : Autosaver
    """

    def __init__(
        self,
        sketch: Sketch,
        drafts: Path | None,
        path: Path | None = None,
        version: FileVersion | None = None,
        *,
        resumed: Path | None = None,
        saved: bool = True,
        stem: str = "",
    ) -> None:
        self.history = UndoHistory(sketch, saved=saved)
        self.path = path
        self.version = version
        self.stem = stem
        self.file_state: FileState = "same"
        self.autosaver = autosave.Autosaver(drafts, KIND, path, resumed)
        self._checked_at = 0.0
        self._overwrites_changed_file = False
        self._drafted: Sketch | None = None
        if saved:
            self._drafted = sketch
        self.update_draft()

    @classmethod
    def new(cls, drafts: Path | None, path: Path | None = None) -> Self:
        """Create an empty map with the default boundary; its file need not exist."""
        return cls(Sketch(boundary=DEFAULT_BOUNDARY), drafts, path)

    @classmethod
    def open_file(cls, path: Path, drafts: Path | None) -> Self:
        """Open a file; a bundled map is opened as a copy without a file."""
        sketch, version = read_sketch(path)
        if is_bundled(path):
            return cls(sketch, drafts, stem=path.stem)
        return cls(sketch, drafts, path.resolve(), version)

    @classmethod
    def recover(cls, draft: MapDraft, drafts: Path | None) -> Self:
        """Open a draft."""
        sketch = draft.read_sketch()
        return cls(sketch, drafts, draft.path, draft.version, resumed=draft.folder, saved=False)

    @property
    def title(self) -> str:
        """Name of the file, or of the map."""
        if self.path is not None:
            return self.path.name
        return self.stem or self.history.sketch.name

    def get_folder(self, default: Path) -> Path:
        """Return the folder of the map's file, or a default one if it has no file."""
        if self.path is None:
            return default
        return self.path.parent

    def suggest_path(self, folder: Path) -> Path:
        """Return the path of the map, or a free one in a folder."""
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
        """Return whether saving would replace a valid map with one that breaks rules."""
        with suppress(MapError):
            load_map(add_suffix(path))
            try:
                self.history.sketch.build_environment()
            except MapError:
                return True
        return False

    def save(self, path: Path, *, overwrites: bool = False) -> str:
        """Save the map to a file, whose name also becomes that of an unnamed map.

        Parameters
        ----------
        path : Path
            The suffix is added if it is missing.
        overwrites : bool
            Whether a file that another program has changed is replaced.

        Returns
        -------
        str
            A message.

        Raises
        ------
        FileChangedError
            If the file has changed, or another one exists.
        MapError
            If the file is a bundled map.
        OutputError
            If it cannot be written.
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
        """Save a draft of unsaved changes, or remove it if there are none."""
        previous = self._drafted
        self._drafted = self.history.sketch
        if self._drafted is previous:
            return
        if self.history.has_unsaved_changes:
            self.save_draft(self._drafted)
        else:
            self.autosaver.mark_saved(self.path)

    def save_draft(self, sketch: Sketch) -> None:
        """Save a draft of a sketch that may not be a part of the history yet."""
        self._drafted = sketch
        self.autosaver.save_draft(partial(build_draft_content, sketch, self.version))

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until the draft is written, or for `timeout` seconds; return whether it is."""
        return self.autosaver.flush(timeout)

    def close(self, *, discard: bool) -> None:
        """Close the draft.

        Parameters
        ----------
        discard : bool
            Whether it is removed.
        """
        self.autosaver.close(discard=discard)

    def check_disk(self, now: float) -> FileState:
        """Check whether another program has changed the file.

        Parameters
        ----------
        now : float, s
            Time on any clock; the file is checked once a second.

        Returns
        -------
        {"same", "changed", "gone"}
            "same" also if the change was reported before.
        """
        if self.version is None or now - self._checked_at < _CHECK_INTERVAL_S:
            return "same"
        self._checked_at = now
        previous = self.file_state
        self.file_state = check_file(self.version)
        if self.file_state in ("same", previous):
            return "same"
        self.history.saved = None
        return self.file_state

    def reload(self) -> None:
        """Read the file again, as an edit that can be undone."""
        assert self.path is not None
        sketch, self.version = read_sketch(self.path)
        self.history.apply(Change(sketch, Selection(), "read again from the file"))
        self._mark_as_saved()

    def ignore_disk_change(self) -> None:
        """Let the next save replace the file although it has changed."""
        self._overwrites_changed_file = True

    def _mark_as_saved(self) -> None:
        self.file_state = "same"
        self._overwrites_changed_file = False
        self.history.mark_saved()
        self._drafted = self.history.sketch
        self.autosaver.mark_saved(self.path)
