"""The map that is open: its history, its file, and the copy that is kept aside."""

import stat
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from hashlib import sha256
from itertools import chain, count
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

from robocov.errors import MapError, OutputError, format_count, to_one_line
from robocov.files.strictjson import read_bytes
from robocov.files.writing import replace_file, resolve_target
from robocov.mapfile import list_bundled_maps, load_map
from robocov_app.editor.model.parser import build_sketch, parse_sketch
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, dump_sketch, to_document
from robocov_app.storage import autosave


@dataclass
class _Step:
    before: Change  # with the words of `after`, as undoing says them
    after: Change
    drag: Hashable | None


class History:
    """A sketch as it is now, and all that it was; a window that selects something sets `selection`."""

    def __init__(self, sketch: Sketch, *, saved: bool = True) -> None:
        self.sketch = sketch
        self.selection = Selection()
        self._done: list[_Step] = []
        self._undone: list[_Step] = []
        self.saved = sketch if saved else None  # what the file holds; None where that is none of it
        self.starts_new_step = False  # whether the next change stands alone, as after the mouse was released

    def apply(self, change: Change, *, drag: Hashable | None = None) -> bool:
        """Take a change, merged with the last of the same `drag`; return whether it changed anything."""
        before, done = Change(self.sketch, self.selection, change.description), self._done
        merges = drag is not None and not self.starts_new_step and bool(done) and done[-1].drag == drag
        self.starts_new_step, self.selection = False, change.selection
        if change.sketch == self.sketch:
            return False
        if merges:
            before = replace(done.pop().before, description=change.description)
        self.sketch, self._undone = change.sketch, []
        if change.sketch != before.sketch:
            done.append(_Step(before, change, drag))
        return True

    def undo(self) -> Change | None:
        """Take the newest change back; return what was there before, in the words of what was taken back."""
        if not self._done:
            return None
        self._undone.append(self._done.pop())
        return self._go_to(self._undone[-1].before)

    def redo(self) -> Change | None:
        """Redo the change that was undone last; return the state that it leads to."""
        if not self._undone:
            return None
        self._done.append(self._undone.pop())
        return self._go_to(self._done[-1].after)

    def _go_to(self, state: Change) -> Change:
        self.sketch, self.selection = state.sketch, state.selection
        self.starts_new_step = True
        return state

    def rewrite_all(self, change: Callable[[Sketch], Sketch]) -> None:
        """Change the sketch as it is and at every step, without a step of its own."""
        steps = [*self._done, *self._undone]
        sketches = [self.sketch, *(state.sketch for step in steps for state in (step.before, step.after))]
        # the same sketch stays the same in all steps
        new = {id(sketch): change(sketch) for sketch in sketches}
        for step in steps:
            step.before = replace(step.before, sketch=new[id(step.before.sketch)])
            step.after = replace(step.after, sketch=new[id(step.after.sketch)])
        self.sketch = new[id(self.sketch)]

    @property
    def undo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be undone, the newest first."""
        return tuple(step.after.description for step in reversed(self._done))

    @property
    def redo_descriptions(self) -> tuple[str, ...]:
        """Descriptions of the changes that can be redone, the next first."""
        return tuple(step.after.description for step in reversed(self._undone))

    def save_point(self) -> Callable[[], None]:
        """Return a function that takes everything back to the present state."""
        state = dict(vars(self))
        done, undone = [*self._done], [*self._undone]

        def take_back() -> None:
            vars(self).update(state)
            self._done, self._undone = done, undone

        return take_back

    def mark_saved(self) -> None:
        """Remember that the file has the present content."""
        self.saved = self.sketch
        self.starts_new_step = True

    @property
    def has_unsaved_changes(self) -> bool:
        """Whether something would be lost; undoing back to what was saved makes it false again."""
        return self.saved is not self.sketch and self.saved != self.sketch


KIND = "robocov-draft"


@dataclass(frozen=True)
class OnDisk:
    """A file as it was when it was read or written."""

    path: Path  # absolute
    digest: str  # SHA-256 of its content
    stamp: tuple[int, int]  # (size, time of change in ns); what can be asked of the file quickly


@dataclass(frozen=True)
class Autosave:
    """A map that an editor left behind."""

    folder: Path  # where it lies
    path: Path | None  # the file that it belongs to; None if it never had one
    name: str  # the map's name
    when: datetime  # when it was kept, in local time
    obstacles: int
    disk: OnDisk | None  # what the file was like when it was read or written last

    def read_sketch(self) -> Sketch:
        """Return the map."""
        return build_sketch(autosave.read_draft(self.folder, KIND).content.get("sketch"), str(self.folder))

    def describe(self, now: datetime | None = None) -> str:
        """Return what to offer: "“Office”, 12 obstacles, today 14:03, not saved to office.json"."""
        now = now or datetime.now().astimezone()
        day = {0: "today", 1: "yesterday"}.get((now.date() - self.when.date()).days, f"{self.when:%Y-%m-%d}")
        where = "never saved" if self.path is None else f"not saved to {self.path.name}"
        what = f"“{to_one_line(self.name)}”, {format_count(self.obstacles, 'obstacle')}"
        return f"{what}, {day} {self.when:%H:%M}, {where}"


def build_record(sketch: Sketch, disk: OnDisk | None) -> dict[str, Any]:
    """Return the content of a draft."""
    file = disk and {"digest": disk.digest, "stamp": list(disk.stamp)}
    return {"disk": file, "sketch": to_document(sketch)}


def _autosave(record: autosave.Draft) -> Autosave | None:
    """Return the map of a record; None if there is none, or its file holds it already."""
    kept, path, disk = record.content.get("sketch"), record.path, record.content.get("disk")
    if kept is None:
        return None
    sketch = build_sketch(kept, str(record.folder))
    with suppress(MapError):
        if path is not None and read_bytes(path) == dump_sketch(sketch).encode():
            return None
    known = None
    try:
        if disk is not None and path is not None:
            size, changed = map(int, disk["stamp"])
            known = OnDisk(path, str(disk["digest"]), (size, changed))
    except (TypeError, ValueError, KeyError) as error:
        raise MapError(f"{record.folder}: is no whole {KIND}: {error}") from None
    return Autosave(record.folder, path, sketch.name, record.when, len(sketch.obstacles), known)


find_recoverable = partial(autosave.find_drafts, kind=KIND, read=_autosave)
is_open_elsewhere = partial(autosave.is_open_elsewhere, kind=KIND)  # asked by `path=`
FileState: TypeAlias = Literal["same", "changed", "gone"]


class ChangedError(OutputError):
    """A file is not as it was when it was read or written last, or there is one that was not known of."""


def read_sketch(path: Path) -> tuple[Sketch, OnDisk]:
    """Read a map; return it with the state of its file."""
    path = path.absolute()
    stamp = _stamp(path)  # the stamp of before: what changes while it is read is noticed at the next look
    content = read_bytes(path)
    disk = OnDisk(path, sha256(content).hexdigest(), stamp or (-1, 0))
    return parse_sketch(content, str(path), path.parent), disk


def write_sketch(sketch: Sketch, path: Path, before: OnDisk | None = None, *, over: bool = False) -> OnDisk:
    """Write a file whole or not at all; ChangedError, unless `over`, when it is not as it was `before`."""
    path, text = path.absolute(), dump_sketch(sketch).encode()
    resolve_target(path)
    ours = before if before is not None and before.path == path else None
    if not over and ours is None and _stamp(path) is not None:
        raise ChangedError(f"{to_one_line(path)}: there is such a file already")
    if not over and ours is not None and check_file(ours) == "changed":
        what = "has been changed by something else since it was opened or saved here"
        raise ChangedError(f"{to_one_line(path)}: {what}")
    with replace_file(path) as part:
        part.write_bytes(text)
    return OnDisk(path, sha256(text).hexdigest(), _stamp(path) or (-1, 0))


def check_file(before: OnDisk) -> FileState:
    """Return whether a file is still as it was, quickly; one that was merely touched is the same."""
    stamp = _stamp(before.path)
    if stamp in (None, before.stamp):
        return "same" if stamp else "gone"
    try:
        content = read_bytes(before.path)
    except MapError:
        return "changed" if _stamp(before.path) else "gone"
    return "same" if sha256(content).hexdigest() == before.digest else "changed"


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return size and time of change, in ns, of a file; None if there is none, or it is not a regular one."""
    with suppress(OSError, ValueError):
        status = path.stat()
        if stat.S_ISREG(status.st_mode):
            return status.st_size, status.st_mtime_ns
    return None


