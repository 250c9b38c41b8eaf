"""Writing of results that is interrupted, or fails, at one call of the file system after the other.

Call this module as a script with a folder, an outcome and a scenario; it forks. With the outcome ``kill`` the
process ends before the k-th call, for k = 0, 1, ...; with ``fail`` that call fails as on a full disk. The
script prints the contents in which the folder was found after each call, and those after another attempt.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path

from robocov.errors import OutputError
from robocov.files.result_folder import complete_commit, create_result, extend_result

OLD = {
    "run.json": "old",
    "record.npz": "old",
    "run.mp4": "old",
    "frames/000000.png": "old",
    "frames/000001.png": "old",
    "frames/000002.png": "old",
}
NUMBERS = {"run.json": "new", "record.npz": "new"}
NEW = {**NUMBERS, "cost.csv": "new", "frames/000000.png": "new"}
FOREIGN = {"frames/2024-holiday.png": "mine", ".x.part.zip": "mine"}

CALLS = {"os.rename", "os.remove", "os.mkdir", "os.rmdir"}


class ExitStatus(IntEnum):
    """How a process ended that was interrupted, or failed, at a call."""

    TOLERATED = 0
    """The call failed, but the function succeeded."""
    CRASHED = 1
    """The function raised an error that is no OutputError."""
    REPORTED = 2
    """The function raised an OutputError that names the reason of the failed call."""
    MISREPORTED = 3
    """The function raised another OutputError."""
    KILLED = 9
    """The process was ended before the call."""
    COMPLETED = 100
    """The function finished before the call."""


def write_files(folder: Path, files: dict[str, str]) -> None:
    """Write files, given as names and texts; raise OutputError like all functions that write results."""
    try:
        for name, text in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if name == "run.json":
                text = f'{{"format": "robocov-run", "text": "{text}"}}'
            path.write_text(text)
    except OSError as error:
        raise OutputError(str(error)) from error


def read_contents(folder: Path) -> dict[str, str]:
    """Return the names and texts of all files in a folder, except for those that robocov keeps for itself."""
    contents = {}
    for path in folder.rglob("*"):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith(".robocov"):
            text = path.read_text()
            contents[name] = json.loads(text)["text"] if name == "run.json" else text
    return contents


def save_new_result(folder: Path) -> None:
    with create_result(folder, overwrite=True) as result:
        write_files(result.staging, NUMBERS)
        result.save_progress()
        write_files(result.staging, NEW)


def add_metrics(folder: Path) -> None:
    with extend_result(folder) as result:
        write_files(result.staging, {"metrics.csv": "new"})


def prepare_nothing(folder: Path) -> None:
    """Leave the folder empty."""


def prepare_result(folder: Path) -> None:
    """Write a result, and files of the user."""
    with create_result(folder, overwrite=False) as result:
        write_files(result.staging, OLD)
    write_files(folder, FOREIGN)


def prepare_result_without_manifest(folder: Path) -> None:
    """Write a result of a version that wrote no manifest, and files of the user."""
    write_files(folder, {**OLD, **FOREIGN})


SCENARIOS: dict[str, tuple[Callable[[Path], None], Callable[[Path], None]]] = {
    "empty folder": (prepare_nothing, save_new_result),
    "old result": (prepare_result, save_new_result),
    "no manifest": (prepare_result_without_manifest, save_new_result),
    "extension": (prepare_result, add_metrics),
}
"""Functions that prepare the folder, and functions that are interrupted."""


def run_interrupted(act: Callable[[Path], None], folder: Path, k: int, *, fail: bool) -> int:
    """Run a function in a process that ends before its k-th call, or whose k-th call fails.

    Returns
    -------
    int
        Exit status of the process; see `ExitStatus`.
    """
    pid = os.fork()
    if pid:
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    calls = 0

    def count_call(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal calls
        is_writing = (
            event == "open" and isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR)
        )
        if event in CALLS or is_writing:
            calls += 1
            if calls == k + 1:
                if fail:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os._exit(ExitStatus.KILLED)

    sys.addaudithook(count_call)
    status = ExitStatus.CRASHED
    try:
        act(folder)
        status = ExitStatus.TOLERATED if calls > k else ExitStatus.COMPLETED
    except OutputError as error:
        names_reason = os.strerror(errno.ENOSPC) in str(error)
        status = ExitStatus.REPORTED if names_reason else ExitStatus.MISREPORTED
    finally:
        os._exit(status)


def main() -> None:
    folder = Path(sys.argv[1])
    outcome = sys.argv[2]
    prepare, act = SCENARIOS[sys.argv[3]]
    # Power does not fail in this test, and flushing takes most of the time.
    os.fsync = lambda descriptor: None
    states: list[dict[str, str]] = []
    statuses: list[int] = []
    states_after_retry: list[dict[str, str]] = []
    while not statuses or statuses[-1] != ExitStatus.COMPLETED:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        prepare(folder)
        statuses.append(run_interrupted(act, folder, len(statuses), fail=outcome == "fail"))
        if folder.exists():
            complete_commit(folder)
            if read_contents(folder) not in states:
                states.append(read_contents(folder))
        act(folder)
        state = read_contents(folder)
        for path in folder.glob(".robocov*"):
            if path.name != ".robocov.json":
                state[path.name] = "left behind"
        if state not in states_after_retry:
            states_after_retry.append(state)
    print(json.dumps({"states": states, "statuses": statuses, "states_after_retry": states_after_retry}))


if __name__ == "__main__":
    main()
