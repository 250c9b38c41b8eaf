"""Drafts: unsaved work that survives a crash. Each open document has its own folder, locked while open."""

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
from typing import Any, NamedTuple, TypeAlias, TypeVar

from platformdirs import user_state_path

from robocov.errors import MapError, OutputError
from robocov.files.folder_lock import lock_folder
from robocov.files.strictjson import parse_json, read_bytes
from robocov.files.writing import replace_file
from robocov_app.storage.regular_files import require_regular_file

FOLDER_VARIABLE = "ROBOCOV_DRAFTS"
"""Environment variable that selects another folder for drafts; if it is empty, no drafts are saved."""
SERVED_FOLDER = ".drafts"
"""Folder for drafts below the folder of a window that is shown in browsers."""
_FILE_NAME = "draft.json"
"""Name of the file of a draft in its folder."""
_MIN_PAUSE_S = 0.25
"""Minimum time between two drafts."""
_PAUSE_FACTOR = 10.0
"""Pause after a draft divided by the time to write it. Large drafts must not slow down the window."""
_RETRY_S = 2.0
"""Time until a draft that could not be written is written again."""
_MAX_FOLDER_ATTEMPTS = 3
"""Maximum number of attempts to create a draft folder."""
_MIN_ABANDONED_AGE_S = 60.0
"""Minimum age at which a folder without a draft is removed; a newer one may belong to a starting program."""
_open_savers: list["Autosaver"] = []
_open_savers_lock = threading.Lock()
_Work = TypeVar("_Work")
_Content: TypeAlias = Callable[[], Mapping[str, Any]]
"""Returns the content of a draft."""


class _PendingDraft(NamedTuple):
    """A draft to be written."""

    path: Path | None
    """File of the document; None if it has none."""
    build_content: _Content | None
    """Returns the unsaved work; None if everything is saved."""


