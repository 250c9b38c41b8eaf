"""Paths that are not regular files, and files that are too large, are rejected before they are read."""

import os
from pathlib import Path

import pytest

from robocov.errors import MapError
from robocov_app.formats import files


def test_heads_and_contents_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"x" * (files.HEAD_BYTES + 10))
    assert len(files.read_head(path)) == files.HEAD_BYTES
    assert files.read_content(path) == b"x" * (files.HEAD_BYTES + 10)
    assert files.read_content(path, files.HEAD_BYTES + 10) == b"x" * (files.HEAD_BYTES + 10)
    with pytest.raises(MapError, match=r"a\.bin: expected at most 1 MB, got more"):
        files.read_content(path, 1_000_000)


def test_other_paths_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, expected in (
        (tmp_path / "none", "no such file"),
        (tmp_path, "expected a file, got a folder"),
        (tmp_path / "pipe", "expected a file, got a pipe or a device"),
        (Path("/dev/zero"), "expected a file, got a pipe or a device"),
        (tmp_path / "nul\0", "cannot be read"),
        (tmp_path / ("long" * 100), "cannot be read"),
    ):
        for read in (files.read_head, files.read_content):
            with pytest.raises(MapError) as caught:
                read(path)
            assert expected in str(caught.value)
            assert "\n" not in str(caught.value)


def test_the_size_is_checked_before_the_content(tmp_path: Path) -> None:
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(MapError, match="expected at most 256 MB, got more"):
        files.read_content(path)


def test_limits_are_checked() -> None:
    files.require_cells(8000, 8000, "grid")
    for width, height in ((0, 5), (5, -1)):
        with pytest.raises(MapError, match="expected at least 1 x 1 cells, got"):
            files.require_cells(width, height, "grid")
    with pytest.raises(MapError, match="expected at most 64 million"):
        files.require_cells(10**9, 10**9, "grid")
    files.require_vertices(files.MAX_VERTICES, "grid")
    with pytest.raises(MapError, match="got about 500001"):
        files.require_vertices(files.MAX_VERTICES + 1, "grid")
    files.require_length(0.05, "resolution")
    files.require_coordinate(-1e7, "origin")
    for bad in (float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e5):
        with pytest.raises(MapError, match=r"^resolution: expected a number from 0.000001 to 10000 \(m\)"):
            files.require_length(bad, "resolution")
    for bad in (float("nan"), float("inf"), 1.1e7):
        with pytest.raises(MapError, match=r"^origin: "):
            files.require_coordinate(bad, "origin")
