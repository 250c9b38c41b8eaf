"""Commands for files of the editor: opening, saving and closing, with their questions; and the launch."""

import json
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pygame
import pytest
from command_calls import read_error
from drawn_sketches import renumber
from driven_editor import EditorDriver, build_sheet, open_editor, rewrite_file
from PIL import Image

from robocov.environment import CircleObstacle, PolygonObstacle
from robocov.errors import InputError, MapError
from robocov.mapfile import load_map, save_map
from robocov_app.cli import main
from robocov_app.editor.edits import create
from robocov_app.editor.edits.properties import set_background
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.map_draft import find_recoverable
from robocov_app.editor.ui.file_commands import set_background_file
from robocov_app.editor.ui.importing.dialog import ImportDialog
from robocov_app.editor.ui.launch import EditorLauncher, offer_recovery
from robocov_app.editor.ui.typed_commands import run_typed_command
from robocov_app.editor.ui.window import EditorWindow
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS
from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.dialogs import Choice, Question


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(
        tmp_path, build_sheet(CircleObstacle((5, 5), 1.0)), drafts=tmp_path / "drafts"
    ) as driver:
        yield driver


def get_dialog_title(driver: EditorDriver) -> str:
    return driver.editor.dialogs.current.title if driver.editor.dialogs.current is not None else ""