DEFAULT_BOUNDARY = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))  # the boundary of a new map, m
SUFFIX = ".json"
_LOOKED_AGAIN = 1.0  # seconds between two looks at the file


class Document:
    """A sketch with its history and file, kept aside below `drafts` or in the `resumed` folder."""

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
        self.path, self.disk, self.stem = path, disk, stem  # stem: of a map without a file
        self.file_state: FileState = "same"
        self._looked, self._over = 0.0, False
        self.autosaver = autosave.Autosaver(drafts, KIND, path, resumed)
        self.flush, self.close = self.autosaver.flush, self.autosaver.close
        self._kept: Sketch | None = sketch if saved else None
        self.keep_aside()

    @classmethod
    def new(cls, drafts: Path | None, path: Path | None = None) -> Self:
        """Return an empty map with the boundary that is offered; `path` is not there yet."""
        return cls(Sketch(boundary=DEFAULT_BOUNDARY), drafts, path)

    @classmethod
    def open_file(cls, path: Path, drafts: Path | None) -> Self:
        """Return the map in a file; one that comes with robocov as a copy, which has no file yet."""
        sketch, disk = read_sketch(path)
        if is_bundled(path):
            return cls(sketch, drafts, stem=path.stem)
        return cls(sketch, drafts, path.resolve(), disk)

    @classmethod
    def recover(cls, kept: Autosave, drafts: Path | None) -> Self:
        """Return the document of a draft."""
        return cls(kept.read_sketch(), drafts, kept.path, kept.disk, resumed=kept.folder, saved=False)

    @property
    def title(self) -> str:
        """Name of the file, or of the map."""
        return self.path.name if self.path is not None else self.stem or self.history.sketch.name

    def suggest_path(self, folder: Path) -> Path:
        """Return a free path for the map in a folder."""
        if self.path is not None:
            return self.path
        stem = self.stem or "-".join(self.history.sketch.name.lower().split()) or "map"
        stem = "".join(char for char in stem if char.isalnum() or char in "-_.") or "map"
        names = chain([stem], (f"{stem}-{k}" for k in count(1)))
        return next(path for name in names if not (path := folder / f"{name}{SUFFIX}").exists())

    def would_spoil(self, path: Path) -> bool:
        """Return whether saving would replace a valid map with a draft."""
        with suppress(MapError):
            load_map(_with_suffix(path))
            try:
                self.history.sketch.build_environment()
            except MapError:
                return True
        return False

    def save(self, path: Path, *, over: bool = False) -> str:
        """Write the file, which names an unnamed map; ChangedError, unless `over`, if it has changed."""
        path = _with_suffix(path)
        if is_bundled(path):
            raise MapError(f"{path.name} comes with robocov and stays as it is: expected another name")
        named = self.history.sketch.with_default_name(path.stem)
        before = self.disk if path == self.path else None
        self.disk = write_sketch(named, path, before, over=over or (self._over and path == self.path))
        if named is not self.history.sketch:
            self.history.rewrite_all(lambda sketch: sketch.with_default_name(path.stem))
        self.path = path
        self._settle()
        return f"saved: {path}"

    def keep_aside(self) -> None:
        """Keep a draft of unsaved changes, or drop it when there are none."""
        before, self._kept = self._kept, self.history.sketch
        if before is not self._kept and self.history.has_unsaved_changes:
            self.autosaver.save_draft(partial(build_record, self._kept, self.disk))
        elif before is not self._kept:
            self.autosaver.mark_saved(self.path)

    def keep_draft(self, sketch: Sketch) -> None:
        """Keep a draft of a sketch that is no part of the history yet, until the next `keep`."""
        self._kept = sketch
        self.autosaver.save_draft(partial(build_record, sketch, self.disk))

    def check_disk(self, now: float) -> FileState:
        """Return whether the file has changed on the disk, news only once; `now` is any clock, s."""
        if self.disk is None or now - self._looked < _LOOKED_AGAIN:
            return "same"
        self._looked = now
        before, self.file_state = self.file_state, check_file(self.disk)
        if self.file_state in ("same", before):
            return "same"
        self.history.saved = None
        return self.file_state

    def reload(self) -> None:
        """Take the document as its file is now; that is an edit, which can be undone."""
        assert self.path is not None
        sketch, self.disk = read_sketch(self.path)
        self.history.apply(Change(sketch, Selection(), "read again from the file"))
        self._settle()

    def ignore_disk_change(self) -> None:
        """Let the next save replace the file although it has changed."""
        self._over = True

    def _settle(self) -> None:
        self.file_state, self._over = "same", False
        self.history.mark_saved()
        self._kept = self.history.sketch
        self.autosaver.mark_saved(self.path)


def is_bundled(path: Path) -> bool:
    """Return whether a file is one of the maps that come with robocov; what cannot be a file is none."""
    with suppress(OSError, ValueError, RuntimeError):
        return path.resolve() in {each.resolve() for each in list_bundled_maps().values()}
    return False


def _with_suffix(path: Path) -> Path:
    return path if path.suffix.lower() == SUFFIX else path.with_name(path.name + SUFFIX)
