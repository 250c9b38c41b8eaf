"""Results that are made while one call of the file system after the other is the last, or fails.

Called as a script with a folder, an outcome and a scenario, because it forks: ``kill`` ends the process
before the k-th call, for k = 0, 1, ...; ``fail`` lets that call fail as on a full disk. It prints the states
in which the folder was found after each, and what the result said of itself.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from robocov.errors import OutputError
from robocov.files.result_folder import complete_commit, create_result, extend_result

OLD = {"run.json": "old", "record.npz": "old", "run.mp4": "old"} | {
    f"frames/{k:06d}.png": "old" for k in range(3)
}
NUMBERS = {"run.json": "new", "record.npz": "new"}
NEW = {**NUMBERS, "cost.csv": "new", "frames/000000.png": "new"}
FOREIGN = {"frames/2024-holiday.png": "mine", ".x.part.zip": "mine"}

CALLS = {"os.rename", "os.remove", "os.mkdir", "os.rmdir"}


def write(folder: Path, files: dict[str, str]) -> None:
    try:
        for name, text in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f'{{"format": "robocov-run", "text": "{text}"}}' if name == "run.json" else text)
    except OSError as error:  # as all that writes results does
        raise OutputError(str(error)) from error


def content(folder: Path) -> dict[str, str]:
    """Return what is in a folder, but for what robocov keeps there for itself."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    texts = {name: path.read_text() for name, path in found.items() if not name.startswith(".robocov")}
    return {name: json.loads(text)["text"] if name == "run.json" else text for name, text in texts.items()}


def made(folder: Path) -> None:
    with create_result(folder, overwrite=True) as result:
        write(result.staging, NUMBERS)
        result.save_progress()
        write(result.staging, NEW)


def added(folder: Path) -> None:
    with extend_result(folder) as result:
        write(result.staging, {"metrics.csv": "new"})


def fresh(folder: Path) -> None:
    """There is nothing yet."""


def replaced(folder: Path) -> None:
    """There is a result, and files of somebody else."""
    with create_result(folder, overwrite=False) as result:
        write(result.staging, OLD)
    write(folder, FOREIGN)


def earlier(folder: Path) -> None:
    """There is a result of a version that wrote no manifest, and files of somebody else."""
    write(folder, {**OLD, **FOREIGN})


SCENARIOS: dict[str, tuple[Callable[[Path], None], Callable[[Path], None]]] = {
    "fresh": (fresh, made),
    "replaced": (replaced, made),
    "earlier": (earlier, made),
    "added": (replaced, added),
}


def struck(act: Callable[[Path], None], folder: Path, k: int, *, fail: bool) -> int:
    """Return the status of a process whose k-th call is its last, or fails: 0 when all went well."""
    pid = os.fork()
    if pid:
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    calls = 0

    def hook(event: str, values: tuple[object, ...]) -> None:
        nonlocal calls
        writing = event == "open" and isinstance(values[2], int) and values[2] & (os.O_WRONLY | os.O_RDWR)
        if event in CALLS or writing:
            calls += 1
            if calls == k + 1:
                if fail:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os._exit(9)

    sys.addaudithook(hook)
    status = 1
    try:
        act(folder)
        status = 0
    except OutputError as error:
        status = 2 if os.strerror(errno.ENOSPC) in str(error) else 3
    finally:
        os._exit(status if status != 0 or calls > k else 100)


def main() -> None:
    folder, outcome, scenario = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    before, act = SCENARIOS[scenario]
    os.fsync = lambda descriptor: None  # power does not fail here, and it takes most of the time
    states: list[dict[str, str]] = []
    statuses: list[int] = []
    again: list[dict[str, str]] = []
    while not statuses or statuses[-1] != 100:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        before(folder)
        statuses.append(struck(act, folder, len(statuses), fail=outcome == "fail"))
        if folder.exists():
            complete_commit(folder)
            if content(folder) not in states:
                states.append(content(folder))
        act(folder)
        left = {path.name: "left" for path in folder.glob(".robocov*") if path.name != ".robocov.json"}
        if content(folder) | left not in again:
            again.append(content(folder) | left)
    print(json.dumps({"states": states, "statuses": statuses, "again": again}))


if __name__ == "__main__":
    main()
