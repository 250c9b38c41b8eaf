"""Work that survives a crash: each open document has a folder, locked while its program lives."""

import json
import os
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

from platformdirs import user_state_path

from robocov.errors import MapError, OutputError
from robocov.files.folder_lock import lock_folder
from robocov.files.strictjson import parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov_app.toolkit.opening import require_regular_file

FOLDER = "ROBOCOV_DRAFTS"  # environment variable with another folder to keep work in; empty for none
SERVED_FOLDER = ".drafts"  # folder for drafts below the folder of a window that is shown in browsers
_FILE = "draft.json"
_PAUSE = 0.25  # seconds between two writings
_SHARE = 10.0  # times as long as the last writing took: large work does not stutter
_PATIENCE = 2.0  # seconds until it is tried again when work could not be written
_TRIES = 3  # folders that are tried to work in
_YOUNG = 60.0  # seconds in which a folder without work may be one that a program is just making
_open_savers: list["Autosaver"] = []
_open_lock = threading.Lock()
_Work = TypeVar("_Work")
_Content = Callable[[], Mapping[str, Any]]


@dataclass(frozen=True)
class Record:
    """Content of a document's autosave folder."""

    folder: Path
    path: Path | None  # the document's file; None if it never had one
    when: datetime  # of writing, in local time
    content: Mapping[str, Any]  # the work, as `Autosaver.keep` was given it; empty where all was saved


class Autosaver:
    """Keeps one document aside, in a thread of its own: only `flush` and `close` wait for the disk."""

    def __init__(
        self, folder: Path | None, kind: str, path: Path | None = None, resumed: Path | None = None
    ) -> None:
        self.trouble = ""  # why work cannot be kept, in words
        self._kind, self._path = kind, path
        self._lock, self._changed = ExitStack(), threading.Condition()
        self._wanted: tuple[Path | None, _Content | None] | None = None
        self._writing = self._closed = self._hurried = False
        self._holds = resumed is not None
        if resumed is not None:
            self._lock.enter_context(lock_folder(resumed))
        self._place = resumed if resumed is not None or folder is None else self._new_place(folder)
        if self._place is None:
            return
        self._thread = threading.Thread(target=self._work, name="autosave", daemon=True)
        self._thread.start()
        with _open_lock:
            _open_savers.append(self)
        if resumed is None:
            self.keep(None)  # so that other programs know of the file

    def keep(self, content: _Content | None) -> None:
        """Keep work that is not saved; only the newest counts, and it is asked for in the thread."""
        with self._changed:
            if self._place is not None and not self._closed:
                self._wanted = self._path, content
                self._changed.notify_all()

    def settle(self, path: Path | None) -> None:
        self._path = path
        self.keep(None)

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until everything is on the disk; return whether it is."""
        with self._changed:
            self._hurried = True
            self._changed.notify_all()
            self._changed.wait_for(lambda: not (self._writing or (self._wanted and self._hurried)), timeout)
            return self._wanted is None and not self._writing and not self.trouble

    def close(self, *, discard: bool) -> None:
        """End; discard what was kept, as when nobody wants to save it, or leave it for the next start."""
        if self._place is None:
            return
        with self._changed:
            self._closed = True
            if discard:
                self._wanted = None
            self._changed.notify_all()
        self._thread.join()
        with _open_lock:
            _open_savers.remove(self)
        if discard or not self._holds:
            with suppress(OSError):
                (self._place / _FILE).unlink()
            self._lock.close()  # where files that are open cannot be removed, the lock goes first
            remove_draft(self._place)
        self._lock.close()
        self._place = None

    def _new_place(self, folder: Path) -> Path | None:
        for _ in range(_TRIES):
            try:
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                place = folder / f"{datetime.now():%Y%m%d-%H%M%S}-{secrets.token_hex(4)}"
                place.mkdir(mode=0o700)
                self._lock.enter_context(lock_folder(place))
                self.trouble = ""
                return place
            except (OSError, OutputError) as error:
                # perhaps another program looks for what was left behind in just this moment
                self.trouble = f"work is not kept aside: {error}"
        return None

    def _work(self) -> None:
        assert self._place is not None
        pause = 0.0
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._hurried, pause)
                self._changed.wait_for(lambda: self._closed or self._wanted)
                job, self._wanted = self._wanted, None
                if job is None:
                    return
                self._writing, self._hurried = True, False
            (path, content), began, trouble = job, time.perf_counter(), ""
            try:
                file = None if path is None else _encode_path(path.absolute())
                when = datetime.now().astimezone().isoformat(timespec="seconds")
                record: dict[str, Any] = {"format": self._kind, "version": 1, "path": file, "when": when}
                record |= content() if content is not None else {}
                with replace_file(self._place / _FILE) as part:
                    part.write_text(json.dumps(record, ensure_ascii=False), encoding="utf-8")
                self._holds = content is not None
            except Exception as error:  # the thread goes on: later work may be kept again
                trouble = f"work is not kept aside: {error}"
            pause = max(_PAUSE, _SHARE * (time.perf_counter() - began))
            with self._changed:
                self._writing, self.trouble = False, trouble
                if trouble and self._wanted is None and not self._closed:
                    self._wanted, pause = job, _PATIENCE  # perhaps there is room later
                self._changed.notify_all()


def flush_all(timeout: float) -> None:
    """Write the drafts of all open documents at once, and wait at most `timeout` seconds for that."""
    with _open_lock:
        savers = list(_open_savers)
    until = time.monotonic() + timeout
    for saver in savers:
        saver.flush(max(until - time.monotonic(), 0.0))


def autosave_folder(served_from: Path | None = None) -> Path | None:
    """Return the folder for drafts.

    Parameters
    ----------
    served_from : Path, optional
        Folder of a window that is shown in browsers. Such a window writes nowhere else, so its drafts are
        in the hidden folder `SERVED_FOLDER` below it.

    Returns
    -------
    folder : Path or None
        None if the environment variable `FOLDER` is set and empty: no drafts are kept then.
    """
    named = os.environ.get(FOLDER)
    if named == "":
        return None
    if served_from is not None:
        return served_from / SERVED_FOLDER
    return Path(named) if named else user_state_path("robocov", appauthor=False) / "drafts"


def recoverable(folder: Path | None, kind: str, read: Callable[[Record], _Work | None]) -> tuple[_Work, ...]:
    """Return the drafts that ended programs left, the newest first; remove empty folders.

    Parameters
    ----------
    folder : Path or None
        Folder for drafts.
    kind : str
        Kind of document.
    read : callable
        Makes of a record what is to be offered, or None if there is nothing to offer. A draft for which it
        raises anything is left where it is: one bad file must not keep windows from opening.
    """
    found = []
    for place in _places(folder):
        with suppress(Exception):  # in use, or not to be read
            with lock_folder(place):
                record = read_record(place, kind) if (place / _FILE).exists() else None
                work = None if record is None else read(record)
            if record is not None and work is not None:
                found.append((record.when, work))
            elif time.time() - place.stat().st_mtime > _YOUNG:
                remove_draft(place)
    return tuple(work for _, work in sorted(found, key=lambda pair: pair[0], reverse=True))


def remove_draft(folder: Path) -> None:
    """Remove the folder of one draft, as far as it can be removed.

    Each file is named in full: `shutil.rmtree` names them relative to an open folder, which a window that
    may use one folder alone cannot allow (see `robocov_app.web.confined`).
    """
    with suppress(OSError):
        for file in list(folder.iterdir()):
            file.unlink()
        folder.rmdir()


def opened_elsewhere(folder: Path | None, kind: str, path: Path) -> bool:
    """Return whether a living program has this file open; to be asked before making one's own `Autosaver`."""
    wanted = os.path.realpath(path)  # raises nothing where links lead in a circle
    for place in _places(folder):
        with suppress(MapError, OSError):
            named = read_record(place, kind).path
            if named is not None and os.path.realpath(named) == wanted:
                try:
                    with lock_folder(place):
                        pass
                except OutputError:
                    return True
    return False


