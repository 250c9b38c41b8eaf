"""The open document: saving it, changes of its file by other programs, and drafts."""

import json
from pathlib import Path

import pytest
from driven_editor import build_sheet, rewrite_file

from robocov.environment import CircleObstacle
from robocov.errors import MapError, RobocovError
from robocov.mapfile import dump_map, list_bundled_maps, load_map
from robocov_app.editor.edits import create, properties
from robocov_app.editor.model.document import DEFAULT_BOUNDARY, Document
from robocov_app.editor.model.map_draft import find_recoverable
from robocov_app.editor.model.map_file import FileChangedError
from robocov_app.editor.model.selection import Selection

PILLAR = CircleObstacle((5, 5), 1.0)


def add_circle(document: Document, radius: float = 1.0) -> None:
    document.history.apply(create.add_circle(document.history.sketch, (5, 5), radius))
    document.update_draft()


def test_a_new_document_has_a_boundary_and_no_changes(tmp_path: Path) -> None:
    document = Document.new(None)
    assert document.history.sketch.boundary == DEFAULT_BOUNDARY
    assert not document.history.has_unsaved_changes and document.title == "Untitled"
    assert document.suggest_path(tmp_path) == tmp_path / "untitled.json"
    (tmp_path / "untitled.json").write_text("")
    assert document.suggest_path(tmp_path) == tmp_path / "untitled-1.json"


@pytest.mark.parametrize("boundary", [(), ((0.0, 0.0), (0.0, 4.0), (0.0, 8.0))], ids=["empty", "flat"])
def test_a_map_with_a_raster_and_a_boundary_without_extent_can_be_opened(
    tmp_path: Path, boundary: tuple[tuple[float, float], ...]
) -> None:
    path = tmp_path / "flat.json"
    content = json.loads(dump_map(load_map("rooms")))
    content["boundary"] = boundary
    content["density"] = {"kind": "raster", "rows": [[1, 2], [3, 4]]}
    path.write_text(json.dumps(content))
    document = Document.open_file(path, None)
    assert document.history.sketch.boundary == boundary
    assert not document.would_replace_valid_map(path)


def test_a_saved_document_can_be_opened(tmp_path: Path) -> None:
    document = Document.new(None)
    add_circle(document)
    assert document.history.has_unsaved_changes
    words = document.save(tmp_path / "plan")
    assert words == f"saved: {tmp_path / 'plan.json'}" and not document.history.has_unsaved_changes
    again = Document.open_file(tmp_path / "plan.json", None)
    assert again.title == "plan.json" and not again.history.has_unsaved_changes
    assert [item.shape for item in again.history.sketch.obstacles] == [PILLAR]
    assert again.history.sketch.name == document.history.sketch.name == "plan"  # nobody had named it
    document.history.apply(properties.set_title(document.history.sketch, "My plan"))
    document.save(tmp_path / "plan")
    assert load_map(tmp_path / "plan.json").name == "My plan"
    document.history.undo()
    assert document.history.has_unsaved_changes
    document.history.redo()
    assert not document.history.has_unsaved_changes


def test_a_bundled_map_opens_as_a_copy_and_is_never_written(tmp_path: Path) -> None:
    bundled = list_bundled_maps()["rooms"]
    document = Document.open_file(bundled, None)
    assert document.path is None and document.title == "rooms"
    assert document.suggest_path(tmp_path).name == "rooms.json"
    before = bundled.read_bytes()
    with pytest.raises(MapError, match="comes with robocov"):
        document.save(bundled, overwrites=True)
    assert bundled.read_bytes() == before


def test_another_file_is_not_replaced_without_permission(tmp_path: Path) -> None:
    target = tmp_path / "there.json"
    target.write_text("something else")
    document = Document.new(None)
    with pytest.raises(FileChangedError):
        document.save(target)
    assert target.read_text() == "something else"
    document.save(target, overwrites=True)
    assert load_map(target).area == 100.0


