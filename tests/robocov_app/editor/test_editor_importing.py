"""The import dialogue: its options, what they change, a click into the map, and how it ends."""

import time
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest
from driven_editor import Hands, opened_editor, sheet
from PIL import Image, ImageDraw

from robocov_app.editor.edits.properties import titled
from robocov_app.editor.ui.asking import Question
from robocov_app.editor.ui.importing import Importing, ImportQuestion, options_of
from robocov_app.importers import IMPORTERS, ReadOptions, Shaping
from robocov_app.toolkit.worker import DirectWorker, LatestWorker

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


def question(path: Path, worker: Any = None, taken: Any = None) -> ImportQuestion:
    worker = worker or DirectWorker(Importing())
    return ImportQuestion(path, IMPORTERS["picture"], worker, taken)


def choose(asked: ImportQuestion, name: str) -> None:
    asked.move([option.name for option in asked.options].index(name) - asked.chosen)


def free(asked: ImportQuestion) -> float:
    asked.poll()
    assert asked.imported is not None and asked.trouble == ""
    return asked.imported.environment.free_area


@pytest.mark.parametrize("name", IMPORTERS)
def test_the_options_are_those_of_the_format(name: str, tmp_path: Path) -> None:
    options = options_of(IMPORTERS[name])
    shaping = [field.name for field in fields(Shaping)]
    assert {option.name for option in options} == {*IMPORTERS[name].options, *shaping}
    assert all(option.help.endswith(".") and "None" not in option.help for option in options)
    asked = ImportQuestion(tmp_path / "x", IMPORTERS[name], DirectWorker(Importing()), None)
    assert asked.settings() == (ReadOptions(), Shaping())
    given = {"number": "1", "place": "1 2", "words": "a, b", "text": "walls"}
    meant = {"number": 1.0, "place": (1.0, 2.0), "words": ("a", "b"), "text": "walls"}
    for option in options:
        asked.given = {option.name: option.choices[-1] if option.choices else given[option.kind]}
        value = (
            {"yes": True}.get(option.choices[-1], option.choices[-1])
            if option.choices
            else meant[option.kind]
        )
        assert getattr(asked.settings()[option.name in shaping], option.name) == value


def test_every_change_shows_what_would_come_of_it(plan: Path) -> None:
    asked = question(plan)
    assert "--cell" in asked.trouble and not asked.ready
    asked.type("0.1")
    assert free(asked) == pytest.approx(80 - 1)
    choose(asked, "invert")
    asked.type(" ")
    assert free(asked) == pytest.approx(200 - 80 - 56)
    asked.turn(1)
    choose(asked, "threshold")
    asked.type("0.3")
    assert free(asked) == pytest.approx(80)
    asked.type("x")
    assert asked.trouble == "threshold: '0.3x', but a number was wanted"
    asked.erase(all_of_it=True)
    choose(asked, "keep")
    asked.turn(-1)
    assert free(asked) == pytest.approx(80 + 56 - 1)
    asked.keep_inside((15.0, 5.0))
    assert free(asked) == pytest.approx(56)
    asked.keep_inside((11.5, 5.0))
    assert "is solid, but a place in the free space was wanted" in asked.trouble
    choose(asked, "inside")
    asked.erase(all_of_it=True)
    assert free(asked) == pytest.approx(80 - 1)
    assert asked.given == {"cell": "0.1"}


def test_an_option_without_a_default_can_be_left_again(plan: Path) -> None:
    asked = question(plan)
    choose(asked, "unknown")
    seen = []
    for _ in range(4):
        asked.turn(1)
        seen.append(asked.text(asked.option))
    assert seen == ["obstacle", "free", "cut", ""]


def waited(asked: ImportQuestion) -> None:
    end = time.monotonic() + PATIENCE
    while asked.busy and time.monotonic() < end:
        asked.poll()
        time.sleep(0.005)
    assert not asked.busy


@pytest.mark.slow
def test_the_newest_settings_win_beside_the_window(plan: Path) -> None:
    # every older import is given up
    worker: Any = LatestWorker("robocov_app.editor.ui.importing:Importing", "imports", patience=0.0)
    asked = question(plan, worker)
    for letter in "0.1":
        asked.type(letter)
    process = worker._talk.process
    waited(asked)
    assert free(asked) == pytest.approx(80 - 1)
    asked.keep_inside((15.0, 5.0))
    asked.accepted = True
    waited(asked)
    taken = asked.poll()
    assert taken is not None and taken.environment.free_area == pytest.approx(56)
    assert worker._talk.process is process
    asked.close()
    assert process.poll() is not None


@pytest.fixture
def hands(tmp_path: Path) -> Iterator[Hands]:
    with opened_editor(tmp_path, sheet()) as driver:
        yield driver


