"""Work that is not lost: every sketch is kept aside while it is edited, and found again after a crash.

Each open document has a folder of its own in the user's folder for states, locked while its editor lives;
so two editors never meet, and what an editor left behind that ended without a word can be told from what
is being worked on. The environment variable ``ROBOCOV_DRAFTS`` names another folder, or none if it is empty.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from robocov.errors import MapError, OutputError, counted, one_line
from robocov.files.atomic import locked, written
from robocov.files.strictjson import parse, read_bytes
from robocov_app.editor.model.file import OnDisk
from robocov_app.editor.model.parser import sketch_of
from robocov_app.editor.model.sketch import Sketch, draft_document, sketch_text

FOLDER = "ROBOCOV_DRAFTS"
"""Environment variable with another folder for drafts; empty for none."""

_FORMAT = "robocov-draft"
_NAME = "draft.json"

_PAUSE = 0.25
"""Seconds between two drafts."""

_SHARE = 10.0
"""So many times as long as the last draft took is the pause, if that is longer: large maps do not stutter."""

_PATIENCE = 2.0
"""Seconds until it is tried again when a draft could not be written."""

_TRIES = 3
"""Folders that are tried to work in."""

_YOUNG = 60.0
"""Seconds in which a folder without work may be one that an editor is just making."""


@dataclass(frozen=True)
class Autosave:
    """Work that an editor left behind.

    Attributes
    ----------
    folder : Path
        Where it lies.
    path : Path or None
        The file that it belongs to; None if it never had one.
    name : str
        The map's name.
    when : datetime
        When it was kept, in local time.
    obstacles : int
    disk : OnDisk or None
        What the file was like when it was read or written last.
    """

    folder: Path
    path: Path | None
    name: str
    when: datetime
    obstacles: int
    disk: OnDisk | None

    def sketch(self) -> Sketch:
        """Return the work.

        Raises
        ------
        MapError
            When it cannot be read.
        """
        return sketch_of(_held(self.folder)["sketch"], str(self.folder / _NAME))

    def words(self, now: datetime | None = None) -> str:
        """Return what to offer: "“Office”, 12 obstacles, today 14:03, not saved to office.json"."""
        now = now or datetime.now().astimezone()
        days = (now.date() - self.when.date()).days
        day = {0: "today", 1: "yesterday"}.get(days, f"{self.when:%Y-%m-%d}")
        where = "never saved" if self.path is None else f"not saved to {self.path.name}"
        what = f"“{one_line(self.name)}”, {counted(self.obstacles, 'obstacle')}"
        return f"{what}, {day} {self.when:%H:%M}, {where}"


def autosave_folder() -> Path | None:
    """Return where drafts are kept, None where they are not to be."""
    named = os.environ.get(FOLDER)
    if named is not None:
        return Path(named) if named else None
    from platformdirs import user_state_path

    return user_state_path("robocov", appauthor=False) / "drafts"


def recoverable(folder: Path | None) -> tuple[Autosave, ...]:
    """Return the work that editors left behind which live no more, the newest first.

    What its file holds already is none. Folders without work are removed; what cannot be read stays where
    it is, and is not offered.
    """
    found = []
    for place in _places(folder):
        try:
            with locked(place):
                draft = _draft(place)
        except (OutputError, MapError, OSError):  # in use, or not to be read
            continue
        if draft is not None:
            found.append(draft)
        elif _age(place) > _YOUNG:
            shutil.rmtree(place, ignore_errors=True)
    return tuple(sorted(found, key=lambda draft: draft.when, reverse=True))


def discard(draft: Autosave) -> None:
    """Remove a draft for good."""
    shutil.rmtree(draft.folder, ignore_errors=True)


def opened_elsewhere(folder: Path | None, path: Path) -> bool:
    """Return whether a living editor has this file open; to be asked before one's own `Autosaver`."""
    wanted = path.resolve()
    for place in _places(folder):
        with suppress(MapError, OSError):
            named = _held(place)["path"]
            if named is None or Path(named).resolve() != wanted:
                continue
            try:
                with locked(place):
                    pass
            except OutputError:
                return True
    return False


