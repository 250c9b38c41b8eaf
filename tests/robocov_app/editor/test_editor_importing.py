"""The import dialog: its options, what they change, a click into the map, and how it ends."""

import time
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest
from driven_editor import EditorDriver, open_editor, sheet
from PIL import Image, ImageDraw

from robocov_app.editor.edits.properties import set_title
from robocov_app.editor.ui.import_dialog import ImportDialog
from robocov_app.editor.ui.importing import ImportJob, list_options
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


def question(path: Path, worker: Any = None, taken: Any = None) -> ImportDialog:
    worker = worker or DirectWorker(ImportJob())
    return ImportDialog(path, IMPORTERS["picture"], worker, taken)


def free(asked: ImportDialog) -> float:
    asked.poll()
    assert asked.imported is not None and asked.problem == ""
    return asked.imported.environment.free_area


@pytest.mark.parametrize("name", IMPORTERS)
def test_the_dialog_has_the_options_of_the_format(name: str, tmp_path: Path) -> None:
    options = list_options(IMPORTERS[name])
    shaping = [field.name for field in fields(Shaping)]
    assert {option.name for option in options} == {*IMPORTERS[name].options, *shaping}
    assert all(option.help.endswith(".") and "None" not in option.help for option in options)
    asked = ImportDialog(tmp_path / "x", IMPORTERS[name], DirectWorker(ImportJob()), None)
    assert asked.form.build_settings() == (ReadOptions(), Shaping())
    given = {"number": "1", "position": "1 2", "words": "a, b", "text": "walls"}
    given |= {"colors": "red, #00ff00", "width": "3px"}
    meant = {"number": 1.0, "position": (1.0, 2.0), "words": ("a", "b"), "text": "walls"}
    meant |= {"colors": ("red", "#00ff00"), "width": "3px"}
    for option in options:
        asked.form.entries = {option.name: option.choices[-1] if option.choices else given[option.kind]}
        value = (
            {"yes": True}.get(option.choices[-1], option.choices[-1])
            if option.choices
            else meant[option.kind]
        )
        assert getattr(asked.form.build_settings()[option.name in shaping], option.name) == value


def test_every_change_updates_the_preview(plan: Path) -> None:
    asked = question(plan)
    assert "--cell" in asked.problem and not asked.is_ready
    asked.form.set("cell", "0.1")
    assert free(asked) == pytest.approx(80 - 1)
    asked.form.set("invert", "yes")
    assert free(asked) == pytest.approx(200 - 80 - 56)
    asked.form.set("invert", "no")
    asked.form.set("threshold", "0.3")
    assert free(asked) == pytest.approx(80)
    asked.form.set("threshold", "0.3x")
    assert asked.problem == "threshold: expected a number, got '0.3x'"
    asked.form.set("threshold", "")
    asked.form.set("keep", "all")
    assert free(asked) == pytest.approx(80 + 56 - 1)
    asked.form.keep_inside((15.0, 5.0))
    assert free(asked) == pytest.approx(56)
    asked.form.keep_inside((11.5, 5.0))
    assert "is solid, expected a free position" in asked.problem
    asked.form.set("inside", "")
    assert free(asked) == pytest.approx(80 - 1)
    assert asked.form.entries == {"cell": "0.1"}


def waited(asked: ImportDialog) -> None:
    end = time.monotonic() + PATIENCE
    while asked.is_busy and time.monotonic() < end:
        asked.poll()
        time.sleep(0.005)
    assert not asked.is_busy


@pytest.mark.slow
def test_the_newest_settings_win_in_another_process(plan: Path) -> None:
    # every older import is given up
    worker: Any = LatestWorker("robocov_app.editor.ui.importing:ImportJob", "imports", patience=0.0)
    asked = question(plan, worker)
    for text in ("0", "0.", "0.1"):
        asked.form.set("cell", text)
    process = worker.process
    waited(asked)
    assert free(asked) == pytest.approx(80 - 1)
    asked.form.keep_inside((15.0, 5.0))
    asked.accepted = True
    waited(asked)
    taken = asked.poll()
    assert taken is not None and taken.environment.free_area == pytest.approx(56)
    assert worker.process is process
    asked.handle_cancel()
    assert process.poll() is not None


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, sheet()) as driver:
        yield driver


def shown(driver: EditorDriver) -> tuple[ImportDialog, Any]:
    """Return the dialog, and its widgets by kind and name."""
    driver.run_frames(2)
    assert isinstance(driver.editor.dialogs.current, ImportDialog)
    return driver.editor.dialogs.current, driver.window.dialogs.ui.widgets


