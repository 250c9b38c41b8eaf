"""Colors in the import dialog: by a click, by the keyboard, with a live preview."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from driven_editor import EditorDriver, open_editor, sheet
from PIL import Image, ImageDraw

from robocov_app.editor.ui.import_dialog import ImportDialog
from robocov_app.editor.ui.import_sheet import (
    build_color_sheet,
    choose_next_role,
    find_role,
    list_declared_colors,
    set_role,
)
from robocov_app.editor.ui.importing import ImportJob
from robocov_app.formats import IMPORTERS, ReadOptions
from robocov_app.jobs.workers import DirectWorker

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="10000mm" height="6000mm" viewBox="0 0 10 6">
<rect width="10" height="6" fill="#c8c8c8"/>
<path d="M0 0H10V6H0Z M5 0V4" fill="none" stroke="#000" stroke-width="0.2"/>
<rect x="1" y="1" width="3" height="2" fill="#e0e0ff"/></svg>"""
ROOM = 9.8 * 5.8 - 0.2 * 3.9
RUG = (2.5, 4.0)  # a place on it, m


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    (tmp_path / "plan.svg").write_text(SVG)
    return tmp_path / "plan.svg"


def dialog(path: Path, kind: str = "svg") -> ImportDialog:
    asked = ImportDialog(path, IMPORTERS[kind], DirectWorker(ImportJob()), lambda _: None)
    asked.poll()
    return asked


def free_area(asked: ImportDialog) -> float:
    asked.poll()
    assert asked.imported is not None and asked.problem == ""
    return asked.imported.environment.free_area


def test_clicks_cycle_a_color_through_its_roles(drawing: Path) -> None:
    asked = dialog(drawing)
    assert free_area(asked) == pytest.approx(ROOM - 6)
    for role, area in (("free", ROOM), ("solid", ROOM - 6), ("ignore", ROOM), (None, ROOM - 6)):
        asked.form.cycle_color((224, 224, 255))
        assert find_role(asked.form.entries, (224, 224, 255)) == role
        assert free_area(asked) == pytest.approx(area)
        # what is left out can still be clicked
        assert asked.imported is not None and asked.imported.sheet is not None
        assert asked.imported.sheet.find_color(*RUG) == (224, 224, 255)
    assert asked.form.entries == {}


def test_clicked_colors_are_added_to_typed_ones() -> None:
    given = {"free_color": "red, lightblue", "cell": "1"}
    set_role(given, (0, 0, 255), "free")
    assert given == {"free_color": "red, lightblue, #0000ff", "cell": "1"}
    set_role(given, (255, 0, 0), "solid")
    assert given == {"free_color": "lightblue, #0000ff", "solid_color": "#ff0000", "cell": "1"}
    assert list_declared_colors(given) == [(173, 216, 230), (0, 0, 255), (255, 0, 0)]
    set_role(given, (255, 0, 0), None)
    assert "solid_color" not in given
    # half a name is no color yet
    given["free_color"] = "lightbl"
    assert list_declared_colors(given) == []
    assert choose_next_role(choose_next_role(choose_next_role(choose_next_role(None)))) is None


def test_a_click_finds_the_topmost_shape(drawing: Path) -> None:
    found = build_color_sheet(IMPORTERS["svg"].read(drawing, ReadOptions()))
    assert found is not None
    assert found.colors == ((200, 200, 200), (0, 0, 0), (224, 224, 255))
    assert found.find_color(*RUG) == (224, 224, 255)
    assert found.find_color(5.0, 5.0) == (0, 0, 0)
    assert found.find_color(8.0, 1.0) == (200, 200, 200)
    assert found.find_color(-1.0, 1.0) is None


def picture(folder: Path) -> Path:
    """A plan whose edges are soft, with a pale blue rug and a red line."""
    large = Image.new("RGB", (800, 480), "white")
    draw = ImageDraw.Draw(large)
    draw.rectangle((0, 0, 799, 479), outline="black", width=16)
    draw.rectangle((83, 83, 322, 242), fill="#a0c0ff")
    draw.line((0, 350, 799, 350), fill="red", width=8)
    large.resize((200, 120), Image.Resampling.LANCZOS).save(folder / "plan.png")
    return folder / "plan.png"


