"""Saved and autosaved state of the open session, and its runs: no work is lost."""

import re
import subprocess
import sys
import tempfile
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from subprocess import DEVNULL
from time import monotonic
from typing import Any

from robocov.controllers import CONTROLLERS
from robocov.errors import OutputError
from robocov_app.runs.saved_runs import name_folders
from robocov_app.storage import autosave
from robocov_app.terminal.output import echo, find_free_path
from robocov_app.viewer.session.changes import Restart, SetController
from robocov_app.viewer.session.file import SUFFIX, save_session, session_json, session_of
from robocov_app.viewer.session.session import Session

KIND = "robocov-session-draft"
_PAUSE = 0.9  # seconds between two copies of a session that goes on
_ERRORS = "errors.txt"


class Workspace:
    """The file of the session that is open. `path`: its file; None if it never had one."""

    def __init__(
        self, session: Session, folder: Path | None, path: Path | None = None, resumed: Path | None = None
    ) -> None:
        self.session, self.path = session, path
        self._saved = -1 if resumed is not None else session.revision
        self._kept, self._when = (-1, -1), -_PAUSE  # revision and step of the last copy, and its time, s
        self._autosaver = autosave.Autosaver(folder, KIND, path, resumed)

    @property
    def unsaved(self) -> bool:
        return self.session.revision != self._saved

    def keep(self, view: Mapping[str, Any], *, at_once: bool = False) -> None:
        """Keep a draft of unsaved work, about once a second; `at_once` also if the last is younger."""
        state = self.session.revision, self.session.step_now
        wanted = self.unsaved and state != self._kept and self.session.can_be_made_again
        if not wanted or (monotonic() - self._when < _PAUSE and not at_once):
            return
        self._kept, self._when = state, monotonic()
        self.session.stow()
        content = session_json(self.session.document, self.session.head, self.session.step_now, view)
        self._autosaver.save_draft(lambda: {"session": content})

    def save(self, folder: Path, view: Mapping[str, Any], path: Path | None = None) -> Path:
        """Write the session to a file, by default its own or a new one; raises as `require_document`."""
        session = self.session
        session.require_document()
        session.stow()
        target = (
            path or self.path or find_free_path(folder, session.environment.name.lower() or "session", SUFFIX)
        )
        save_session(target, session.document, session.head, session.step_now, view)
        self.path, self._saved = target, session.revision
        self._autosaver.mark_saved(target)
        return target

    def close(self) -> None:
        self._autosaver.close(discard=not self.unsaved)


def recoverable(folder: Path | None) -> tuple[autosave.Draft, ...]:
    """Return the drafts of sessions that ended programs left, the newest first."""
    return autosave.find_drafts(folder, KIND, _check_draft)


def _check_draft(record: autosave.Draft) -> autosave.Draft | None:
    """Return a record whose session can be described; None if all was saved, KeyError if it is broken."""
    if "session" not in record.content:
        return None
    offer(record)
    return record


def offer(work: autosave.Draft) -> str:
    where = "never saved" if work.path is None else f"not saved to {work.path.name}"
    count = len(work.content["session"]["touches"]) - 1
    return f"a session of {work.when:%H:%M}, {count} {'touch' if count == 1 else 'touches'}, {where}"


def recovered(
    work: autosave.Draft, controllers: Collection[str], folder: Path | None
) -> tuple[Workspace, Mapping[str, Any]]:
    saved = session_of(work.content["session"], str(work.folder), controllers)
    return Workspace(Session.opened(saved), folder, work.path, work.folder), saved.view


@dataclass
class _Job:
    target: Path
    process: subprocess.Popen[bytes]
    temporary: tempfile.TemporaryDirectory[str]  # with the session, and what the process says on stderr


class RunSaver:
    """Has runs saved by other processes. No call but `finish` waits for them."""

    def __init__(self, lattice: int) -> None:
        self._lattice, self._jobs, self._said = lattice, list[_Job](), list[tuple[str, bool]]()

    def save(self, session: Session, folder: Path, map_name: str = "") -> str:
        """Begin to save the story up to the present in a new folder; raises as `require_document`."""
        session.require_document()
        named = map_name.replace("\\", "/").rpartition("/")[2].removesuffix(".json")
        laws = [pane.law.name for pane in session.panes]
        what = name_folders(laws)[0] if len(laws) == 1 else "comparison"
        stem = re.sub(r"[^\w.-]+", "-", named or session.environment.name).strip(".-")[:64] or "map"
        target = _made(folder, f"{stem}-{what}")
        temporary = tempfile.TemporaryDirectory(prefix="robocov-")
        file = Path(temporary.name) / f"session{SUFFIX}"
        save_session(file, session.document, session.head, session.step_now, {})
        command = [sys.executable, "-m", "robocov_app", "run", str(file), "--json"]
        command += ["--out", str(target.resolve()), "--lattice", str(self._lattice)]
        changes = [change for node in session.document.nodes for change in node.changes]
        used = [law for each in changes if isinstance(each, Restart) for law in each.scenario.laws]
        used += [each.law for each in changes if isinstance(each, SetController)]
        if own := [name for name in dict.fromkeys(law.name for law in used) if name not in CONTROLLERS]:
            command += ["--controller", ",".join(own)]
        try:
            with file.with_name(_ERRORS).open("wb") as errors:
                process = subprocess.Popen(command, stdin=DEVNULL, stdout=DEVNULL, stderr=errors)
        except OSError as error:
            raise OutputError(f"the run cannot be saved: {error.strerror or error}") from error
        self._jobs.append(_Job(target, process, temporary))
        return f"saving the run: {target}/"

    def poll(self) -> list[tuple[str, bool]]:
        """Return what is to be told since the last call, in words, and whether it is trouble."""
        for job in self._jobs[:]:
            if job.process.poll() is not None:
                self._end(job)
        said, self._said = self._said, []
        return said

    def finish(self) -> None:
        try:
            for k, job in enumerate(self._jobs):
                with suppress(subprocess.TimeoutExpired):
                    job.process.wait(0.5)
                if k == 0 and job.process.poll() is None:
                    echo("saving runs; Ctrl-C gives up", to_stderr=True)
                job.process.wait()
        except BaseException:
            for job in self._jobs:
                job.process.kill()
                job.process.wait()
            raise
        finally:
            for job in self._jobs[:]:
                self._end(job)

    def _end(self, job: _Job) -> None:
        self._jobs.remove(job)
        lines: list[str] = []
        with suppress(OSError), job.temporary as folder:  # whoever cleans up may have removed it
            lines = Path(folder, _ERRORS).read_text("utf-8", "replace").strip().splitlines()
        if job.process.returncode == 0:
            self._said.append((f"run saved: {job.target}/ (record, cost, pictures)", False))
            return
        reason = lines[-1].removeprefix("robocov: error: ") if lines else "the process has ended"
        with suppress(OSError):
            job.target.rmdir()  # fails, as it should, where there is something in it
        self._said.append((f"run not saved: {job.target}/: {reason}", True))


def _made(folder: Path, stem: str) -> Path:
    """Make a folder that was not there before; OutputError when it cannot be made."""
    while True:
        target = find_free_path(folder, stem, "")
        try:
            target.mkdir(parents=True)
        except FileExistsError:
            if not target.exists():  # a file stands where a folder is wanted
                raise OutputError(f"{target}: cannot be made") from None
        except OSError as error:
            raise OutputError(f"{target}: cannot be made: {error.strerror or error}") from error
        else:
            return target
