"""The import dialog: its options and their effects, clicks on the map, accepting and canceling."""

import time
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest
from driven_editor import EditorDriver, build_sheet, open_editor
from PIL import Image, ImageDraw

from robocov_app.editor.edits.properties import set_title
from robocov_app.editor.ui.importing.dialog import ImportDialog
from robocov_app.editor.ui.importing.options import list_options
from robocov_app.editor.ui.importing.service import ImportService
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping
from robocov_app.jobs.workers import DirectWorker, LatestWorker
from robocov_app.toolkit.dialogs import Question

PATIENCE = 60.0


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """A picture of two rooms that are not connected, the right one smaller; with a spot in the left one."""
    picture = Image.new("L", (200, 100), 0)
    draw = ImageDraw.Draw(picture)
    draw.rectangle((10, 10, 109, 89), fill=255)
    draw.rectangle((120, 10, 189, 89), fill=255)
    draw.rectangle((30, 30, 39, 39), fill=100)
    picture.save(tmp_path / "plan.png")
    return tmp_path / "plan.png"


def build_dialog(path: Path, worker: Any = None, call: Any = None) -> ImportDialog:
    worker = worker or DirectWorker(ImportService())
    return ImportDialog(path, IMPORTERS["image"], worker, call)


def compute_free_area(dialog: ImportDialog) -> float:
    dialog.poll()
    assert dialog.imported is not None and dialog.problem == ""
    return dialog.imported.environment.free_area


@pytest.mark.parametrize("name", IMPORTERS)
def test_the_dialog_has_the_options_of_the_format(name: str, tmp_path: Path) -> None:
    options = list_options(IMPORTERS[name])
    shaping = [field.name for field in fields(Shaping)]
    assert {option.name for option in options} == {*IMPORTERS[name].options, *shaping}
    assert all(option.help.endswith(".") and "None" not in option.help for option in options)
    dialog = ImportDialog(tmp_path / "x", IMPORTERS[name], DirectWorker(ImportService()), None)
    assert dialog.form.build_settings() == (ReadOptions(), Shaping())
    given = {"number": "1", "position": "1 2", "words": "a, b", "text": "walls"}
    given |= {"colors": "red, #00ff00", "width": "3px"}
    meant = {"number": 1.0, "position": (1.0, 2.0), "words": ("a", "b"), "text": "walls"}
    meant |= {"colors": ("red", "#00ff00"), "width": "3px"}
    for option in options:
        dialog.form.texts = {option.name: option.choices[-1] if option.choices else given[option.kind]}
        value = (
            {"yes": True}.get(option.choices[-1], option.choices[-1])
            if option.choices
            else meant[option.kind]
        )
        assert getattr(dialog.form.build_settings()[option.name in shaping], option.name) == value


def test_every_change_updates_the_preview(plan: Path) -> None:
    dialog = build_dialog(plan)
    assert "--cell" in dialog.problem and not dialog.is_ready
    dialog.form.set_text("cell", "0.1")
    assert compute_free_area(dialog) == pytest.approx(80 - 1)
    dialog.form.set_text("invert", "yes")
    assert compute_free_area(dialog) == pytest.approx(200 - 80 - 56)
    dialog.form.set_text("invert", "no")
    dialog.form.set_text("threshold", "0.3")
    assert compute_free_area(dialog) == pytest.approx(80)
    dialog.form.set_text("threshold", "0.3x")
    assert dialog.problem == "threshold: expected a number, got '0.3x'"
    dialog.form.set_text("threshold", "")
    dialog.form.set_text("keep", "all")
    assert compute_free_area(dialog) == pytest.approx(80 + 56 - 1)
    dialog.form.keep_inside((15.0, 5.0))
    assert compute_free_area(dialog) == pytest.approx(56)
    dialog.form.keep_inside((11.5, 5.0))
    assert "is solid, expected a free position" in dialog.problem
    dialog.form.set_text("inside", "")
    assert compute_free_area(dialog) == pytest.approx(80 - 1)
    assert dialog.form.texts == {"cell": "0.1"}


def wait_for_import(dialog: ImportDialog) -> None:
    end = time.monotonic() + PATIENCE
    while dialog.is_busy and time.monotonic() < end:
        dialog.poll()
        time.sleep(0.005)
    assert not dialog.is_busy


@pytest.mark.slow
def test_the_newest_settings_win_in_another_process(plan: Path) -> None:
    # Without patience, each older import is canceled.
    worker: Any = LatestWorker(
        "robocov_app.editor.ui.importing.service:ImportService", "imports", patience=0.0
    )
    dialog = build_dialog(plan, worker)
    for text in ("0", "0.", "0.1"):
        dialog.form.set_text("cell", text)
    process = worker.process
    wait_for_import(dialog)
    assert compute_free_area(dialog) == pytest.approx(80 - 1)
    dialog.form.keep_inside((15.0, 5.0))
    dialog.accepted = True
    wait_for_import(dialog)
    call = dialog.poll()
    assert call is not None and call.environment.free_area == pytest.approx(56)
    assert worker.process is process
    dialog.handle_cancel()
    assert process.poll() is not None


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, build_sheet()) as driver:
        yield driver