def test_a_file_that_changes_is_noticed_once_and_can_be_reloaded_and_undone(tmp_path: Path) -> None:
    document = Document.new(None)
    add_circle(document)
    document.save(tmp_path / "plan.json")
    mine = document.history.sketch
    assert document.check_disk(10.0) == "same"
    other = Document.new(None)
    add_circle(other, 2.0)
    other.save(tmp_path / "other.json")
    rewrite_file(tmp_path / "plan.json", (tmp_path / "other.json").read_text())
    assert document.check_disk(10.5) == "same"  # not asked that often
    assert document.check_disk(12.0) == "changed"
    assert document.check_disk(14.0) == "same"
    assert document.history.has_unsaved_changes
    with pytest.raises(FileChangedError):
        document.save(tmp_path / "plan.json")
    document.reload()
    assert (
        document.history.sketch.obstacles[0].shape.radius == 2.0 and not document.history.has_unsaved_changes
    )
    assert document.history.undo() is not None
    assert document.history.sketch == mine


def test_ignoring_a_change_lets_saving_replace_the_file(tmp_path: Path) -> None:
    document = Document.new(None)
    add_circle(document)
    document.save(tmp_path / "plan.json")
    rewrite_file(tmp_path / "plan.json", "{}")
    assert document.check_disk(10.0) == "changed"
    document.ignore_disk_change()
    document.save(tmp_path / "plan.json")
    assert len(load_map(tmp_path / "plan.json").obstacles) == 1


def test_a_removed_file_is_noticed(tmp_path: Path) -> None:
    document = Document.new(None)
    document.save(tmp_path / "plan.json")
    (tmp_path / "plan.json").unlink()
    assert document.check_disk(10.0) == "gone" and document.history.has_unsaved_changes
    document.save(tmp_path / "plan.json", overwrites=True)
    assert (tmp_path / "plan.json").exists()


def test_a_draft_is_recovered_and_removed_by_saving(tmp_path: Path) -> None:
    drafts = tmp_path / "drafts"
    document = Document(build_sheet(), drafts)
    add_circle(document)
    document.flush()
    assert find_recoverable(drafts) == ()  # its editor lives
    document.close(discard=False)
    (draft,) = find_recoverable(drafts)
    again = Document.recover(draft, drafts)
    assert again.history.has_unsaved_changes and [item.shape for item in again.history.sketch.obstacles] == [
        PILLAR
    ]
    again.save(tmp_path / "plan.json")
    again.flush()
    again.close(discard=False)
    assert find_recoverable(drafts) == ()


def test_an_unwritable_folder_is_reported(tmp_path: Path) -> None:
    document = Document.new(None)
    with pytest.raises(RobocovError, match="no-such-folder"):
        document.save(tmp_path / "no-such-folder" / "plan.json")
    assert not document.history.has_unsaved_changes
    assert document.autosaver.problem == ""


def test_naming_a_map_on_saving_preserves_redo(tmp_path):
    document = Document.new(None)
    add_circle(document)
    add_circle(document, 2.0)
    document.history.undo()
    document.save(tmp_path / "plan.json")
    assert document.history.sketch.name == "plan" and not document.history.has_unsaved_changes
    assert document.history.redo() is not None
    assert len(document.history.sketch.obstacles) == 2 and document.history.sketch.name == "plan"
    document.history.undo()
    assert not document.history.has_unsaved_changes
    document.history.undo()
    assert document.history.sketch.name == "plan"


def test_a_file_with_a_long_or_strange_name_names_its_map_as_far_as_it_can(tmp_path):
    document = Document.new(None)
    document.save(tmp_path / ("a\tb" + 150 * "x"))
    assert document.history.sketch.name == "a b" + 97 * "x"


def test_an_invalid_map_would_replace_a_valid_one(tmp_path):
    document = Document.new(None)
    document.save(tmp_path / "plan.json")
    assert not document.would_replace_valid_map(tmp_path / "plan")
    document.history.apply(properties.delete(document.history.sketch, Selection(boundary=True)))
    assert document.would_replace_valid_map(tmp_path / "plan") and not document.would_replace_valid_map(
        tmp_path / "new.json"
    )
    document.save(tmp_path / "plan.json")
    assert not document.would_replace_valid_map(tmp_path / "plan"), "there is nothing more to be lost"