class Autosaver:
    """Keeps one document aside, in a thread of its own: only `flush` and `close` wait for the disk.

    Parameters
    ----------
    folder : Path or None
        `autosave_folder()`; None keeps nothing.
    path : Path or None
        The document's file.
    disk : OnDisk or None
    draft : Autosave or None
        Work that was left behind and goes on: its folder is taken over, and so are path and disk.

    Raises
    ------
    OutputError
        When another editor has taken the draft over.
    """

    def __init__(
        self,
        folder: Path | None,
        path: Path | None = None,
        disk: OnDisk | None = None,
        draft: Autosave | None = None,
    ) -> None:
        self._lock = ExitStack()
        self._place: Path | None = None
        self._trouble = ""
        self._path, self._disk = (path, disk) if draft is None else (draft.path, draft.disk)
        self._changed = threading.Condition()
        self._wanted: _Job | None = None
        self._writing = self._closed = self._hurried = False
        self._holds = draft is not None
        self._thread: threading.Thread | None = None
        if draft is not None:
            self._lock.enter_context(locked(draft.folder))
            self._place = draft.folder
        elif folder is not None:
            self._place = self._new_place(folder)
        if self._place is None:
            return
        self._thread = threading.Thread(target=self._work, name="drafts", daemon=True)
        self._thread.start()
        if draft is None:
            # so that other editors know of the file
            self._want(None)

    def keep(self, sketch: Sketch) -> None:
        """Keep a sketch that is not saved; only the newest counts."""
        self._want(sketch)

    def settle(self, path: Path | None, disk: OnDisk | None) -> None:
        """Forget what was kept: the document was saved, or opened anew."""
        self._path, self._disk = path, disk
        self._want(None)

    @property
    def trouble(self) -> str:
        """What keeps it from keeping, in words; empty if nothing does."""
        return self._trouble

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until everything is on the disk; say whether it is."""
        with self._changed:
            self._hurried = True
            self._changed.notify_all()
            self._changed.wait_for(lambda: not (self._writing or (self._wanted and self._hurried)), timeout)
            return self._wanted is None and not self._writing and not self._trouble

    def close(self, *, discard: bool) -> None:
        """End; discard what was kept, as when nobody wants to save it, or leave it for the next start."""
        if self._place is None or self._thread is None:
            return
        with self._changed:
            self._closed = True
            if discard:
                self._wanted = None
            self._changed.notify_all()
        self._thread.join()
        if discard or not self._holds:
            with suppress(OSError):
                (self._place / _NAME).unlink()
            # where files that are open cannot be removed, the lock goes first
            self._lock.close()
            shutil.rmtree(self._place, ignore_errors=True)
        self._lock.close()
        self._place = None

    def _new_place(self, folder: Path) -> Path | None:
        """Make and lock a new folder."""
        for _ in range(_TRIES):
            try:
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                place = folder / f"{datetime.now():%Y%m%d-%H%M%S}-{secrets.token_hex(4)}"
                place.mkdir(mode=0o700)
                self._lock.enter_context(locked(place))
            except (OSError, OutputError) as error:
                # perhaps another editor looks for what was left behind in just this moment
                self._trouble = f"work is not kept aside: {error}"
            else:
                self._trouble = ""
                return place
        return None

    def _want(self, sketch: Sketch | None) -> None:
        with self._changed:
            if self._place is not None and not self._closed:
                self._wanted = _Job(sketch, self._path, self._disk)
                self._changed.notify_all()

    def _work(self) -> None:
        """Write what is wanted, the newest only, with pauses in which others can work."""
        pause = 0.0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._hurried, pause)
                self._changed.wait_for(lambda: self._closed or self._wanted)
                job, self._wanted = self._wanted, None
                if job is None:
                    return
                self._writing, self._hurried = True, False
            began = time.perf_counter()
            trouble = self._written(job)
            pause = max(_PAUSE, _SHARE * (time.perf_counter() - began))
            with self._changed:
                self._writing, self._trouble = False, trouble
                if trouble and self._wanted is None and not self._closed:
                    # perhaps there is room later
                    self._wanted, pause = job, _PATIENCE
                self._changed.notify_all()

    def _written(self, job: _Job) -> str:
        assert self._place is not None
        try:
            with written(self._place / _NAME) as part:
                part.write_bytes(job.text().encode())
        except (OSError, OutputError) as error:
            return f"work is not kept aside: {error}"
        self._holds = job.sketch is not None
        return ""


@dataclass(frozen=True)
class _Job:
    """What is to be written."""

    sketch: Sketch | None
    path: Path | None
    disk: OnDisk | None

    def text(self) -> str:
        disk = self.disk and {"digest": self.disk.digest, "stamp": list(self.disk.stamp)}
        held = {
            "format": _FORMAT,
            "version": 1,
            "path": None if self.path is None else str(self.path.absolute()),
            "disk": disk,
            "when": datetime.now().astimezone().isoformat(timespec="seconds"),
            "sketch": None if self.sketch is None else draft_document(self.sketch),
        }
        return json.dumps(held, ensure_ascii=False)


def _places(folder: Path | None) -> list[Path]:
    """Return the folders of all documents."""
    if folder is None:
        return []
    with suppress(OSError):
        return sorted(place for place in folder.iterdir() if place.is_dir())
    return []


def _age(place: Path) -> float:
    """Return how many seconds ago a folder was changed last; 0 where it is gone."""
    with suppress(OSError):
        return time.time() - place.stat().st_mtime
    return 0.0


def _held(place: Path) -> dict[str, Any]:
    """Return what the draft in a folder holds."""
    path = place / _NAME
    held = parse(read_bytes(path), str(path))
    if not isinstance(held, dict) or held.get("format") != _FORMAT or held.get("version") != 1:
        raise MapError(f"{path}: is no draft")
    if not {"path", "disk", "when", "sketch"} <= held.keys():
        raise MapError(f"{path}: is no whole draft")
    return held


def _draft(place: Path) -> Autosave | None:
    """Return the work in a folder, None if there is none."""
    if not (place / _NAME).exists():
        return None
    held = _held(place)
    if held["sketch"] is None:
        return None
    sketch = sketch_of(held["sketch"], str(place / _NAME))
    try:
        path = None if held["path"] is None else Path(held["path"])
        when = datetime.fromisoformat(held["when"]).astimezone()
        disk = None
        if path is not None and held["disk"] is not None:
            size, changed = held["disk"]["stamp"]
            disk = OnDisk(path, str(held["disk"]["digest"]), (int(size), int(changed)))
    except (TypeError, ValueError, KeyError) as error:
        raise MapError(f"{place / _NAME}: is no whole draft: {error}") from None
    if path is not None and _holds(path, sketch):
        return None
    return Autosave(place, path, sketch.name, when, len(sketch.obstacles), disk)


def _holds(path: Path, sketch: Sketch) -> bool:
    """Return whether a file holds a sketch already."""
    try:
        return read_bytes(path) == sketch_text(sketch).encode()
    except MapError:
        return False
