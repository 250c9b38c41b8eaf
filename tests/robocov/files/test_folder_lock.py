"""Locks of folders against other processes."""

from __future__ import annotations

import errno
import subprocess
import sys
from pathlib import Path

import filelock
import pytest

from robocov.errors import OutputError
from robocov.files.folder_lock import lock_folder

TRY_TO_LOCK = """
import sys
from pathlib import Path
from robocov.errors import OutputError
from robocov.files.folder_lock import lock_folder
try:
    with lock_folder(Path(sys.argv[1])):
        print("locked")
except OutputError as error:
    print(error)
"""


def lock_in_another_process(folder: Path) -> str:
    return subprocess.run(
        [sys.executable, "-c", TRY_TO_LOCK, folder], capture_output=True, text=True, check=True
    ).stdout.strip()


def test_a_folder_is_locked_for_other_processes_until_the_block_ends(tmp_path: Path) -> None:
    with lock_folder(tmp_path):
        assert lock_in_another_process(tmp_path) == (
            f"{tmp_path}: another process is using this folder; wait until it has ended"
        )
    assert lock_in_another_process(tmp_path) == "locked"


def test_a_folder_is_locked_for_the_same_process_too(tmp_path: Path) -> None:
    with (
        lock_folder(tmp_path),
        pytest.raises(OutputError, match="another process is using"),
        lock_folder(tmp_path),
    ):
        pass


def test_the_lock_file_can_be_removed_at_the_end(tmp_path: Path) -> None:
    with lock_folder(tmp_path, ".mine", remove=True):
        assert (tmp_path / ".mine").exists()
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_explained_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written to"), lock_folder(tmp_path / "file"):
        pass


@pytest.mark.parametrize("error", [OSError(errno.ENOLCK, "No locks available"), NotImplementedError()])
def test_file_systems_without_locks_can_be_used(
    tmp_path: Path, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(lock: filelock.FileLock) -> None:
        raise error

    monkeypatch.setattr(filelock.FileLock, "acquire", fail)
    with lock_folder(tmp_path):
        (tmp_path / "result").write_text("")