def read_record(folder: Path, kind: str) -> Record:
    file = folder / _FILE
    require_regular_file(file)
    held = parse_json(read_bytes(file), str(file))
    if not isinstance(held, dict) or held.get("format") != kind or held.get("version") != 1:
        raise MapError(f"{file}: is no {kind}")
    content = {name: held[name] for name in held if name not in ("format", "version", "path", "when")}
    try:
        path = None if held["path"] is None else _decode_path(held["path"])
        return Record(folder, path, datetime.fromisoformat(held["when"]).astimezone(), content)
    except (TypeError, ValueError, KeyError, OverflowError, OSError) as error:
        raise MapError(f"{file}: is no whole {kind}: {error}") from None


def _encode_path(path: Path) -> str | dict[str, str]:
    """Return a path as JSON can hold it: as text, or as its bytes if they are not UTF-8."""
    text = str(path)
    try:
        text.encode()
    except UnicodeEncodeError:
        return {"bytes": os.fsencode(path).hex()}
    return text


def _decode_path(encoded: Any) -> Path:
    """Return the path; raise TypeError, ValueError or KeyError if it is none."""
    if isinstance(encoded, dict):
        return Path(os.fsdecode(bytes.fromhex(encoded["bytes"])))
    return Path(encoded)


def _places(folder: Path | None) -> list[Path]:
    try:
        return sorted(place for place in folder.iterdir() if place.is_dir()) if folder is not None else []
    except OSError:
        return []
