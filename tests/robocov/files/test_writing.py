from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from robocov.errors import OutputError
from robocov.files.writing import replace_file, resolve_target

posix = pytest.mark.skipif(os.name == "nt", reason="special files of POSIX")


def put(target: Path, text: str = "new") -> None:
    with replace_file(target) as part:
        part.write_text(text)


def special(folder: Path, kind: str) -> Path:
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
@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("kind", ["a folder", "a named pipe", "a socket", "a device"])
def test_what_is_no_file_is_refused_before_anything_is_made(
    tmp_path: Path, kind: str, *, linked: bool
) -> None:
    target = path = special(tmp_path, kind)
    before = path.lstat().st_mode
    if linked:
        target = tmp_path / "link"
        target.symlink_to(path)
    with pytest.raises(OutputError, match=f"{target}: expected a file, got {kind}"):
        put(target)
    assert path.lstat().st_mode == before
    assert {each.name for each in tmp_path.iterdir()} == {path.name, target.name}


@posix
def test_a_link_to_a_file_stays_and_so_do_the_permissions_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "real.txt", tmp_path / "link.txt"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    put(link)
    assert link.is_symlink() and real.read_text() == "new"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640


@posix
@pytest.mark.parametrize(
    ("to", "words"), [("nowhere", "expected a file, got a link to nothing"), ("link", "cannot be written")]
)
def test_a_link_that_leads_nowhere_is_refused(tmp_path: Path, to: str, words: str) -> None:
    (tmp_path / "link").symlink_to(tmp_path / to)
    with pytest.raises(OutputError, match=words):
        put(tmp_path / "link")
    assert [path.name for path in tmp_path.iterdir()] == ["link"]


def test_two_writers_at_once_do_not_meet(tmp_path: Path) -> None:
    target = tmp_path / "x.txt"
    with replace_file(target) as one, replace_file(target) as two:
        one.write_text("one")
        two.write_text("two")
    assert target.read_text() == "one", "the last to finish"
    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]


@pytest.mark.parametrize("name", ["n" * 246 + ".json", "." + "n" * 249, "x." + "n" * 240])
def test_the_longest_names_can_be_written(tmp_path: Path, name: str) -> None:
    put(tmp_path / name)
    assert (tmp_path / name).read_text() == "new"


@pytest.mark.parametrize("name", ["n" * 256, "no/file", "a\0b"])
def test_names_that_there_cannot_be_are_one_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match="cannot be written") as caught:
        put(tmp_path / name)
    assert str(caught.value).isprintable()
    assert [path.name for path in tmp_path.iterdir()] == []


def test_a_new_file_is_written_where_its_name_says(tmp_path: Path) -> None:
    assert resolve_target(tmp_path / "new") == tmp_path / "new"
