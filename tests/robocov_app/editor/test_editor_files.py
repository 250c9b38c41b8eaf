"""Map files of the editor: saving, changes by other programs, and unreadable files."""

import os
import stat
import sys

import pytest
from drawn_sketches import HALL, drafts, renumber
from hypothesis import HealthCheck, given, settings
from property_examples import count_examples

from robocov.environment import CircleObstacle
from robocov.errors import MapError, OutputError
from robocov.mapfile import load_map
from robocov_app.editor.model import document
from robocov_app.editor.model.map_file import FileChangedError, check_file, read_sketch, write_sketch
from robocov_app.editor.model.sketch import Sketch, dump_sketch

SKETCH = Sketch("Hall", boundary=HALL)


@settings(max_examples=count_examples(30), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(drafts())
def test_a_saved_sketch_can_be_read(tmp_path, sketch):
    path = tmp_path / "draft.json"
    write_sketch(sketch, path, overwrites=True)
    again, disk = read_sketch(path)
    assert again == sketch
    assert check_file(disk) == "same"
    assert [file.name for file in tmp_path.iterdir()] == ["draft.json"]


def test_a_valid_sketch_can_be_loaded(tmp_path):
    write_sketch(SKETCH, tmp_path / "map.json")
    assert load_map(tmp_path / "map.json") == SKETCH.build_environment()


def test_an_existing_file_is_not_overwritten_without_permission(tmp_path):
    path = tmp_path / "map.json"
    path.write_text("precious")
    with pytest.raises(FileChangedError, match="this file already exists"):
        write_sketch(SKETCH, path)
    assert path.read_text() == "precious"
    disk = write_sketch(SKETCH, path, overwrites=True)
    assert write_sketch(SKETCH, path, disk).digest == disk.digest
    # The known state of one file does not allow overwriting another file.
    (tmp_path / "other.json").write_text("precious")
    with pytest.raises(FileChangedError):
        write_sketch(SKETCH, tmp_path / "other.json", disk)


def test_changes_on_disk_are_noticed(tmp_path):
    path = tmp_path / "map.json"
    disk = write_sketch(SKETCH, path)
    assert check_file(disk) == "same"
    os.utime(path, ns=(1, 1))
    assert check_file(disk) == "same", "merely touched"
    text = path.read_text()
    path.write_text(text.replace("12", "13"))
    assert check_file(disk) == "changed", "of the same length"
    with pytest.raises(FileChangedError, match="changed by another program"):
        write_sketch(SKETCH, path, disk)
    path.unlink()
    assert check_file(disk) == "gone"
    # A removed file can be written again.
    assert check_file(write_sketch(SKETCH, path, disk)) == "same"


def test_two_windows_on_one_file_do_not_overwrite_each_other(tmp_path):
    path = tmp_path / "map.json"
    write_sketch(SKETCH, path)
    first, disk_of_first = read_sketch(path)
    second, disk_of_second = read_sketch(path)
    one, _ = first.with_obstacles([CircleObstacle((1.0, 1.0), 0.5)])
    other, _ = second.with_obstacles([CircleObstacle((2.0, 2.0), 0.5)])
    disk_of_first = write_sketch(one, path, disk_of_first)
    with pytest.raises(FileChangedError):
        write_sketch(other, path, disk_of_second)
    assert read_sketch(path)[0] == renumber(one)
    write_sketch(other, path, disk_of_second, overwrites=True)
    assert check_file(disk_of_first) == "changed"


@pytest.mark.skipif(sys.platform == "win32", reason="links and modes")
def test_writing_preserves_links_and_modes(tmp_path):
    target = tmp_path / "target.json"
    write_sketch(SKETCH, target)
    target.chmod(0o640)
    link = tmp_path / "link.json"
    link.symlink_to(target)
    sketch, disk = read_sketch(link)
    write_sketch(sketch.with_obstacles([CircleObstacle((1.0, 1.0), 0.5)])[0], link, disk)
    assert link.is_symlink()
    assert len(read_sketch(target)[0].obstacles) == 1
    assert stat.S_IMODE(target.stat().st_mode) == 0o640


def test_a_failed_write_leaves_the_file_unchanged(tmp_path, monkeypatch):
    path = tmp_path / "map.json"
    disk = write_sketch(SKETCH, path)
    before = path.read_bytes()

    def fail_as_disk_is_full(self, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", fail_as_disk_is_full)
    with pytest.raises(OutputError, match=r"map\.json: cannot be written: No space left"):
        write_sketch(SKETCH.with_obstacles([CircleObstacle((1.0, 1.0), 0.5)])[0], path, disk)
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["map.json"]
    for bad in (tmp_path, tmp_path / "none" / "map.json", tmp_path / "map.json" / "x.json"):
        with pytest.raises(OutputError) as caught:
            write_sketch(SKETCH, bad, overwrites=True)
        assert "\n" not in str(caught.value)
    with pytest.raises(OutputError):
        write_sketch(SKETCH, tmp_path / "a\0b.json")


def test_unreadable_files_raise_a_map_error(tmp_path):
    with pytest.raises(MapError, match="no such file"):
        read_sketch(tmp_path / "none.json")
    (tmp_path / "not.json").write_text("{")
    with pytest.raises(MapError, match=r"not.json:1:2: .*not JSON"):
        read_sketch(tmp_path / "not.json")


def test_paths_are_absolute(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    disk = write_sketch(SKETCH, document.Path("map.json"))
    assert disk.path.is_absolute()
    monkeypatch.chdir(tmp_path.parent)
    assert check_file(disk) == "same"
    assert disk.path.read_text() == dump_sketch(SKETCH)