def shown(hands: Hands) -> tuple[ImportQuestion, Any]:
    hands.frames(2)
    assert isinstance(hands.desk.asked, ImportQuestion)
    return hands.desk.asked, hands.window.dialogs._import


def test_a_click_into_the_map_keeps_that_part_and_enter_takes_it(hands: Hands, plan: Path) -> None:
    hands.key("ctrl+o")
    hands.type("plan.png")
    hands.key("return")
    hands.type("0.1")
    asked, view = shown(hands)
    assert asked.given == {"cell": "0.1"}
    for camera, place in zip(view._cameras, ((15.0, 3.0), (5.0, 8.0)), strict=True):
        hands.click(*camera.to_pixels(np.array(place)).tolist())
        x, y = (float(word) for word in asked.given["inside"].split())
        assert (x, y) == pytest.approx(place, abs=0.1)
    hands.click(*view._cameras[0].to_pixels(np.array((15.0, 3.0))).tolist())
    hands.key("return")
    hands.frames(2)
    assert hands.desk.asked is None
    assert (
        hands.desk.document.unsaved
        and hands.desk.document.path is None
        and hands.desk.document.title == "plan"
    )
    assert hands.sketch.environment().free_area == pytest.approx(56)
    assert hands.said == "imported: plan.png, not saved yet"


def test_rows_and_buttons_take_clicks(hands: Hands, plan: Path) -> None:
    hands.window.documents.open(plan)
    asked, view = shown(hands)
    hands.type("0.1")
    names = [option.name for option in asked.options]
    row = {names[k]: rect for rect, k in view._rows}
    hands.click(*row["invert"].center)
    assert asked.option.name == "invert" and "invert" not in asked.given
    hands.click(*row["invert"].center)
    assert asked.given["invert"] == "yes"
    hands.key("delete")
    hands.key("up")
    hands.key("up")
    hands.key("right")
    assert asked.given["unknown"] == "obstacle"
    before = hands.sketch
    cancel = next(rect for rect, key in view._buttons if key == "escape")
    hands.click(*cancel.center)
    assert hands.desk.asked is None and hands.sketch is before


def test_what_cannot_be_imported_is_told_and_not_taken(hands: Hands, plan: Path) -> None:
    hands.window.documents.open(plan)
    asked, _ = shown(hands)
    hands.key("return")
    hands.frames(2)
    assert hands.desk.asked is asked and "--cell" in asked.trouble
    hands.type("0.1")
    hands.frames(2)
    assert hands.desk.asked is asked, "an old Enter counts no more"
    hands.key("escape")
    assert hands.desk.asked is None


def test_what_is_open_is_not_lost(hands: Hands, plan: Path) -> None:
    hands.desk.change(titled(hands.sketch, "mine"))
    hands.post(pygame.DROPFILE, file=str(plan))
    hands.settle()
    shown(hands)
    hands.type("0.1")
    hands.key("return")
    hands.frames(2)
    assert isinstance(hands.desk.asked, Question) and hands.desk.asked.title == "Save the changes?"
    hands.key("escape")
    assert hands.sketch.name == "mine"


def test_closing_the_window_leaves_it(hands: Hands, plan: Path) -> None:
    hands.window.documents.open(plan)
    shown(hands)
    hands.post(pygame.QUIT)
    hands.settle()
    assert hands.desk.asked is None and hands.window.closed


@pytest.mark.parametrize("size", [(900, 600), (1280, 720)])
def test_options_maps_and_report_keep_apart(tmp_path: Path, plan: Path, size: tuple[int, int]) -> None:
    with opened_editor(tmp_path, sheet(), size=size) as hands:
        hands.window.documents.ask_import(plan, IMPORTERS["svg"])  # which has most options
        hands.frames(2)
        asked, view = shown(hands)
        rects = [rect for rect, _ in (*view._rows, *view._buttons)]
        assert len(rects) == len(asked.options) + 2
        assert all(not one.colliderect(other) for k, one in enumerate(rects) for other in rects[:k])
        assert min(rect.height for rect in rects) >= 16
        hands.key("escape")
        hands.window.documents.ask_import(plan, IMPORTERS["picture"])
        hands.type("0.1")
        _, view = shown(hands)
        views = [pygame.Rect(camera.view) for camera in view._cameras]
        assert not views[0].colliderect(views[1]) and min(min(view.size) for view in views) > 120
        assert all(not view.colliderect(rect) for view in views for rect in rects)
        left, right = (hands.window.screen.subsurface(view).copy() for view in views)
        assert pygame.transform.average_color(left) != pygame.transform.average_color(right)
