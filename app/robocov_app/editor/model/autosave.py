"""Maps in the making that are kept aside, see `robocov_app.toolkit.autosave`, and offered after a crash."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from robocov.errors import MapError, counted, one_line
from robocov.files.strictjson import read_bytes
from robocov_app.editor.model.file import OnDisk
from robocov_app.editor.model.parser import sketch_of
from robocov_app.editor.model.sketch import Sketch, draft_document, sketch_text
from robocov_app.toolkit import autosave

KIND = "robocov-draft"


@dataclass(frozen=True)
class Autosave:
    """A map that an editor left behind."""

    folder: Path  # where it lies
    path: Path | None  # the file that it belongs to; None if it never had one
    name: str  # the map's name
    when: datetime  # when it was kept, in local time
    obstacles: int
    disk: OnDisk | None  # what the file was like when it was read or written last

    def sketch(self) -> Sketch:
        """Return the map; MapError when it cannot be read any more."""
        return sketch_of(autosave.read_record(self.folder, KIND).content.get("sketch"), str(self.folder))

    def words(self, now: datetime | None = None) -> str:
        """Return what to offer: "“Office”, 12 obstacles, today 14:03, not saved to office.json"."""
        now = now or datetime.now().astimezone()
        days = (now.date() - self.when.date()).days
        day = {0: "today", 1: "yesterday"}.get(days, f"{self.when:%Y-%m-%d}")
        where = "never saved" if self.path is None else f"not saved to {self.path.name}"
        what = f"“{one_line(self.name)}”, {counted(self.obstacles, 'obstacle')}"
        return f"{what}, {day} {self.when:%H:%M}, {where}"


def content(sketch: Sketch, disk: OnDisk | None) -> dict[str, Any]:
    """Return what is kept of a map."""
    file = disk and {"digest": disk.digest, "stamp": list(disk.stamp)}
    return {"disk": file, "sketch": draft_document(sketch)}


def recoverable(folder: Path | None) -> tuple[Autosave, ...]:
    """Return the maps that editors left behind which live no more, the newest first."""
    return autosave.recoverable(folder, KIND, _autosave)


def opened_elsewhere(folder: Path | None, path: Path) -> bool:
    """Return whether another editor has this file open."""
    return autosave.opened_elsewhere(folder, KIND, path)


def _autosave(record: autosave.Record) -> Autosave | None:
    """Return the map of a record; None if there is none, or its file holds it already."""
    kept, path, disk = record.content.get("sketch"), record.path, record.content.get("disk")
    if kept is None:
        return None
    sketch = sketch_of(kept, str(record.folder))
    if path is not None and _holds(path, sketch):
        return None
    try:
        size, changed = disk["stamp"] if disk is not None else (0, 0)
        known = OnDisk(path, str(disk["digest"]), (int(size), int(changed))) if disk and path else None
    except (TypeError, ValueError, KeyError) as error:
        raise MapError(f"{record.folder}: is no whole {KIND}: {error}") from None
    return Autosave(record.folder, path, sketch.name, record.when, len(sketch.obstacles), known)


def _holds(path: Path, sketch: Sketch) -> bool:
    try:
        return read_bytes(path) == sketch_text(sketch).encode()
    except MapError:
        return False
