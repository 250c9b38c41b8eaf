"""The map that is open: its history, its file, and the copy that is kept aside."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from robocov.errors import MapError
from robocov.mapfile import bundled_maps, load_map
from robocov_app.editor.model import file
from robocov_app.editor.model.autosave import KIND, Autosave, content
from robocov_app.editor.model.file import OnDisk, State
from robocov_app.editor.model.history import History
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.toolkit.autosave import Autosaver

FIRST_SHEET = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))  # the boundary of a new map, m
SUFFIX = ".json"

_LOOKED_AGAIN = 1.0  # seconds between two looks at the file


class Document:
    """A sketch with its history, its file, and the autosave that survives whatever happens.

    Kept aside below `drafts` (None: nowhere) or in the `resumed` folder; `stem` names what has no `path` yet.
    """

    def __init__(
        self,
        sketch: Sketch,
        drafts: Path | None,
        path: Path | None = None,
        disk: OnDisk | None = None,
        *,
        resumed: Path | None = None,
        saved: bool = True,
        stem: str = "",
    ) -> None:
        self.history = History(sketch, saved=saved)
        self.path, self.disk, self.stem = path, disk, stem
        self.state: State = "same"
        self._autosaver = Autosaver(drafts, KIND, path, resumed)
        self._kept: Sketch | None = sketch if saved else None
        self._looked = 0.0
        self._over = False
        self.keep()

    @classmethod
    def new(cls, drafts: Path | None, path: Path | None = None) -> Document:
        """Return an empty map with the boundary that is offered; `path` is not there yet."""
        return cls(Sketch(boundary=FIRST_SHEET), drafts, path)

    @classmethod
    def opened(cls, path: Path, drafts: Path | None) -> Document:
        """Return the map in a file; one that comes with robocov as a copy, which has no file yet."""
        sketch, disk = file.opened(path)
        if is_bundled(path):
            return cls(sketch, drafts, stem=path.stem)
        return cls(sketch, drafts, path.resolve(), disk)

    @classmethod
    def recovered(cls, autosave: Autosave, drafts: Path | None) -> Document:
        """Return work that was left behind, unsaved still."""
        sketch = autosave.sketch()
        return cls(sketch, drafts, autosave.path, autosave.disk, resumed=autosave.folder, saved=False)

    @property
    def unsaved(self) -> bool:
        """Whether something would be lost."""
        return self.history.unsaved

    @property
    def title(self) -> str:
        """Its file's name, or else its own."""
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

    def spoils(self, path: Path) -> bool:
        """Return whether saving there would replace a valid map by one that cannot run."""
        try:
            load_map(_with_suffix(path))
        except MapError:
            return False
        try:
            self.history.sketch.environment()
        except MapError:
            return True
        return False

    def save(self, path: Path, *, over: bool = False) -> str:
        """Write the file, which names an unnamed map; ChangedError, unless `over`, if it has changed."""
        path = _with_suffix(path)
        if is_bundled(path):
            raise MapError(f"{path.name} comes with robocov and stays as it is: another name was wanted")
        named = self.history.sketch.named(path.stem)
        before = self.disk if path == self.path else None
        self.disk = file.saved(named, path, before, over=over or (self._over and path == self.path))
        if named is not self.history.sketch:
            self.history.replace_all(lambda sketch: sketch.named(path.stem))
        self.path, self.state, self._over = path, "same", False
        self._settle()
        return f"saved: {path}"

    def keep(self) -> None:
        """Keep aside what is not saved, if it is not what was kept last."""
        sketch = self.history.sketch
        if self._kept is sketch:
            return
        self._kept = sketch
        if self.unsaved:
            self._autosaver.keep(partial(content, sketch, self.disk))
        else:
            self._autosaver.settle(self.path)

    @property
    def trouble(self) -> str:
        """Why nothing is kept aside, in words; empty if it is."""
        return self._autosaver.trouble

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
        """Take the document as its file is now; that is an edit, which can be undone."""
        assert self.path is not None
        sketch, self.disk = file.opened(self.path)
        self.state, self._over = "same", False
        self.history.do(Change(sketch, Selection(), "read again from the file"))
        self._settle()

    def keep_mine(self) -> None:
        """Take no notice of what is on the disk: saving replaces it."""
        self._over = True

    def flush(self) -> None:
        """Wait until the autosave is on the disk."""
        self._autosaver.flush()

    def close(self, *, discard: bool) -> None:
        """End; discard what was kept aside, or leave it to be offered at the next start."""
        self._autosaver.close(discard=discard)

    def _settle(self) -> None:
        self.history.mark_saved()
        self._kept = self.history.sketch
        self._autosaver.settle(self.path)


def is_bundled(path: Path) -> bool:
    """Return whether a file is one of the maps that come with robocov; what cannot be a file is none."""
    try:
        return path.resolve() in {each.resolve() for each in bundled_maps().values()}
    except (OSError, ValueError, RuntimeError):
        return False


def _with_suffix(path: Path) -> Path:
    return path if path.suffix.lower() == SUFFIX else path.with_name(path.name + SUFFIX)
