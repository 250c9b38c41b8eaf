"""Folders of caches: their location, and permissions that are too wide."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from robocov.files.array_files import ArrayCache
from robocov.files.cache_folders import find_cache_root, is_private, open_private_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows keeps users apart by itself")


def test_environment_variable_names_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path))
    assert find_cache_root() == tmp_path
    monkeypatch.setenv("ROBOCOV_CACHE", "")
    assert find_cache_root() is None


def test_new_folder_is_private(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    assert open_private_folder(folder) == folder
    assert folder.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("mode", [0o720, 0o702])
def test_folders_that_others_may_write_to_are_rejected(tmp_path: Path, mode: int) -> None:
    folder = tmp_path / "cache"
    folder.mkdir()
    folder.chmod(mode)
    assert open_private_folder(folder) is None


def test_folders_that_others_may_replace_are_rejected(tmp_path: Path) -> None:
    folder = tmp_path / "shared" / "cache"
    folder.mkdir(parents=True, mode=0o700)
    assert is_private(folder)
    folder.parent.chmod(0o777)
    assert not is_private(folder)
    folder.parent.chmod(0o1777)  # as /tmp: entries can be renamed by their owners only
    assert is_private(folder)


@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() != 0, reason="only root gives files away")
def test_folders_of_another_user_are_rejected(tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    os.chown(folder, 12345, -1)
    assert open_private_folder(folder) is None


def test_cached_arrays_that_others_may_write_count_as_missing(tmp_path: Path) -> None:
    cache = ArrayCache(tmp_path)
    cache.save("key", {"values": np.arange(3)})
    (entry,) = tmp_path.iterdir()
    assert cache.load("key") is not None
    entry.chmod(0o666)
    assert cache.load("key") is None