def test_colors_of_a_picture_ignore_soft_edges(tmp_path: Path) -> None:
    found = build_color_sheet(IMPORTERS["picture"].read(picture(tmp_path), ReadOptions(cell=0.1)))
    assert found is not None
    names = {(255, 255, 255), (160, 192, 255), (0, 0, 0), (255, 0, 0)}
    assert set(found.colors) == names
    assert found.find_color(5.0, 8.0) == (160, 192, 255)
    assert found.find_color(5.0, 12.0 - 35.0 / 4) == (255, 0, 0)
    assert found.find_color(25.0, 5.0) is None and found.find_color(5.0, -0.01) is None
    asked = dialog(picture(tmp_path), "picture")
    asked.form.set("cell", "0.1")
    split = free_area(asked)
    asked.form.cycle_color((255, 0, 0))
    assert find_role(asked.form.entries, (255, 0, 0)) == "free"
    assert free_area(asked) > split + 50


def test_a_map_without_colors_has_no_sheet(tmp_path: Path) -> None:
    foreign = IMPORTERS["svg"].read(dialog_file(tmp_path), ReadOptions())
    assert build_color_sheet(foreign) is not None
    path = tmp_path / "plan.wkt"
    path.write_text(shapely.box(0, 0, 5, 5).wkt)
    asked = dialog(path, "wkt")
    assert free_area(asked) == pytest.approx(25.0)
    assert asked.imported is not None and asked.imported.sheet is None and asked.sheet is None


def dialog_file(folder: Path) -> Path:
    path = folder / "plan.svg"
    path.write_text(SVG)
    return path


@pytest.fixture(params=[("light", (900, 600)), ("dark", (1280, 720))])
def driver(request: Any, tmp_path: Path) -> Iterator[EditorDriver]:
    theme, size = request.param
    dialog_file(tmp_path)
    with open_editor(tmp_path, sheet(), theme=theme, size=size) as driver:
        driver.press_key("ctrl+o")
        driver.type("plan.svg")
        driver.press_key("return")
        driver.run_frames(3)
        yield driver


def shown(driver: EditorDriver) -> tuple[ImportDialog, Any]:
    driver.run_frames(2)
    asked = driver.editor.dialogs.current
    assert isinstance(asked, ImportDialog)
    return asked, driver.window.dialogs.ui.widgets


def pixel(driver: EditorDriver, point: Any) -> tuple[int, ...]:
    x, y = (round(value) for value in point)
    return tuple(driver.window.screen.get_at((x, y)))[:3]


def test_a_click_on_the_preview_changes_a_color_and_the_preview(driver: EditorDriver) -> None:
    asked, widgets = shown(driver)
    driver.click(*widgets["button:clicks:color"].rect.center)
    asked, widgets = shown(driver)
    before, after = (camera.to_pixels(np.array(RUG)) for camera in asked.preview.cameras)
    assert pixel(driver, before) == (224, 224, 255)
    solid = pixel(driver, after)
    driver.click(*before.tolist())
    asked, widgets = shown(driver)
    assert asked.form.entries == {"free_color": "#e0e0ff"}
    # the rows of colors are in sight, and do not move the maps
    chip = widgets["button:color:#e0e0ff"]
    assert chip.text.strip() == "free"
    assert pixel(driver, asked.preview.cameras[1].to_pixels(np.array(RUG))) != solid
    # a click into the right map still keeps a part
    driver.click(*asked.preview.cameras[1].to_pixels(np.array((8.0, 1.0))).tolist())
    asked, _ = shown(driver)
    assert [float(word) for word in asked.form.entries["inside"].split()] == pytest.approx(
        (8.0, 1.0), abs=0.1
    )


def test_colors_can_be_set_by_keyboard(driver: EditorDriver) -> None:
    shown(driver)
    ui = driver.window.dialogs.ui
    for _ in range(60):
        if ui.focus == "clicks:color":
            break
        driver.press_key("tab")
        driver.run_frames(1)
    assert ui.focus == "clicks:color"
    driver.press_key("space")
    driver.run_frames(2)
    for _ in range(10):
        if ui.focus == "color:#e0e0ff":
            break
        driver.press_key("tab")
        driver.run_frames(1)
    driver.press_key("space")
    asked, _ = shown(driver)
    assert asked.form.entries == {"free_color": "#e0e0ff"}
    assert ui.focus is not None and ui.focus == "color:#e0e0ff"
    driver.press_key("space")
    asked, _ = shown(driver)
    assert asked.form.entries == {"solid_color": "#e0e0ff"}


def test_the_report_is_visible(driver: EditorDriver) -> None:
    asked, _ = shown(driver)
    foot = max(camera.view[1] + camera.view[3] for camera in asked.preview.cameras)
    left = round(asked.preview.cameras[0].view[0])
    lines = np.array(
        [
            [driver.window.screen.get_at((x, y))[:3] for x in range(left, left + 120)]
            for y in range(round(foot) + 8, round(foot) + 60)
        ]
    )
    assert len(np.unique(lines.reshape(-1, 3), axis=0)) > 5
