"""The document that is open: saved, changed behind its back, kept aside."""

from pathlib import Path

import pytest
from driven_editor import sheet, touched

from robocov.environment import CircleObstacle
from robocov.errors import MapError, RobocovError
from robocov.mapfile import bundled_maps, load_map
from robocov_app.editor.edits import edits
from robocov_app.editor.model.drafts import left_behind
from robocov_app.editor.model.files import ChangedError
from robocov_app.editor.model.paper import FIRST_SHEET, Paper

PILLAR = CircleObstacle((5, 5), 1.0)


def changed(paper: Paper, radius: float = 1.0) -> None:
    paper.history.do(edits.circle_drawn(paper.history.sketch, (5, 5), radius))
    paper.keep()


def test_a_new_sheet_offers_a_boundary_and_loses_nothing(tmp_path: Path) -> None:
    paper = Paper.new(None)
    assert paper.history.sketch.boundary == FIRST_SHEET
    assert not paper.unsaved and paper.title == "Untitled"
    assert paper.suggested(tmp_path) == tmp_path / "untitled.json"
    (tmp_path / "untitled.json").write_text("")
    assert paper.suggested(tmp_path) == tmp_path / "untitled-1.json"


def test_saving_and_opening_again(tmp_path: Path) -> None:
    paper = Paper.new(None)
    changed(paper)
    assert paper.unsaved
    words = paper.save(tmp_path / "plan")
    assert words == f"saved: {tmp_path / 'plan.json'}" and not paper.unsaved
    again = Paper.opened(tmp_path / "plan.json", None)
    assert again.title == "plan.json" and not again.unsaved
    assert [item.shape for item in again.history.sketch.obstacles] == [PILLAR]
    assert again.history.sketch.name == paper.history.sketch.name == "plan"  # nobody had named it
    paper.history.do(edits.titled(paper.history.sketch, "My plan"))
    paper.save(tmp_path / "plan")
    assert load_map(tmp_path / "plan.json").name == "My plan"
    paper.history.undo()
    assert paper.unsaved
    paper.history.redo()
    assert not paper.unsaved


def test_a_bundled_map_opens_as_a_copy_and_is_never_written(tmp_path: Path) -> None:
    bundled = bundled_maps()["rooms"]
    paper = Paper.opened(bundled, None)
    assert paper.path is None and paper.title == "rooms"
    assert paper.suggested(tmp_path).name == "rooms.json"
    before = bundled.read_bytes()
    with pytest.raises(MapError, match="comes with robocov"):
        paper.save(bundled, over=True)
    assert bundled.read_bytes() == before


def test_another_file_is_not_replaced_unasked(tmp_path: Path) -> None:
    target = tmp_path / "there.json"
    target.write_text("something else")
    paper = Paper.new(None)
    with pytest.raises(ChangedError):
        paper.save(target)
    assert target.read_text() == "something else"
    paper.save(target, over=True)
    assert load_map(target).area == 100.0


def test_a_file_that_changes_is_noticed_once_and_can_be_reloaded_and_undone(tmp_path: Path) -> None:
    paper = Paper.new(None)
    changed(paper)
    paper.save(tmp_path / "plan.json")
    mine = paper.history.sketch
    assert paper.look(10.0) == "same"
    other = Paper.new(None)
    changed(other, 2.0)
    other.save(tmp_path / "other.json")
    touched(tmp_path / "plan.json", (tmp_path / "other.json").read_text())
    assert paper.look(10.5) == "same"  # not asked that often
    assert paper.look(12.0) == "changed"
    assert paper.look(14.0) == "same"
    assert paper.unsaved
    with pytest.raises(ChangedError):
        paper.save(tmp_path / "plan.json")
    paper.reload()
    assert paper.history.sketch.obstacles[0].shape.radius == 2.0 and not paper.unsaved
    assert paper.history.undo() is not None
    assert paper.history.sketch == mine


def test_keeping_mine_lets_saving_replace_what_is_there(tmp_path: Path) -> None:
    paper = Paper.new(None)
    changed(paper)
    paper.save(tmp_path / "plan.json")
    touched(tmp_path / "plan.json", "{}")
    assert paper.look(10.0) == "changed"
    paper.keep_mine()
    paper.save(tmp_path / "plan.json")
    assert len(load_map(tmp_path / "plan.json").obstacles) == 1


def test_a_file_that_goes_is_noticed(tmp_path: Path) -> None:
    paper = Paper.new(None)
    paper.save(tmp_path / "plan.json")
    (tmp_path / "plan.json").unlink()
    assert paper.look(10.0) == "gone" and paper.unsaved
    paper.save(tmp_path / "plan.json", over=True)
    assert (tmp_path / "plan.json").exists()


def test_a_draft_is_kept_and_recovered_and_saving_takes_it_away(tmp_path: Path) -> None:
    drafts = tmp_path / "drafts"
    paper = Paper(sheet(), drafts)
    changed(paper)
    paper.flush()
    assert left_behind(drafts) == ()  # its editor lives
    paper.close(discard=False)
    (draft,) = left_behind(drafts)
    again = Paper.recovered(draft, drafts)
    assert again.unsaved and [item.shape for item in again.history.sketch.obstacles] == [PILLAR]
    again.save(tmp_path / "plan.json")
    again.flush()
    again.close(discard=False)
    assert left_behind(drafts) == ()


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    paper = Paper.new(None)
    with pytest.raises(RobocovError, match="no-such-folder"):
        paper.save(tmp_path / "no-such-folder" / "plan.json")
    assert not paper.unsaved
    assert paper.trouble == ""