@dataclass(frozen=True)
class Draft:
    """A draft that was read from the draft folder of a document.

    Attributes
    ----------
    folder : Path
        Draft folder of the document.
    path : Path or None
        File of the document; None if it never had one.
    when : datetime
        Local time at which the draft was written.
    content : mapping
        Unsaved work, as returned by the callable passed to `Autosaver.save_draft`; empty if all was saved.
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
        Folder for drafts; None to save no drafts.
    kind : str
        Kind of document, stored in each draft.
    path : Path or None
        File of the document; None if it has none yet.
    resumed_folder : Path or None
        Draft folder from which the document was recovered; the autosaver continues to use it.

    Attributes
    ----------
    problem : str
        Reason why the draft cannot be written; empty if there is no problem.
    """

    def __init__(
        self, folder: Path | None, kind: str, path: Path | None = None, resumed_folder: Path | None = None
    ) -> None:
        self.problem = ""
        self._kind = kind
        self._path = path
        self._lock = ExitStack()
        self._changed = threading.Condition()
        self._pending: _PendingDraft | None = None
        self._is_writing = False
        self._is_closed = False
        self._skips_pause = False
        self._has_draft = resumed_folder is not None
        if resumed_folder is not None:
            self._lock.enter_context(lock_folder(resumed_folder))
        self._folder = resumed_folder
        if resumed_folder is None and folder is not None:
            self._folder = self._create_folder(folder)
        if self._folder is None:
            return
        self._thread = threading.Thread(target=self._write_drafts, name="autosave", daemon=True)
        self._thread.start()
        with _open_savers_lock:
            _open_savers.append(self)
        if resumed_folder is None:
            # An empty draft shows other programs that the file is open; see `is_open_elsewhere`.
            self.save_draft(None)

    def save_draft(self, content: _Content | None) -> None:
        """Write a draft soon, in the background. A newer draft replaces one that is still pending.

        Parameters
        ----------
        content : callable or None
            Returns the unsaved work; called in the background thread. None if everything is saved.
        """
        with self._changed:
            if self._folder is not None and not self._is_closed:
                self._pending = _PendingDraft(self._path, content)
                self._changed.notify_all()

    def mark_saved(self, path: Path | None) -> None:
        """Record that the document was saved, so that there is nothing to recover.

        Parameters
        ----------
        path : Path or None
            File in which it was saved; None if it has no file.
        """
        self._path = path
        self.save_draft(None)

    def flush(self, timeout: float = 5.0) -> bool:
        """Write the pending draft now, and wait until it is on disk.

        Parameters
        ----------
        timeout : float, s
            Maximum time to wait.

        Returns
        -------
        bool
            False if a draft is still waiting, or could not be written.
        """
        with self._changed:
            self._skips_pause = True
            self._changed.notify_all()
            # A draft that could not be written is pending again without `_skips_pause`, which ends the wait.
            self._changed.wait_for(
                lambda: not (self._is_writing or (self._pending and self._skips_pause)), timeout
            )
            return self._pending is None and not self._is_writing and not self.problem

    def close(self, *, discard: bool) -> bool:
        """Stop saving drafts, and unlock the draft folder.

        Parameters
        ----------
        discard : bool
            True to remove the draft. False to keep it, so that it is offered at the next start.

        Returns
        -------
        bool
            Whether there is a draft to recover.
        """
        if self._folder is None:
            return False
        with self._changed:
            self._is_closed = True
            if discard:
                self._pending = None
            self._changed.notify_all()
        self._thread.join()
        with _open_savers_lock:
            _open_savers.remove(self)
        keeps_draft = self._has_draft and not discard
        if not keeps_draft:
            with suppress(OSError):
                (self._folder / _FILE_NAME).unlink()
            # Some systems cannot remove open files, so the lock file is closed first.
            self._lock.close()
            remove_draft(self._folder)
        self._lock.close()
        self._folder = None
        return keeps_draft

    def _create_folder(self, parent: Path) -> Path | None:
        """Create and lock a draft folder; return None and set `problem` if that fails."""
        for _ in range(_MAX_FOLDER_ATTEMPTS):
            try:
                parent.mkdir(parents=True, exist_ok=True, mode=0o700)
                folder = parent / f"{datetime.now():%Y%m%d-%H%M%S}-{secrets.token_hex(4)}"
                folder.mkdir(mode=0o700)
                self._lock.enter_context(lock_folder(folder))
                self.problem = ""
                return folder
            except (OSError, OutputError) as error:
                # Another program that looks for abandoned drafts may have locked the folder for a moment.
                self.problem = f"drafts cannot be saved: {error}"
        return None

    def _write_drafts(self) -> None:
        """Write pending drafts until the saver is closed; the target of the background thread."""
        pause = 0.0
        while True:
            draft = self._wait_for_draft(pause)
            if draft is None:
                return
            start = time.perf_counter()
            problem = ""
            try:
                self._write(draft)
            except Exception as error:
                # The thread continues, because the next draft may succeed.
                problem = f"drafts cannot be saved: {error}"
            pause = max(_MIN_PAUSE_S, _PAUSE_FACTOR * (time.perf_counter() - start))
            with self._changed:
                self._is_writing = False
                self.problem = problem
                if problem and self._pending is None and not self._is_closed:
                    # There is no newer draft, so the same one is tried again.
                    self._pending = draft
                    pause = _RETRY_S
                self._changed.notify_all()

    def _wait_for_draft(self, pause: float) -> _PendingDraft | None:
        """Wait for `pause` seconds, then for a pending draft; return None if the saver is closed without one.

        `flush` and `close` cut the pause short.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or self._skips_pause, pause)
            self._changed.wait_for(lambda: self._is_closed or self._pending)
            draft = self._pending
            self._pending = None
            if draft is not None:
                self._is_writing = True
                self._skips_pause = False
        return draft

    def _write(self, draft: _PendingDraft) -> None:
        """Write a draft to the draft folder. If all is saved, it contains only the path of the file."""
        assert self._folder is not None
        encoded_path = None
        if draft.path is not None:
            encoded_path = _encode_path(draft.path.absolute())
        record: dict[str, Any] = {
            "format": self._kind,
            "version": 1,
            "path": encoded_path,
            "when": datetime.now().astimezone().isoformat(timespec="milliseconds"),
        }
        if draft.build_content is not None:
            record |= draft.build_content()
        with replace_file(self._folder / _FILE_NAME) as temporary:
            temporary.write_text(json.dumps(record, ensure_ascii=False), encoding="utf-8")
        self._has_draft = draft.build_content is not None


def flush_all(timeout: float) -> None:
    """Write the drafts of all open documents to disk.

    Parameters
    ----------
    timeout : float, s
        Maximum time to wait for all drafts together.
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
        Working folder of a window that is shown in a browser. Such a window may not write anywhere else, so
        its drafts are in the hidden subfolder `SERVED_FOLDER`.

    Returns
    -------
    Path or None
        None if no drafts are saved, because the environment variable `FOLDER_VARIABLE` is set but empty.
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
    """Find the drafts of programs that are no longer running, and remove abandoned folders without a draft.

    Parameters
    ----------
    folder : Path or None
        Folder for drafts.
    kind : str
        Kind of document.
    read : callable
        Returns the recovered work of a draft, or None if there is nothing to recover. If it raises any error,
        the draft is skipped but kept: one bad file must not prevent a window from opening.

    Returns
    -------
    tuple
        Recovered works, the newest first.
    """
    dated_works = []
    for draft_folder in _list_folders(folder):
        try:
            dated_work = _read_unlocked_draft(draft_folder, kind, read)
            if dated_work is not None:
                dated_works.append(dated_work)
            elif time.time() - draft_folder.stat().st_mtime > _MIN_ABANDONED_AGE_S:
                remove_draft(draft_folder)
        except Exception:
            # A draft that is locked by a running program, or cannot be read, is left alone.
            continue
    dated_works.sort(key=lambda pair: pair[0], reverse=True)
    return tuple(work for _, work in dated_works)


