"""Drafts: unsaved work that survives a crash. Each open document has a folder, locked while it is open."""

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
from typing import Any, TypeAlias, TypeVar

from platformdirs import user_state_path

from robocov.errors import MapError, OutputError
from robocov.files.folder_lock import lock_folder
from robocov.files.strictjson import parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov_app.storage.regular_files import require_regular_file

FOLDER_VARIABLE = "ROBOCOV_DRAFTS"
"""Environment variable that selects another folder for drafts; if it is empty, none are kept."""
SERVED_FOLDER = ".drafts"
"""Folder for drafts below the folder of a window that is shown in browsers."""
_FILE_NAME = "draft.json"
_MIN_PAUSE_S = 0.25
"""Minimum time between two drafts."""
_PAUSE_FACTOR = 10.0
"""Pause divided by the time that the last draft took, so that large documents do not slow the window down."""
_RETRY_S = 2.0
"""Time after which a draft that could not be written is tried again."""
_MAX_FOLDER_ATTEMPTS = 3
_MIN_ABANDONED_AGE_S = 60.0
"""Younger folders without a draft may be those of programs that are just starting."""
_open_savers: list["Autosaver"] = []
_open_savers_lock = threading.Lock()
_Work = TypeVar("_Work")
_Content: TypeAlias = Callable[[], Mapping[str, Any]]
"""Returns the content of a draft."""
_Job: TypeAlias = tuple[Path | None, _Content | None]
"""File of a document, and the content of its draft; None if everything is saved."""


@dataclass(frozen=True)
class Draft:
    """Content of the draft folder of a document.

    Attributes
    ----------
    folder : Path
    path : Path or None
        File of the document; None if it never had one.
    when : datetime
        Local time of the draft.
    content : mapping
        The work that was passed to `Autosaver.save_draft`; empty if everything was saved.
    """

    folder: Path
    path: Path | None
    when: datetime
    content: Mapping[str, Any]