def test_a_click_keeps_a_part_and_enter_imports(driver: EditorDriver, plan: Path) -> None:
    driver.press_key("ctrl+o")
    driver.type("plan.png")
    driver.press_key("return")
    driver.type("0.1")
    asked, _ = shown(driver)
    assert asked.form.entries == {"cell": "0.1"}
    for camera, place in zip(asked.preview.cameras, ((15.0, 3.0), (5.0, 8.0)), strict=True):
        driver.click(*camera.to_pixels(np.array(place)).tolist())
        x, y = (float(word) for word in asked.form.entries["inside"].split())
        assert (x, y) == pytest.approx(place, abs=0.1)
    driver.click(*asked.preview.cameras[0].to_pixels(np.array((15.0, 3.0))).tolist())
    driver.press_key("return")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is None
    assert (
        driver.editor.document.history.has_unsaved_changes
        and driver.editor.document.path is None
        and driver.editor.document.title == "plan"
    )
    assert driver.sketch.build_environment().free_area == pytest.approx(56)
    assert driver.message == "imported: plan.png, not saved yet"


def test_options_and_buttons_have_widgets(driver: EditorDriver, plan: Path) -> None:
    driver.window.documents.open(plan)
    asked, view = shown(driver)
    driver.type("0.1")
    driver.click(*view["menu:invert"].rect.center)
    driver.press_key("down")
    driver.press_key("return")
    assert asked.form.entries == {"cell": "0.1", "invert": "yes"} and not asked.accepted
    menu = shown(driver)[1]["menu:unknown"]
    seen = []
    for _ in range(4):
        driver.click(*menu.rect.center)
        driver.press_key("down")
        driver.press_key("return")
        seen.append(asked.form.entries.get("unknown"))
    assert seen == ["obstacle", "free", "cut", "cut"]
    driver.click(*menu.rect.center)
    driver.press_key("home")
    driver.press_key("return")
    assert "unknown" not in asked.form.entries, "an option without a default can be left again"
    before = driver.sketch
    driver.click(*view["button:cancel"].rect.center)
    assert driver.editor.dialogs.current is None and driver.sketch is before


def test_unusable_settings_are_reported_and_not_accepted(driver: EditorDriver, plan: Path) -> None:
    driver.window.documents.open(plan)
    asked, _ = shown(driver)
    driver.press_key("return")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is asked and "--cell" in asked.problem
    driver.type("0.1")
    driver.run_frames(2)
    assert driver.editor.dialogs.current is asked, "an old Enter counts no more"
    driver.press_key("escape")
    assert driver.editor.dialogs.current is None


def test_importing_asks_before_closing_the_open_map(driver: EditorDriver, plan: Path) -> None:
    driver.editor.apply(set_title(driver.sketch, "mine"))
    driver.post(pygame.DROPFILE, file=str(plan))
    driver.settle()
    shown(driver)
    driver.type("0.1")
    driver.press_key("return")
    driver.run_frames(2)
    asked = driver.editor.dialogs.current
    assert isinstance(asked, Question) and asked.title == "Save the changes?"
    driver.press_key("escape")
    assert driver.sketch.name == "mine"


def test_closing_the_window_closes_the_dialog(driver: EditorDriver, plan: Path) -> None:
    driver.window.documents.open(plan)
    shown(driver)
    driver.post(pygame.QUIT)
    driver.settle()
    assert driver.editor.dialogs.current is None and driver.window.closed


@pytest.mark.parametrize("size", [(900, 600), (1280, 720)])
def test_options_maps_and_report_do_not_overlap(tmp_path: Path, plan: Path, size: tuple[int, int]) -> None:
    with open_editor(tmp_path, sheet(), size=size) as driver:
        driver.window.documents.ask_import(plan, IMPORTERS["svg"])  # which has most options
        driver.run_frames(2)
        asked, view = shown(driver)
        rects = [each.rect for each in view.values() if each.kind in ("menu", "entry", "button", "area")]
        assert len(rects) == len(asked.form.options) + 3
        assert all(not one.colliderect(other) for k, one in enumerate(rects) for other in rects[:k])
        assert min(rect.height for rect in rects) >= 16
        driver.press_key("escape")
        driver.window.documents.ask_import(plan, IMPORTERS["picture"])
        driver.type("0.1")
        asked, view = shown(driver)
        rects = [each.rect for each in view.values() if each.kind in ("menu", "entry", "button")]
        views = [pygame.Rect(camera.view) for camera in asked.preview.cameras]
        assert not views[0].colliderect(views[1]) and min(min(view.size) for view in views) > 120
        assert all(not view.colliderect(rect) for view in views for rect in rects)
        left, right = (driver.window.screen.subsurface(view).copy() for view in views)
        assert pygame.transform.average_color(left) != pygame.transform.average_color(right)
