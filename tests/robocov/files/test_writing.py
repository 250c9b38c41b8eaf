"""Writing of files: links, permissions, special files and simultaneous writers."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from robocov.errors import OutputError
from robocov.files.writing import replace_file, resolve_target

posix = pytest.mark.skipif(os.name == "nt", reason="special files of POSIX")


def write_text(target: Path, text: str = "new") -> None:
    with replace_file(target) as part:
        part.write_text(text)


def create_special_file(folder: Path, kind: str) -> Path:
    path = folder / kind
    if kind == "a folder":
        path.mkdir()
    elif kind == "a named pipe":
        os.mkfifo(path)
    elif kind == "a socket":
        os.mknod(path, stat.S_IFSOCK | 0o600)
    else:
        if os.geteuid() != 0:
            pytest.skip("only root makes devices")
        os.mknod(path, stat.S_IFCHR | 0o600, os.makedev(1, 3))
    return path


@posix
@pytest.mark.parametrize("is_link", [False, True])
@pytest.mark.parametrize("kind", ["a folder", "a named pipe", "a socket", "a device"])
def test_special_files_are_rejected(tmp_path: Path, kind: str, *, is_link: bool) -> None:
    path = create_special_file(tmp_path, kind)
    target = path
    mode = path.lstat().st_mode
    if is_link:
        target = tmp_path / "link"
        target.symlink_to(path)
    with pytest.raises(OutputError, match=f"{target}: expected a file, got {kind}"):
        write_text(target)
    assert path.lstat().st_mode == mode
    assert {file.name for file in tmp_path.iterdir()} == {path.name, target.name}


@posix
def test_links_and_permissions_are_kept(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    real = folder / "real.txt"
    link = tmp_path / "link.txt"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    write_text(link)
    assert link.is_symlink() and real.read_text() == "new"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640


@posix
@pytest.mark.parametrize(
    ("target", "message"),
    [("nowhere", "expected a file, got a broken link"), ("link", "cannot be written")],
)
def test_broken_links_are_rejected(tmp_path: Path, target: str, message: str) -> None:
    (tmp_path / "link").symlink_to(tmp_path / target)
    with pytest.raises(OutputError, match=message):
        write_text(tmp_path / "link")
    assert [path.name for path in tmp_path.iterdir()] == ["link"]


def test_two_writers_at_once_do_not_interfere(tmp_path: Path) -> None:
    target = tmp_path / "x.txt"
    with replace_file(target) as first, replace_file(target) as second:
        first.write_text("first")
        second.write_text("second")
    assert target.read_text() == "first", "it finishes last"
    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]


@pytest.mark.parametrize("name", ["n" * 246 + ".json", "." + "n" * 249, "x." + "n" * 240])
def test_the_longest_names_can_be_written(tmp_path: Path, name: str) -> None:
    write_text(tmp_path / name)
    assert (tmp_path / name).read_text() == "new"


@pytest.mark.parametrize("name", ["n" * 256, "no/file", "a\0b"])
def test_impossible_names_are_rejected(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match="cannot be written") as caught:
        write_text(tmp_path / name)
    assert str(caught.value).isprintable()
    assert [path.name for path in tmp_path.iterdir()] == []


def test_the_target_of_a_new_file_is_the_file(tmp_path: Path) -> None:
    assert resolve_target(tmp_path / "new") == tmp_path / "new"
