"""Saving the runs of a session in the background, in other processes."""

import subprocess
import sys
import tempfile
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from subprocess import DEVNULL

from robocov.controllers import CONTROLLERS
from robocov.errors import OutputError
from robocov_app.runs.saved_runs import name_folders
from robocov_app.terminal.output import clean_file_stem, echo, find_free_path
from robocov_app.terminal.supervision import describe_status
from robocov_app.viewer.session.document import SessionDocument
from robocov_app.viewer.session.editing.edits import Restart, SetController
from robocov_app.viewer.session.files.session_file import SUFFIX, save_session
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.timeline import Timeline

FIRST_WAIT_S = 0.5
"""Time for which `finish` waits for a process before it tells the user."""
_ERROR_FILE = "errors.txt"


@dataclass
class _Job:
    """A run that is being saved.

    Attributes
    ----------
    target : Path
        Folder of the run.
    process : Popen
        The process.
    temporary : TemporaryDirectory
        Folder with the session file and the standard error output of the process.
    """

    target: Path
    process: subprocess.Popen[bytes]
    temporary: tempfile.TemporaryDirectory[str]


class RunSaver:
    """Saves runs in other processes. Only `finish` waits for them.

    Parameters
    ----------
    lattice : int
        Number of lattice points along the longer side of the map, for the coverage cost.
    """

    def __init__(self, lattice: int) -> None:
        self._lattice = lattice
        self._jobs: list[_Job] = []
        self._messages: list[tuple[str, bool]] = []

    def save(self, session: Session, folder: Path, map_name: str = "") -> str:
        """Start saving the branch of a session, up to its present, as a run in a new folder.

        Parameters
        ----------
        session : Session
            The session.
        folder : Path
            Folder in which the folder of the run is created.
        map_name : str
            Name or path of the map, for the name of the folder.

        Returns
        -------
        str
            A message for the user.

        Raises
        ------
        ParameterError
            If the session cannot be recomputed from its edits.
        OutputError
            If a folder or the session file cannot be written, or the process cannot be started. Then the
            folder of the run is removed again.
        """
        timeline = session.timeline
        timeline.require_reproducible()
        target = _make_new_folder(folder, _build_folder_stem(session, map_name))
        try:
            self._jobs.append(self._start_job(timeline, target))
        except OSError as error:
            raise OutputError(f"the run cannot be saved: {error.strerror or error}") from error
        return f"saving the run: {target}/"

    def _start_job(self, timeline: Timeline, target: Path) -> _Job:
        """Start the process that saves a run in the folder `target`; remove the folder if that fails."""
        with ExitStack() as cleanup:
            cleanup.callback(_remove_if_empty, target)
            temporary = tempfile.TemporaryDirectory(prefix="robocov-")
            cleanup.callback(temporary.cleanup)
            file = Path(temporary.name) / f"session{SUFFIX}"
            save_session(file, timeline.document, timeline.head, timeline.step, {})
            command = [sys.executable, "-m", "robocov_app", "run", str(file), "--json"]
            command += ["--out", str(target.resolve()), "--lattice", str(self._lattice)]
            user_controllers = list_user_controllers(timeline.document)
            if user_controllers:
                command += ["--controller", ",".join(user_controllers)]
            with file.with_name(_ERROR_FILE).open("wb") as errors:
                process = subprocess.Popen(command, stdin=DEVNULL, stdout=DEVNULL, stderr=errors)
            # The process needs both folders.
            cleanup.pop_all()
        return _Job(target, process, temporary)

    def poll(self) -> list[tuple[str, bool]]:
        """Return (message, is_error) for each run whose process has ended since the last call."""
        for job in self._jobs[:]:
            if job.process.poll() is not None:
                self._end_job(job)
        messages = self._messages
        self._messages = []
        return messages

    def finish(self) -> None:
        """Wait until all runs are saved; if the wait is interrupted, kill the processes."""
        try:
            is_reported = False
            for job in self._jobs:
                with suppress(subprocess.TimeoutExpired):
                    job.process.wait(FIRST_WAIT_S)
                if not is_reported and job.process.poll() is None:
                    echo("saving runs; press Ctrl+C to cancel", to_stderr=True)
                    is_reported = True
                job.process.wait()
        except BaseException:
            for job in self._jobs:
                job.process.kill()
                job.process.wait()
            raise
        finally:
            for job in self._jobs[:]:
                self._end_job(job)

    def _end_job(self, job: _Job) -> None:
        """Clean up after a process, and queue the message about its result."""
        self._jobs.remove(job)
        lines: list[str] = []
        # A program that cleans up temporary files may already have removed the folder.
        with suppress(OSError), job.temporary as folder:
            lines = Path(folder, _ERROR_FILE).read_text("utf-8", "replace").strip().splitlines()
        status = job.process.returncode
        if status == 0:
            self._messages.append((f"run saved: {job.target}/ (record, cost, figures)", False))
            return
        reason = f"the process has ended: {describe_status(status)}"
        # A process that was killed has not reported why.
        if lines and status > 0:
            reason = lines[-1].removeprefix("robocov: error: ")
        _remove_if_empty(job.target)
        self._messages.append((f"run not saved: {job.target}/: {reason}", True))


def _remove_if_empty(folder: Path) -> None:
    """Remove a folder if it exists and is empty."""
    with suppress(OSError):
        folder.rmdir()


def _build_folder_stem(session: Session, map_name: str) -> str:
    """Build the name of a run's folder from the names of the map and the controller."""
    file_name = map_name.replace("\\", "/").rpartition("/")[2].removesuffix(".json")
    name = file_name or session.displayed.environment.name
    stem = clean_file_stem(name, "map")
    controllers = [pane.controller.name for pane in session.timeline.panes]
    subject = name_folders(controllers)[0] if len(controllers) == 1 else "comparison"
    return f"{stem}-{subject}"


def list_user_controllers(document: SessionDocument) -> list[str]:
    """Return the names of all controllers of a document that are in users' files."""
    restart_names = []
    later_names = []
    for node in document.nodes:
        for edit in node.edits:
            if isinstance(edit, Restart):
                restart_names += [controller.name for controller in edit.scenario.controllers]
            elif isinstance(edit, SetController):
                later_names.append(edit.controller.name)
    names = dict.fromkeys([*restart_names, *later_names])
    return [name for name in names if name not in CONTROLLERS]


def _make_new_folder(folder: Path, stem: str) -> Path:
    """Create a new folder with an unused name, and return its path; raise an OutputError on failure."""
    while True:
        target = find_free_path(folder, stem, "")
        try:
            target.mkdir(parents=True)
        except FileExistsError:
            # If another program has just created the folder, try the next name. Otherwise, one of its parents
            # is a file or a broken link.
            if not target.exists():
                reason = f"{folder} or a folder above it is a file or a broken link"
                raise OutputError(f"{target}: cannot be created: {reason}") from None
        except OSError as error:
            raise OutputError(f"{target}: cannot be created: {error.strerror or error}") from error
        else:
            return target
