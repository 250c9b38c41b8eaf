"""The document that is open: its history, its file, and the copy that is kept aside. Knows no pygame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from robocov.errors import MapError
from robocov.mapfile import bundled_maps
from robocov_app.editor.edits.properties import titled
from robocov_app.editor.model import file
from robocov_app.editor.model.autosave import Autosave, Autosaver
from robocov_app.editor.model.file import OnDisk, State
from robocov_app.editor.model.history import History
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch

FIRST_SHEET = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
"""The boundary of a new map, m."""

SUFFIX = ".json"

_LOOKED_AGAIN = 1.0
"""Seconds between two looks at the file."""


class Document:
    """A sketch with its history, its file, and the draft that survives whatever happens.

    Parameters
    ----------
    sketch : Sketch
    drafts : Path or None
        Where drafts are kept; None for nowhere.
    path : Path or None
        Its file; None if it never had one.
    disk : OnDisk or None
        What the file was like.
    draft : Autosave or None
        The work that goes on.
    saved : bool
        Whether losing it would lose nothing.
    stem : str
        What a file of it would be called.
    """

    def __init__(
        self,
        sketch: Sketch,
        drafts: Path | None,
        path: Path | None = None,
        disk: OnDisk | None = None,
        *,
        draft: Autosave | None = None,
        saved: bool = True,
        stem: str = "",
    ) -> None:
        self.history = History(sketch, saved=saved)
        self.path, self.disk, self.stem = path, disk, stem
        self.state: State = "same"
        self._keeper = Autosaver(drafts, path, disk, draft)
        self._kept: Sketch | None = sketch if saved else None
        self._looked = 0.0
        self._over = False
        self.keep()

    @classmethod
    def new(cls, drafts: Path | None, path: Path | None = None) -> Document:
        """Return an empty sheet with the boundary that is offered; `path` is not there yet."""
        return cls(Sketch(boundary=FIRST_SHEET), drafts, path)

    @classmethod
    def opened(cls, path: Path, drafts: Path | None) -> Document:
        """Return the map in a file; one that comes with robocov as a copy, which has no file yet.

        Raises
        ------
        MapError
            When it cannot be read.
        """
        sketch, disk = file.opened(path)
        if is_bundled(path):
            return cls(sketch, drafts, stem=path.stem)
        return cls(sketch, drafts, path.resolve(), disk)

    @classmethod
    def recovered(cls, draft: Autosave, drafts: Path | None) -> Document:
        """Return work that was left behind, unsaved still.

        Raises
        ------
        MapError
            When it cannot be read.
        """
        return cls(draft.sketch(), drafts, draft.path, draft.disk, draft=draft, saved=False)

    @property
    def unsaved(self) -> bool:
        """Whether something would be lost."""
        return self.history.unsaved

    @property
    def title(self) -> str:
        """What the document is called: by its file, or else by its name."""
        return self.path.name if self.path is not None else self.stem or self.history.sketch.name

    def suggested(self, folder: Path) -> Path:
        """Return where it would be saved."""
        if self.path is not None:
            return self.path
        stem = self.stem or "-".join(self.history.sketch.name.lower().split()) or "map"
        stem = "".join(char for char in stem if char.isalnum() or char in "-_.") or "map"
        target, k = folder / f"{stem}{SUFFIX}", 1
        while target.exists():
            target, k = folder / f"{stem}-{k}{SUFFIX}", k + 1
        return target

    def save(self, path: Path, *, over: bool = False) -> str:
        """Write the file; return what to tell.

        Raises
        ------
        ChangedError
            When something else has changed the file since, or another file would be lost, unless `over`.
        OutputError
            When it cannot be written.
        """
        path = path if path.suffix.lower() == SUFFIX else path.with_name(path.name + SUFFIX)
        if is_bundled(path):
            raise MapError(f"{path.name} comes with robocov and stays as it is: another name was wanted")
        sketch, named = self.history.sketch, None
        if sketch.name == Sketch.name:  # nobody has named it: the file does
            named = replace(titled(sketch, path.stem), selection=self.history.selection)
            sketch = named.sketch
        before = self.disk if path == self.path else None
        self.disk = file.saved(sketch, path, before, over=over or (self._over and path == self.path))
        if named is not None:
            self.history.do(named)
        self.path, self.state, self._over = path, "same", False
        self.history.mark_saved()
        self._kept = sketch
        self._keeper.settle(path, self.disk)
        return f"saved: {path}"

    def keep(self) -> None:
        """Keep aside what is not saved, if it is not what was kept last."""
        sketch = self.history.sketch
        if not self.unsaved:
            if self._kept is not sketch:
                self._kept = sketch
                self._keeper.settle(self.path, self.disk)
        elif self._kept is not sketch:
            self._kept = sketch
            self._keeper.keep(sketch)

    @property
    def trouble(self) -> str:
        """What keeps it from keeping a draft, in words."""
        return self._keeper.trouble

    def look(self, now: float) -> State:
        """Return whether the file has changed on the disk, news only once; `now` is any clock, s."""
        if self.disk is None or now - self._looked < _LOOKED_AGAIN:
            return "same"
        self._looked = now
        state = file.state_of(self.disk)
        news, self.state = state != self.state, state
        if news and state != "same":
            self.history.mark_unsaved()
            return state
        return "same"

    def reload(self) -> None:
        """Take the document as its file is now; that is an edit, which can be undone.

        Raises
        ------
        MapError
            When it cannot be read.
        """
        assert self.path is not None
        sketch, self.disk = file.opened(self.path)
        self.state, self._over = "same", False
        self.history.do(Change(sketch, Selection(), "read again from the file"))
        self.history.mark_saved()
        self._kept = sketch
        self._keeper.settle(self.path, self.disk)

    def keep_mine(self) -> None:
        """Take no notice of what is on the disk: saving replaces it."""
        self._over = True

    def flush(self) -> None:
        """Wait until the draft is on the disk."""
        self._keeper.flush()

    def close(self, *, discard: bool) -> None:
        """End; discard what was kept aside, or leave it to be offered at the next start."""
        self._keeper.close(discard=discard)


def is_bundled(path: Path) -> bool:
    """Return whether a file is one of the maps that come with robocov; what cannot be a file is none."""
    try:
        return path.resolve() in {each.resolve() for each in bundled_maps().values()}
    except (OSError, ValueError, RuntimeError):
        return False