class Autosaver:
    """Writes the drafts of one document in a separate thread; only `flush` and `close` wait for the disk.

    Parameters
    ----------
    folder : Path or None
        Folder for drafts; None if none are kept.
    kind : str
        Kind of document, in files.
    path : Path or None
        File of the document.
    resumed : Path or None
        Folder of the draft from which the document was recovered.

    Attributes
    ----------
    problem : str
        Why the draft cannot be written; empty if it can.
    """

    def __init__(
        self, folder: Path | None, kind: str, path: Path | None = None, resumed: Path | None = None
    ) -> None:
        self.problem = ""
        self._kind = kind
        self._path = path
        self._lock = ExitStack()
        self._changed = threading.Condition()
        self._pending: _Job | None = None
        self._is_writing = False
        self._is_closed = False
        self._is_hurried = False
        self._has_draft = resumed is not None
        if resumed is not None:
            self._lock.enter_context(lock_folder(resumed))
        self._folder = resumed
        if resumed is None and folder is not None:
            self._folder = self._create_folder(folder)
        if self._folder is None:
            return
        self._thread = threading.Thread(target=self._write_drafts, name="autosave", daemon=True)
        self._thread.start()
        with _open_savers_lock:
            _open_savers.append(self)
        if resumed is None:
            # An empty draft shows other programs that the file is open, see `is_open_elsewhere`.
            self.save_draft(None)

    def save_draft(self, content: _Content | None) -> None:
        """Write a draft soon. Only the newest one is written.

        Parameters
        ----------
        content : callable or None
            Called in the thread; returns the work. None if everything is saved.
        """
        with self._changed:
            if self._folder is not None and not self._is_closed:
                self._pending = (self._path, content)
                self._changed.notify_all()

    def mark_saved(self, path: Path | None) -> None:
        """Record that everything is saved in a file, so that there is nothing to recover."""
        self._path = path
        self.save_draft(None)

    def flush(self, timeout: float = 5.0) -> bool:
        """Wait until the draft is on the disk.

        Parameters
        ----------
        timeout : float, s

        Returns
        -------
        bool
            Whether it is on the disk.
        """
        with self._changed:
            self._is_hurried = True
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: not (self._is_writing or (self._pending and self._is_hurried)), timeout
            )
            return self._pending is None and not self._is_writing and not self.problem

    def close(self, *, discard: bool) -> None:
        """Stop, and unlock the draft.

        Parameters
        ----------
        discard : bool
            Whether the draft is removed; otherwise the next start offers it.
        """
        if self._folder is None:
            return
        with self._changed:
            self._is_closed = True
            if discard:
                self._pending = None
            self._changed.notify_all()
        self._thread.join()
        with _open_savers_lock:
            _open_savers.remove(self)
        if discard or not self._has_draft:
            with suppress(OSError):
                (self._folder / _FILE_NAME).unlink()
            # Some systems cannot remove open files, so the lock is released first.
            self._lock.close()
            remove_draft(self._folder)
        self._lock.close()
        self._folder = None

    def _create_folder(self, parent: Path) -> Path | None:
        """Create and lock a folder for the draft; None if that is not possible."""
        for _ in range(_MAX_FOLDER_ATTEMPTS):
            try:
                parent.mkdir(parents=True, exist_ok=True, mode=0o700)
                folder = parent / f"{datetime.now():%Y%m%d-%H%M%S}-{secrets.token_hex(4)}"
                folder.mkdir(mode=0o700)
                self._lock.enter_context(lock_folder(folder))
                self.problem = ""
                return folder
            except (OSError, OutputError) as error:
                # Another program may be looking for abandoned folders at this moment.
                self.problem = f"drafts cannot be saved: {error}"
        return None

    def _write_drafts(self) -> None:
        """Write each pending draft; the target of the thread."""
        pause = 0.0
        while True:
            job = self._wait_for_job(pause)
            if job is None:
                return
            start = time.perf_counter()
            problem = ""
            try:
                self._write(*job)
            except Exception as error:
                # The thread continues, because the next draft may succeed.
                problem = f"drafts cannot be saved: {error}"
            pause = max(_MIN_PAUSE_S, _PAUSE_FACTOR * (time.perf_counter() - start))
            with self._changed:
                self._is_writing = False
                self.problem = problem
                if problem and self._pending is None and not self._is_closed:
                    self._pending = job
                    pause = _RETRY_S
                self._changed.notify_all()

    def _wait_for_job(self, pause: float) -> _Job | None:
        """Wait for a pause, s, and then for a pending draft; return None if the saver is closed without one.

        `flush` and `close` end the pause.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or self._is_hurried, pause)
            self._changed.wait_for(lambda: self._is_closed or self._pending)
            job = self._pending
            self._pending = None
            if job is not None:
                self._is_writing = True
                self._is_hurried = False
        return job

    def _write(self, path: Path | None, content: _Content | None) -> None:
        """Write a draft of a document in a file."""
        assert self._folder is not None
        encoded_path = None
        if path is not None:
            encoded_path = _encode_path(path.absolute())
        record: dict[str, Any] = {
            "format": self._kind,
            "version": 1,
            "path": encoded_path,
            "when": datetime.now().astimezone().isoformat(timespec="seconds"),
        }
        if content is not None:
            record |= content()
        with replace_file(self._folder / _FILE_NAME) as temporary:
            temporary.write_text(json.dumps(record, ensure_ascii=False), encoding="utf-8")
        self._has_draft = content is not None


def flush_all(timeout: float) -> None:
    """Write the drafts of all open documents.

    Parameters
    ----------
    timeout : float, s
        Maximum time to wait for them.
    """
    with _open_savers_lock:
        savers = list(_open_savers)
    end = time.monotonic() + timeout
    for saver in savers:
        saver.flush(max(end - time.monotonic(), 0.0))


def find_draft_folder(served_from: Path | None = None) -> Path | None:
    """Find the folder for drafts.

    Parameters
    ----------
    served_from : Path or None
        Folder of a window that is shown in browsers. Such a window writes nowhere else, so its drafts are
        in the hidden folder `SERVED_FOLDER` below it.

    Returns
    -------
    Path or None
        None if the environment variable `FOLDER_VARIABLE` is set and empty, so that no drafts are kept.
    """
    named_folder = os.environ.get(FOLDER_VARIABLE)
    if named_folder == "":
        return None
    if served_from is not None:
        return served_from / SERVED_FOLDER
    if named_folder is not None:
        return Path(named_folder)
    return user_state_path("robocov", appauthor=False) / "drafts"


def find_drafts(folder: Path | None, kind: str, read: Callable[[Draft], _Work | None]) -> tuple[_Work, ...]:
    """Find the drafts that programs left when they ended, and remove empty folders.

    Parameters
    ----------
    folder : Path or None
        Folder for drafts.
    kind : str
        Kind of document.
    read : callable
        Returns the work of a draft that is offered to the user, or None if there is nothing to offer. If it
        raises anything, the draft is left where it is: one bad file must not keep windows from opening.

    Returns
    -------
    tuple
        The newest first.
    """
    dated_works = []
    for draft_folder in _list_folders(folder):
        # A draft that is in use, or cannot be read, is left alone.
        with suppress(Exception):
            with lock_folder(draft_folder):
                draft: Draft | None = None
                work: _Work | None = None
                if (draft_folder / _FILE_NAME).exists():
                    draft = read_draft(draft_folder, kind)
                    work = read(draft)
            if draft is not None and work is not None:
                dated_works.append((draft.when, work))
            elif time.time() - draft_folder.stat().st_mtime > _MIN_ABANDONED_AGE_S:
                remove_draft(draft_folder)
    dated_works.sort(key=lambda pair: pair[0], reverse=True)
    return tuple(work for _, work in dated_works)


def remove_draft(folder: Path) -> None:
    """Remove the folder of one draft, as far as possible.

    `shutil.rmtree` uses paths relative to an open folder, which `robocov_app.web.confined` does not allow.
    Therefore each file is removed by its full path.
    """
    with suppress(OSError):
        for file in list(folder.iterdir()):
            file.unlink()
        folder.rmdir()


def is_open_elsewhere(folder: Path | None, kind: str, path: Path) -> bool:
    """Return whether another running program has a file open.

    Parameters
    ----------
    folder : Path or None
        Folder for drafts.
    kind : str
        Kind of document.
    path : Path
        The file. The program must not have an `Autosaver` for it itself.

    Returns
    -------
    bool
    """
    # Unlike Path.resolve, this does not raise if links form a loop.
    real_path = os.path.realpath(path)
    for draft_folder in _list_folders(folder):
        with suppress(MapError, OSError):
            draft_path = read_draft(draft_folder, kind).path
            if draft_path is not None and os.path.realpath(draft_path) == real_path:
                try:
                    with lock_folder(draft_folder):
                        pass
                except OutputError:
                    return True
    return False


def read_draft(folder: Path, kind: str) -> Draft:
    """Read a draft.

    Parameters
    ----------
    folder : Path
        Folder of the draft.
    kind : str
        Expected kind of document.

    Returns
    -------
    Draft

    Raises
    ------
    MapError
        If it cannot be read, or is of another kind.
    """
    file = folder / _FILE_NAME
    require_regular_file(file)
    record = parse_json(read_bytes(file), str(file))
    if not isinstance(record, dict) or record.get("format") != kind or record.get("version") != 1:
        raise MapError(f"{file}: not a {kind}")
    header = ("format", "version", "path", "when")
    content = {name: record[name] for name in record if name not in header}
    try:
        path = None
        if record["path"] is not None:
            path = _decode_path(record["path"])
        return Draft(folder, path, datetime.fromisoformat(record["when"]).astimezone(), content)
    except (TypeError, ValueError, KeyError, OverflowError, OSError) as error:
        raise MapError(f"{file}: not a complete {kind}: {error}") from None


def _encode_path(path: Path) -> str | dict[str, str]:
    """Return a path as JSON content: a string, or its bytes if they are not UTF-8."""
    text = str(path)
    try:
        text.encode()
    except UnicodeEncodeError:
        return {"bytes": os.fsencode(path).hex()}
    return text


def _decode_path(encoded: Any) -> Path:
    """Return a path from JSON content; raise TypeError, ValueError or KeyError if it is none."""
    if isinstance(encoded, dict):
        return Path(os.fsdecode(bytes.fromhex(encoded["bytes"])))
    return Path(encoded)


def _list_folders(folder: Path | None) -> list[Path]:
    """Return the folders in a folder; none if it cannot be read."""
    if folder is None:
        return []
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir())
    except OSError:
        return []
