"""The folder of a served window: preparing it, and confining the process to it."""

import tempfile
from pathlib import Path

import pytest

from robocov.compiled import open_cache_folder
from robocov.errors import InputError, RobocovError
from robocov.mapfile import load_map
from robocov_app.cli import main
from robocov_app.web.confined import OutsideError, confine_files
from robocov_app.web.files import prepare_folder


def test_the_folder_is_created_with_its_parents(tmp_path):
    prepare_folder(tmp_path / "a/b")
    assert list((tmp_path / "a/b").iterdir()) == []


@pytest.mark.parametrize("name", ["file", "file/inside"])
def test_a_file_is_rejected_as_the_folder(tmp_path, name):
    (tmp_path / "file").write_text("")
    message = r"^--folder: .*file.*: not a folder; choose another --folder$"
    with pytest.raises(InputError, match=message):
        prepare_folder(tmp_path / name)


def test_a_folder_that_cannot_be_written_to_is_rejected():
    with pytest.raises(InputError, match=r"^--folder: /proc/robocov.*cannot be written to: "):
        prepare_folder(Path("/proc/robocov"))


@pytest.mark.parametrize("command", ["demo", "edit"])
@pytest.mark.parametrize("options", [[], ["--each"]])
def test_an_unusable_folder_is_reported_in_one_line_at_the_start(tmp_path, capsys, command, options):
    pytest.importorskip("websockets")
    (tmp_path / "file").write_text("")
    assert main([command, "--serve", *options, "--folder", str(tmp_path / "file")]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("robocov: error: --folder: ")
    assert printed.err.count("\n") == 1


def test_a_confined_process_reads_and_writes_files_of_its_folder(folder):
    (folder / "own.json").write_text("{}")
    with confine_files(folder):
        assert (folder / "own.json").read_text() == "{}"
        (folder / "new").mkdir()
        (folder / "new/other.json").write_text("{}")


def test_a_confined_process_reads_bundled_maps_and_writes_temporary_files(folder):
    with confine_files(folder):
        load_map("rooms")
        with tempfile.TemporaryDirectory() as temporary:
            (Path(temporary) / "part").write_text("")


def test_a_confined_process_writes_the_caches_of_kernels_and_arrays(tmp_path, folder, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setenv("ROBOCOV_CACHE", str(tmp_path / "arrays"))
    open_cache_folder.cache_clear()
    try:
        kernels = open_cache_folder()
        with confine_files(folder):
            (tmp_path / "arrays").mkdir()
            for cache in (kernels, tmp_path / "arrays"):
                (cache / "entry").write_text("")
    finally:
        open_cache_folder.cache_clear()


@pytest.mark.parametrize(
    ("path", "actions"),
    [
        ("outside.json", ("read_text", "write_text", "unlink", "mkdir")),
        ("served/../outside.json", ("read_text", "write_text", "unlink", "mkdir")),
        ("~/x", ("read_text", "write_text", "unlink", "mkdir")),
        ("served/link.json", ("read_text", "write_text", "mkdir")),  # The link itself may be removed.
    ],
)
def test_a_confined_process_cannot_use_files_outside_its_folder(tmp_path, folder, path, actions):
    (tmp_path / "outside.json").write_text("{}")
    (folder / "link.json").symlink_to(tmp_path / "outside.json")
    target = tmp_path / Path(path).expanduser()
    with confine_files(folder):
        for action in actions:
            arguments = ["1"] if action == "write_text" else []
            with pytest.raises(OutsideError, match="outside the served folder"):
                getattr(target, action)(*arguments)
    assert (tmp_path / "outside.json").read_text() == "{}"


def test_a_confined_process_cannot_list_or_move_to_other_folders(tmp_path, folder):
    (folder / "own.json").write_text("{}")
    with confine_files(folder):
        with pytest.raises(OutsideError):
            list(tmp_path.iterdir())
        with pytest.raises(OutsideError):
            (folder / "own.json").rename(tmp_path / "x")


def test_a_confined_process_cannot_load_maps_outside_its_folder(tmp_path, folder):
    (tmp_path / "outside.json").write_text("{}")
    with confine_files(folder), pytest.raises(RobocovError, match="outside"):
        load_map(tmp_path / "outside.json")


def test_confinements_can_be_nested(tmp_path, folder):
    with confine_files(folder):
        with confine_files(folder), pytest.raises(OutsideError):
            (tmp_path / "inner").mkdir()
        with pytest.raises(OutsideError):
            (tmp_path / "outer").mkdir()


def test_files_and_the_temporary_folder_are_as_before_after_a_confinement(tmp_path, folder):
    previous = tempfile.gettempdir()
    with confine_files(folder):
        temporary_folder = Path(tempfile.gettempdir())
        assert temporary_folder != Path(previous)
    assert tempfile.gettempdir() == previous
    assert not temporary_folder.exists()
    (tmp_path / "later").mkdir()