def get_dialog(driver: EditorDriver) -> tuple[ImportDialog, Any]:
    """Return the dialog, and its widgets by kind and name."""
    driver.run_frames(2)
    assert isinstance(driver.editor.dialogs.current, ImportDialog)
    return driver.editor.dialogs.current, driver.window.dialogs.ui.widgets


def test_a_click_keeps_a_part_and_enter_imports(driver: EditorDriver, plan: Path) -> None:
    driver.press_key("ctrl+o")
    driver.type("plan.png")
    driver.press_key("return")
    driver.type("0.1")
    dialog, _ = get_dialog(driver)
    assert dialog.form.texts == {"cell": "0.1"}
    for camera, place in zip(dialog.preview.cameras, ((15.0, 3.0), (5.0, 8.0)), strict=True):
        driver.click(*camera.to_pixels(np.array(place)).tolist())
        inside = [float(number) for number in dialog.form.texts["inside"].split()]
        assert inside == pytest.approx(place, abs=0.1)
    driver.click(*dialog.preview.cameras[0].to_pixels(np.array((15.0, 3.0))).tolist())
    driver.press_key("return")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is None
    assert (
        driver.editor.document.history.has_unsaved_changes
        and driver.editor.document.path is None
        and driver.editor.document.title == "plan"
    )
    assert driver.sketch.build_environment().free_area == pytest.approx(56)
    assert driver.message == "Imported: plan.png, not saved yet"


def test_options_and_buttons_have_widgets(driver: EditorDriver, plan: Path) -> None:
    driver.window.file_commands.open(plan)
    dialog, view = get_dialog(driver)
    driver.type("0.1")
    driver.click(*view["menu:invert"].rect.center)
    driver.press_key("down")
    driver.press_key("return")
    assert dialog.form.texts == {"cell": "0.1", "invert": "yes"} and not dialog.accepted
    menu = get_dialog(driver)[1]["menu:unknown"]
    seen = []
    for _ in range(4):
        driver.click(*menu.rect.center)
        driver.press_key("down")
        driver.press_key("return")
        seen.append(dialog.form.texts.get("unknown"))
    assert seen == ["obstacle", "free", "cut", "cut"]
    driver.click(*menu.rect.center)
    driver.press_key("home")
    driver.press_key("return")
    assert "unknown" not in dialog.form.texts, "an option without a default can be left again"
    before = driver.sketch
    driver.click(*view["button:cancel"].rect.center)
    assert driver.editor.dialogs.current is None and driver.sketch is before


def test_unusable_settings_are_reported_and_not_accepted(driver: EditorDriver, plan: Path) -> None:
    driver.window.file_commands.open(plan)
    dialog, _ = get_dialog(driver)
    driver.press_key("return")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is dialog and "--cell" in dialog.problem
    driver.type("0.1")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is dialog, "an old Enter counts no more"
    driver.press_key("escape")
    assert driver.editor.dialogs.current is None


def test_importing_asks_before_closing_the_open_map(driver: EditorDriver, plan: Path) -> None:
    driver.editor.apply(set_title(driver.sketch, "mine"))
    driver.post(pygame.DROPFILE, file=str(plan))
    driver.settle()
    get_dialog(driver)
    driver.type("0.1")
    driver.press_key("return")
    driver.run_frames(2)
    dialog = driver.editor.dialogs.current
    assert isinstance(dialog, Question) and dialog.title == "Save the changes?"
    driver.press_key("escape")
    assert driver.sketch.name == "mine"


def test_closing_the_window_closes_the_dialog(driver: EditorDriver, plan: Path) -> None:
    driver.window.file_commands.open(plan)
    get_dialog(driver)
    driver.post(pygame.QUIT)
    driver.settle()
    assert driver.editor.dialogs.current is None and driver.window.closed


@pytest.mark.parametrize("size", [(900, 600), (1280, 720)])
def test_options_maps_and_report_do_not_overlap(tmp_path: Path, plan: Path, size: tuple[int, int]) -> None:
    with open_editor(tmp_path, build_sheet(), size=size) as driver:
        driver.window.file_commands.ask_import(plan, IMPORTERS["svg"])  # which has most options
        driver.run_frames(2)
        dialog, view = get_dialog(driver)
        rects = [each.rect for each in view.values() if each.kind in ("menu", "entry", "button", "area")]
        assert len(rects) == len(dialog.form.options) + 3
        assert all(not one.colliderect(other) for k, one in enumerate(rects) for other in rects[:k])
        assert min(rect.height for rect in rects) >= 16
        driver.press_key("escape")
        driver.window.file_commands.ask_import(plan, IMPORTERS["image"])
        driver.type("0.1")
        dialog, view = get_dialog(driver)
        rects = [each.rect for each in view.values() if each.kind in ("menu", "entry", "button")]
        views = [pygame.Rect(camera.view) for camera in dialog.preview.cameras]
        assert not views[0].colliderect(views[1]) and min(min(view.size) for view in views) > 120
        assert all(not view.colliderect(rect) for view in views for rect in rects)
        left, right = (driver.window.screen.subsurface(view).copy() for view in views)
        assert pygame.transform.average_color(left) != pygame.transform.average_color(right)
