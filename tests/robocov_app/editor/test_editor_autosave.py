"""Drafts of maps, and their recovery after a crash."""

import json
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pygame
import pytest
from drawn_sketches import HALL
from driven_editor import load_sketch, open_editor

from robocov.environment import CircleObstacle
from robocov.errors import MapError
from robocov_app.editor.edits.create import add_circle
from robocov_app.editor.model.map_draft import KIND, MapDraft, build_draft_content, find_recoverable
from robocov_app.editor.model.map_file import check_file, write_sketch
from robocov_app.editor.model.sketch import Sketch
from robocov_app.storage.autosave import Autosaver, remove_draft

SKETCH = Sketch("Hall", boundary=HALL)


def draw_circles(count: int) -> Sketch:
    return SKETCH.with_obstacles([CircleObstacle((k + 1.0, 1.0), 0.3) for k in range(count)])[0]


def leave_draft(folder: Path, sketch: Sketch, path: Path | None = None, disk=None) -> None:
    autosaver = Autosaver(folder, KIND, path)
    autosaver.save_draft(lambda: build_draft_content(sketch, disk))
    autosaver.close(discard=False)


def test_a_draft_is_recovered_with_the_path_of_its_file(tmp_path):
    path = tmp_path / "hall.json"
    disk = write_sketch(SKETCH, path)
    leave_draft(tmp_path / "drafts", draw_circles(5), path, disk)
    (found,) = find_recoverable(tmp_path / "drafts")
    assert (found.path, found.name, found.obstacles, found.version) == (path, "Hall", 5, disk)
    assert found.read_sketch() == draw_circles(5)
    assert found.describe().startswith("“Hall”, 5 obstacles, today ")
    assert found.describe().endswith("not saved to hall.json")
    assert check_file(found.version) == "same"


def test_a_draft_with_the_content_of_its_file_is_not_offered(tmp_path):
    path = tmp_path / "hall.json"
    disk = write_sketch(draw_circles(3), path)
    leave_draft(tmp_path / "drafts", draw_circles(3), path, disk)
    assert find_recoverable(tmp_path / "drafts") == ()
    write_sketch(draw_circles(4), path, disk)
    assert len(find_recoverable(tmp_path / "drafts")) == 1


def test_a_draft_that_has_been_removed_raises_an_error(tmp_path):
    leave_draft(tmp_path, SKETCH)
    (found,) = find_recoverable(tmp_path)
    assert found.describe().endswith("never saved")
    remove_draft(found.folder)
    with pytest.raises(MapError, match="no such file"):
        found.read_sketch()


def test_drafts_that_are_not_maps_or_have_invalid_versions_are_left_alone(tmp_path):
    leave_draft(tmp_path, SKETCH)
    (file,) = tmp_path.glob("*/draft.json")
    held = json.loads(file.read_text())
    for wrong in ({"sketch": []}, {"path": "x", "disk": 1}, {"path": "x", "disk": {"stamp": [1]}}):
        file.write_text(json.dumps(held | wrong))
        assert find_recoverable(tmp_path) == ()
    file.write_text(json.dumps(held))
    assert len(find_recoverable(tmp_path)) == 1


def test_drafts_describe_their_day():
    now = datetime(2030, 5, 17, 12, 0).astimezone()
    for when, words in [
        (now - timedelta(hours=2), "today 10:00"),
        (now - timedelta(hours=20), "yesterday 16:00"),
        (now - timedelta(days=9), "2030-05-08 12:00"),
    ]:
        found = MapDraft(Path("x"), Path("/maps/hall.json"), "Hall", when, 1, None)
        assert found.describe(now) == f"“Hall”, 1 obstacle, {words}, not saved to hall.json"


@pytest.mark.parametrize("ends", ["killed", "closed"])
def test_changes_during_a_trial_are_in_the_draft(ends, tmp_path):
    drafts = tmp_path / "drafts"
    with open_editor(tmp_path, load_sketch("square"), drafts=drafts) as driver:
        before = len(driver.shapes)
        driver.press_key("f5")
        trial = driver.window.play_mode.window
        session = trial.viewer.session
        circle = CircleObstacle((5.0, 5.0), 0.3)
        obstacles = (*session.displayed.environment.obstacles, circle)
        session.edit_map(replace(session.displayed.environment, obstacles=obstacles), "drawn")
        if ends == "killed":
            driver.window.run_frame(0.1)
        else:
            driver.window.close()
        assert driver.editor.document.flush()
        (file,) = drafts.glob("*/draft.json")
        leave_draft = json.loads(file.read_text())["sketch"]["obstacles"]
        assert len(leave_draft) == before + 1
        if ends == "killed":
            driver.press_key("f5")
            assert driver.shapes[-1] == circle


def test_a_draft_that_cannot_be_saved_is_reported_once(tmp_path):
    with open_editor(tmp_path, drafts=tmp_path / "drafts") as driver:
        driver.editor.document.flush()
        autosaver = driver.editor.document.autosaver
        autosaver.problem = "drafts cannot be saved: disk full"
        driver.run_frames(1)
        assert driver.message == "Drafts cannot be saved: disk full"
        assert driver.editor.has_error_message
        driver.editor.show_message("grid 0.5 m")
        driver.run_frames(2)
        assert driver.message == "Grid 0.5 m"
        driver.editor.clear_message()
        driver.run_frames(2)
        assert driver.message == ""
        for problem in ("", "drafts cannot be saved: disk full"):
            autosaver.problem = problem
            driver.run_frames(1)
        assert driver.message == "Drafts cannot be saved: disk full"


def test_a_file_can_be_opened_after_leaving_for_it_was_canceled(tmp_path):
    write_sketch(SKETCH, tmp_path / "hall.json")
    with open_editor(tmp_path, drafts=tmp_path / "drafts") as driver:
        driver.editor.apply(add_circle(driver.sketch, (5.0, 5.0), 1.0))
        for answer in ("escape", "escape", "d"):
            driver.post(pygame.DROPFILE, file=str(tmp_path / "hall.json"))
            driver.settle()
            assert driver.editor.dialogs.current is not None, driver.message
            driver.press_key(answer)
        assert driver.editor.document.title == "hall.json"
        assert len(list((tmp_path / "drafts").iterdir())) == 1