def test_saving_asks_for_a_name_once(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("ctrl+s")
    assert get_dialog_title(driver) == "Save as" and driver.editor.dialogs.current.text == "untitled.json"
    driver.press_key("ctrl+a")
    driver.type("plan")
    driver.press_key("return")
    assert driver.editor.dialogs.current is None and load_map(tmp_path / "plan.json").obstacles
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+s")
    assert driver.editor.dialogs.current is None and len(load_map(tmp_path / "plan.json").obstacles) == 2
    assert driver.editor.recent == [str(tmp_path / "plan.json")]


def test_another_file_is_replaced_only_after_confirmation(driver: EditorDriver, tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text("{}")
    driver.press_key("ctrl+shift+s")
    driver.press_key("ctrl+a")
    driver.type("mine.json")
    driver.press_key("return")
    assert get_dialog_title(driver) == "Replace the file?"
    driver.press_key("escape")
    assert (tmp_path / "mine.json").read_text() == "{}"
    driver.press_key("ctrl+shift+s")
    driver.press_key("ctrl+a")
    driver.type("mine.json")
    driver.press_key("return")
    driver.press_key("r")
    assert load_map(tmp_path / "mine.json").obstacles


def test_an_invalid_map_is_saved_as_a_draft(driver: EditorDriver, tmp_path: Path) -> None:
    driver.editor.apply(create.add_polygon(driver.sketch, ((2, 2), (4, 4), (4, 2), (2, 4))))
    driver.window.run_frame(0.0)
    driver.press_key("ctrl+s")
    driver.press_key("return")
    assert "as a draft" in driver.message
    assert Document.open_file(tmp_path / "untitled.json", None).history.sketch == renumber(driver.sketch)


def test_a_missing_folder_is_reported_and_nothing_is_lost(driver: EditorDriver) -> None:
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+s")
    driver.press_key("ctrl+a")
    driver.type("nowhere/plan.json")
    driver.press_key("return")
    assert "nowhere" in driver.read_dialog_error() and driver.editor.document.history.has_unsaved_changes


def test_leaving_unsaved_work_asks_to_save_discard_or_stay(driver: EditorDriver, tmp_path: Path) -> None:
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+n")
    assert get_dialog_title(driver) == "Save the changes?"
    driver.press_key("escape")
    assert len(driver.shapes) == 2
    driver.post(pygame.QUIT)
    driver.settle()
    assert get_dialog_title(driver) == "Save the changes?" and not driver.window.closed
    driver.press_key("s")
    assert get_dialog_title(driver) == "Save as"
    driver.press_key("return")
    assert driver.window.closed and (tmp_path / "untitled.json").exists()


def test_discarding_removes_the_draft_and_keeps_files(driver: EditorDriver, tmp_path: Path) -> None:
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+n")
    driver.press_key("d")
    assert driver.shapes == [] and driver.editor.document.title == "Untitled"
    assert driver.message.startswith("New map, 10 m × 10 m")
    assert find_recoverable(tmp_path / "drafts") == ()


def test_answers_can_be_clicked(driver: EditorDriver) -> None:
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+n")
    driver.click_answer("Cancel")
    assert driver.editor.dialogs.current is None and len(driver.shapes) == 2
    driver.press_key("ctrl+n")
    driver.click_answer("Discard")
    assert driver.shapes == []


def test_maps_bundled_maps_and_other_files_can_be_opened(driver: EditorDriver, tmp_path: Path) -> None:
    save_map(load_map("l-shape"), tmp_path / "ell.json")
    driver.press_key("ctrl+o")
    assert isinstance(driver.editor.dialogs.current, Choice)
    driver.type("ell")
    driver.press_key("tab")
    driver.press_key("return")
    assert driver.editor.document.path == tmp_path / "ell.json" and "Opened: ell.json" in driver.message
    driver.press_key("ctrl+shift+o")
    assert isinstance(driver.editor.dialogs.current, Choice)
    driver.type("rooms")
    driver.press_key("return")
    obstacle_count = len(load_map("rooms").obstacles)
    assert driver.editor.document.path is None and len(driver.shapes) == obstacle_count
    driver.press_key("ctrl+o")
    driver.type("missing.txt")
    driver.press_key("return")
    assert "missing.txt" in driver.read_dialog_error() and len(driver.shapes) == obstacle_count
    (tmp_path / "bad.json").write_text('{"format": "robocov-map", "version": 1, "name": 3}')
    driver.press_key("ctrl+o")
    driver.type("bad.json")
    driver.press_key("return")
    assert "bad.json" in driver.read_dialog_error() and len(driver.shapes) == obstacle_count


def test_a_file_that_changed_can_be_reloaded_or_kept(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("ctrl+s")
    driver.press_key("return")
    path = tmp_path / "untitled.json"
    document = json.loads(path.read_text())
    document["obstacles"] = []
    rewrite_file(path, json.dumps(document))
    driver.window.run_frame(2.0)
    driver.window.run_frame(2.0)
    assert get_dialog_title(driver) == "The file has changed"
    driver.press_key("r")
    assert driver.shapes == [] and not driver.editor.document.history.has_unsaved_changes
    driver.press_key("ctrl+z")
    assert len(driver.shapes) == 1
    rewrite_file(path, json.dumps({**document, "name": "Again"}))
    driver.window.run_frame(2.0)
    driver.window.run_frame(2.0)
    driver.press_key("k")
    assert len(driver.shapes) == 1 and driver.editor.document.history.has_unsaved_changes
    driver.press_key("ctrl+s")
    assert len(load_map(path).obstacles) == 1
    driver.post(pygame.DROPFILE, file=str(path))
    driver.settle()
    assert driver.message == "Reloaded: untitled.json"
    path.unlink()
    driver.window.run_frame(2.0)
    driver.window.run_frame(2.0)
    assert "no longer exists" in driver.message


def test_a_background_that_cannot_be_read_is_reported(driver: EditorDriver, tmp_path: Path) -> None:
    def open_background(path: Path) -> str:
        with pytest.raises(MapError) as caught:
            set_background_file(driver.editor, path)
        return str(caught.value)

    path = tmp_path / "plan.png"
    assert open_background(path) == f"{path}: cannot be read: No such file or directory"
    path.write_text("not an image")
    assert open_background(path) == f"{path}: cannot be read as an image"
    Image.new("RGB", (400, 200)).save(path)
    path.write_bytes(path.read_bytes()[:30])
    assert open_background(path) == f"{path}: cannot be read as an image"
    assert open_background(tmp_path).startswith(f"{tmp_path}: cannot be read: ")
    assert driver.sketch.background is None


def test_the_path_of_a_picture_is_relative_to_the_map(driver: EditorDriver, tmp_path: Path) -> None:
    Image.new("RGB", (400, 200)).save(tmp_path / "plan.png")
    driver.press_key("ctrl+s")
    driver.press_key("return")
    driver.press_key("ctrl+b")
    driver.type("plan.png")
    driver.press_key("return")
    assert driver.sketch.background.path == "plan.png"
    (tmp_path / "no.png").write_text("no picture")
    driver.press_key("ctrl+b")
    driver.type("no.png")
    driver.press_key("return")
    assert "cannot be read as an image" in driver.read_dialog_error()
    driver.window.run_command("background:none")
    assert driver.sketch.background is None
    driver.editor.apply(set_background(driver.sketch, Background("gone.png", (40, 30))))
    driver.window.draw()
    assert "gone.png cannot be shown" in driver.message


def test_export_follows_the_suffix_and_asks_before_replacing(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("ctrl+e")
    assert driver.editor.dialogs.current.text == "untitled.svg"
    driver.press_key("return")
    first = (tmp_path / "untitled.svg").read_text()
    assert "<svg" in first and "Exported" in driver.message and driver.editor.document.path is None
    driver.editor.apply(create.add_circle(driver.sketch, (2, 2), 0.5))
    driver.press_key("ctrl+e")
    driver.press_key("return")
    assert (
        get_dialog_title(driver) == "Replace the file?" and (tmp_path / "untitled.svg").read_text() == first
    )
    driver.press_key("r")
    assert (tmp_path / "untitled.svg").read_text() != first
    driver.press_key("ctrl+e")
    driver.press_key("ctrl+a")
    driver.type("plan.xyz")
    driver.press_key("return")
    assert "unknown format" in driver.read_dialog_error()
    driver.editor.apply(create.add_polygon(driver.sketch, ((2, 2), (4, 4), (4, 2), (2, 4))))
    driver.press_key("ctrl+e")
    assert driver.editor.has_error_message and driver.editor.dialogs.current is None


def test_export_asks_before_it_replaces_any_of_its_files(driver: EditorDriver, tmp_path: Path) -> None:
    def export_to_ros() -> None:
        driver.press_key("ctrl+e")
        driver.press_key("ctrl+a")
        driver.type("untitled.yaml")
        driver.press_key("return")

    image = tmp_path / "untitled.pgm"
    image.write_text("mine")
    export_to_ros()
    assert get_dialog_title(driver) == "Replace the file?"
    assert driver.editor.dialogs.current.text == f"{image} already exists."
    assert image.read_text() == "mine" and not (tmp_path / "untitled.yaml").exists()
    driver.press_key("r")
    assert image.read_bytes().startswith(b"P5") and (tmp_path / "untitled.yaml").exists()
    export_to_ros()
    assert get_dialog_title(driver) == "Replace the files?"
    assert driver.editor.dialogs.current.text == f"{tmp_path / 'untitled.yaml'} and {image} already exist."


def test_a_map_is_never_saved_under_another_formats_suffix(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("ctrl+s")
    driver.press_key("ctrl+a")
    driver.type("plan.svg")
    driver.press_key("return")
    assert (tmp_path / "plan.svg.json").exists() and not (tmp_path / "plan.svg").exists()


# how it is opened


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setenv(DRAFTS, str(tmp_path / "drafts"))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    return tmp_path


def open_launched_editor(
    folder: Path, path: Path | None = None, scale: float = 1.0, **more: object
) -> AbstractContextManager[EditorWindow]:
    return EditorLauncher(path, folder, size=(900, 600), scale=scale, **more).window()


def test_a_scale_for_which_the_window_is_too_small_is_reported(folders: Path, capsys) -> None:
    with open_launched_editor(folders, scale=1.5) as window:
        assert window.editor.message == "Scale 1.5 needs a window of 1350 × 900; using 1"
    assert capsys.readouterr().err == "robocov: scale 1.5 needs a window of 1350 × 900; using 1\n"


def test_settings_are_remembered(folders: Path) -> None:
    with open_launched_editor(folders) as window:
        window.editor.theme = "dark"
        window.editor.attempt(lambda: run_typed_command(window.editor, "grid", "0.25"))
        window.editor.snaps.discard("edges")
        window.panel.show_tab("snap")
        window.file_commands.remember(folders / "x.json")
        window.file_commands.may_close = True
    with open_launched_editor(folders) as window:
        editor = window.editor
        assert (editor.theme, editor.grid, window.panel.tab) == ("dark", 0.25, "snap")
        assert "edges" not in editor.snaps and editor.recent == [str(folders / "x.json")]


def test_options_are_not_saved_as_settings(folders: Path) -> None:
    with open_launched_editor(folders, theme="dark") as window:
        assert window.editor.theme == "dark"
        window.file_commands.may_close = True
    with open_launched_editor(folders) as window:
        assert window.editor.theme == "light"
        window.file_commands.may_close = True


def test_a_picture_given_as_an_option_is_shown(folders: Path) -> None:
    Image.new("RGB", (40, 30)).save(folders / "plan.png")
    with open_launched_editor(folders) as window:
        window.editor.shown.discard("picture")
        window.file_commands.may_close = True
    with open_launched_editor(folders, background=folders / "plan.png") as window:
        assert "picture" in window.editor.shown and window.editor.sketch.background is not None


def test_recent_files_are_found_from_every_folder(
    driver: EditorDriver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    driver.window.file_commands.remember(Path("x.json"))
    assert driver.editor.recent == [str(tmp_path / "x.json")]


def test_abandoned_drafts_are_offered_and_recovered(folders: Path) -> None:
    lost = Document(build_sheet(), folders / "drafts")
    lost.history.apply(create.add_circle(lost.history.sketch, (5, 5), 1.0))
    lost.update_draft()
    lost.flush()
    lost.close(discard=False)
    with open_launched_editor(folders) as window:
        get_dialog_title = window.editor.dialogs.current
        assert isinstance(get_dialog_title, Question) and "Recover" in get_dialog_title.title
        EditorDriver(window).press_key("r")
        assert len(window.editor.sketch.obstacles) == 1 and window.editor.document.history.has_unsaved_changes
    # The window was closed without a decision, so the draft is offered again.
    with open_launched_editor(folders) as window:
        assert window.editor.dialogs.current is not None
        EditorDriver(window).press_key("l")
        offer_recovery(window, find_recoverable(folders / "drafts"))
        EditorDriver(window).press_key("d")
        window.file_commands.may_close = True
    assert find_recoverable(folders / "drafts") == ()


def test_a_file_that_another_editor_has_open_is_not_opened_twice(folders: Path) -> None:
    document = Document.new(folders / "drafts")
    document.save(folders / "plan.json")
    document.flush()
    with (
        pytest.raises(InputError, match="already open in another editor"),
        open_launched_editor(folders, folders / "plan.json"),
    ):
        pass
    with open_launched_editor(folders) as window:
        window.editor.attempt(lambda: window.file_commands.open(folders / "plan.json"))
        assert window.editor.has_error_message and "another editor" in window.editor.message
        window.file_commands.may_close = True
    document.close(discard=True)


def test_a_new_name_is_a_new_map(folders: Path) -> None:
    with open_launched_editor(folders, folders / "fresh.json") as window:
        assert (
            window.editor.document.title == "fresh.json"
            and not window.editor.document.history.has_unsaved_changes
        )
        window.editor.attempt(window.file_commands.save)
        window.file_commands.may_close = True
    assert load_map(folders / "fresh.json").area == 100.0


def test_screenshots_need_no_display(folders: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Image.new("RGB", (60, 40), (200, 0, 0)).save(folders / "plan.png")
    target = folders / "shot.png"
    words = ["edit", "rooms", "--screenshot", str(target), "--size", "900x600", "--scale", "1"]
    assert (
        main([*words, "--page", "problems", "--theme", "dark", "--background", str(folders / "plan.png")])
        == 0
    )
    assert capsys.readouterr().out == f"saved {target}\n"
    with Image.open(target) as picture:
        assert picture.size == (900, 600)


def test_a_missing_display_is_reported_in_one_line(folders: Path, monkeypatch, capsys) -> None:
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    line = read_error(capsys, "edit", "rooms")
    assert line.startswith("no display: the editor needs one. Add --serve to use it in a browser")
    assert "--screenshot" in line


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["roms"], "did you mean 'rooms'"),
        (["nothing.dxf"], "no such file"),
        (["--scale", "9"], "--scale"),
        (["--size", "10x10"], "--size"),
        (["--screenshot", "x.jpg"], "ending in .png"),
    ],
)
def test_invalid_options_are_reported_in_one_line(
    folders: Path, capsys, words: list[str], message: str
) -> None:
    assert message in read_error(capsys, "edit", *words)


def test_a_broken_file_is_reported_before_a_window_opens(folders: Path, capsys) -> None:
    (folders / "bad.json").write_text('{"format": "robocov-map", "version": 1, "name": "x", "boundery": []}')
    assert "boundery" in read_error(capsys, "edit", str(folders / "bad.json"))
    (folders / "draft.json").write_text(
        json.dumps({"format": "robocov-map", "version": 1, "name": "d", "boundary": [[0, 0], [1, 1]]})
    )
    target = folders / "shot.png"
    assert main(["edit", str(folders / "draft.json"), "--screenshot", str(target)]) == 0


def test_a_map_of_another_format_opens_the_import_dialog(folders: Path) -> None:
    plan = {"id": "flat", "bbox": {"min": [0, 0], "max": [4, 3]}, "verts": [[0, 0], [4, 0], [4, 3], [0, 3]]}
    (folders / "flat.json").write_text(json.dumps({**plan, "room_num": 1, "room_category": {}}))
    with open_launched_editor(folders, folders / "flat.json") as window:
        get_dialog_title = window.editor.dialogs.current
        assert isinstance(get_dialog_title, ImportDialog) and get_dialog_title.path.name == "flat.json"
        get_dialog_title.accepted = True
        end = time.monotonic() + 60.0
        while window.editor.dialogs.current is not None and time.monotonic() < end:
            window.run_frame(0.01)
        assert window.editor.document.path is None and window.editor.document.history.has_unsaved_changes
        assert window.editor.sketch.build_environment().free_area == 12.0
        window.file_commands.may_close = True


def test_an_unsupported_file_is_reported_by_its_format(folders: Path) -> None:
    (folders / "plan.shp").write_bytes(b"\0\0'\x0a" + bytes(96))
    message = pytest.raises(MapError, match="a shapefile, which cannot be imported: ogr2ogr")
    with message, open_launched_editor(folders, folders / "plan.shp"):
        pass


def test_a_drawn_polygon_is_saved(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("p")
    driver.click_all((1, 1), (3, 1), (3, 3))
    driver.press_key("return")
    driver.press_key("ctrl+s")
    driver.press_key("return")
    assert PolygonObstacle(((1, 1), (3, 1), (3, 3))) in load_map(tmp_path / "untitled.json").obstacles


def test_saving_a_draft_over_a_valid_map_asks_first(driver: EditorDriver, tmp_path: Path) -> None:
    driver.press_key("ctrl+s")
    driver.press_key("return")
    (path,) = tmp_path.glob("*.json")
    driver.editor.apply(create.set_boundary(driver.sketch, [(0, 0), (5, 5), (5, 0), (0, 5)]))
    driver.press_key("ctrl+s")
    assert driver.editor.dialogs.current is not None and "valid map" in driver.editor.dialogs.current.text
    driver.press_key("c")
    load_map(path)
    driver.press_key("ctrl+s")
    driver.press_key("r")
    with pytest.raises(MapError):
        load_map(path)
    driver.editor.apply(create.set_boundary(driver.sketch, [(0, 0), (6, 6), (6, 0), (0, 6)]))
    driver.press_key("ctrl+s")
    assert driver.editor.dialogs.current is None and not driver.editor.document.history.has_unsaved_changes