def _read_unlocked_draft(
    folder: Path, kind: str, read: Callable[[Draft], _Work | None]
) -> tuple[datetime, _Work] | None:
    """Return the time and the work of a draft, or None if there is nothing to recover.

    Raises OutputError if a running program has locked the folder.
    """
    with lock_folder(folder):
        if not (folder / _FILE_NAME).exists():
            return None
        draft = read_draft(folder, kind)
        work = read(draft)
    if work is None:
        return None
    return draft.when, work


def remove_draft(folder: Path) -> None:
    """Remove the folder of one draft; errors are ignored.

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
        File of a document. This program must not have an `Autosaver` for it.

    Returns
    -------
    bool
    """
    # Unlike Path.resolve, this does not raise if links form a loop.
    real_path = os.path.realpath(path)
    for draft_folder in _list_folders(folder):
        with suppress(MapError, OSError):
            draft_path = read_draft(draft_folder, kind).path
            is_same_file = draft_path is not None and os.path.realpath(draft_path) == real_path
            # The folder is locked if, and only if, a program has the document open.
            if is_same_file and _is_locked(draft_folder):
                return True
    return False


def _is_locked(folder: Path) -> bool:
    """Return whether another running program has locked a draft folder."""
    try:
        with lock_folder(folder):
            return False
    except OutputError:
        return True


def read_draft(folder: Path, kind: str) -> Draft:
    """Read the draft in a draft folder.

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
        If the draft cannot be read, or is of another kind.
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
        raise MapError(f"{file}: incomplete {kind}: {error}") from None


def _encode_path(path: Path) -> str | dict[str, str]:
    """Encode a path for JSON: as a string, or as hexadecimal bytes if it is not valid Unicode."""
    text = str(path)
    try:
        text.encode()
    except UnicodeEncodeError:
        return {"bytes": os.fsencode(path).hex()}
    return text


def _decode_path(encoded: Any) -> Path:
    """Decode a path from JSON; raise TypeError, ValueError or KeyError if the value is invalid."""
    if isinstance(encoded, dict):
        return Path(os.fsdecode(bytes.fromhex(encoded["bytes"])))
    return Path(encoded)


def _list_folders(folder: Path | None) -> list[Path]:
    """Return the sorted subfolders of a folder; an empty list if it is None or cannot be read."""
    if folder is None:
        return []
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir())
    except OSError:
        return []
