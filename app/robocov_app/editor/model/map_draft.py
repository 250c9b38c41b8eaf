"""Drafts of unsaved maps, which can be recovered after the editor has ended unexpectedly."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from robocov.errors import MapError, format_count, to_one_line
from robocov.files.strictjson import read_bytes
from robocov_app.editor.model.map_file import FileVersion
from robocov_app.editor.model.parser import build_sketch
from robocov_app.editor.model.sketch import Sketch, dump_sketch, to_document
from robocov_app.storage import autosave

KIND = "robocov-draft"
"""Kind of the drafts of maps; see `robocov_app.storage.autosave`."""


@dataclass(frozen=True)
class MapDraft:
    """A draft of a map.

    Attributes
    ----------
    folder : Path
        Folder of the draft.
    path : Path or None
        File of the map; None if it was never saved.
    name : str
        Name of the map.
    when : datetime
        Local time at which the draft was written.
    obstacles : int
        Number of obstacles.
    version : FileVersion or None
        Version of the file that the editor read or wrote last.
    """

    folder: Path
    path: Path | None
    name: str
    when: datetime
    obstacles: int
    version: FileVersion | None

    def read_sketch(self) -> Sketch:
        """Read the map from the draft."""
        return build_sketch(autosave.read_draft(self.folder, KIND).content.get("sketch"), str(self.folder))

    def describe(self, now: datetime | None = None) -> str:
        """Describe the draft, such as "“Office”, 12 obstacles, today 14:03, not saved to office.json"."""
        now = now or datetime.now().astimezone()
        days = (now.date() - self.when.date()).days
        day = {0: "today", 1: "yesterday"}.get(days, f"{self.when:%Y-%m-%d}")
        state = "never saved"
        if self.path is not None:
            state = f"not saved to {self.path.name}"
        content = f"“{to_one_line(self.name)}”, {format_count(self.obstacles, 'obstacle')}"
        return f"{content}, {day} {self.when:%H:%M}, {state}"


def build_draft_content(sketch: Sketch, version: FileVersion | None) -> dict[str, Any]:
    """Build the content of a draft: the version of the file, and the map."""
    disk = None
    if version is not None:
        disk = {"digest": version.digest, "stamp": list(version.stamp)}
    return {"disk": disk, "sketch": to_document(sketch)}


def _read_draft(draft: autosave.Draft) -> MapDraft | None:
    """Return the map of a draft; None if there is nothing to recover.

    That is the case if the draft has no map, or if the file already contains the same map.
    """
    document = draft.content.get("sketch")
    if document is None:
        return None
    sketch = build_sketch(document, str(draft.folder))
    if draft.path is not None:
        with suppress(MapError):
            if read_bytes(draft.path) == dump_sketch(sketch).encode():
                return None
    return MapDraft(
        folder=draft.folder,
        path=draft.path,
        name=sketch.name,
        when=draft.when,
        obstacles=len(sketch.obstacles),
        version=_read_version(draft),
    )


def _read_version(draft: autosave.Draft) -> FileVersion | None:
    """Return the version of the file of a draft; None if it has no file."""
    disk = draft.content.get("disk")
    if disk is None or draft.path is None:
        return None
    try:
        size, changed_ns = map(int, disk["stamp"])
        return FileVersion(draft.path, str(disk["digest"]), (size, changed_ns))
    except (TypeError, ValueError, KeyError) as error:
        raise MapError(f"{draft.folder}: expected a complete {KIND}: {error}") from None


find_recoverable = partial(autosave.find_drafts, kind=KIND, read=_read_draft)
"""Find the drafts of maps in a folder for drafts; see `autosave.find_drafts`."""
is_open_elsewhere = partial(autosave.is_open_elsewhere, kind=KIND)
"""Return whether another editor has the map file `path` open; see `autosave.is_open_elsewhere`."""
