"""Colors in the import dialog: by a click, by the keyboard, with a live preview."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from driven_editor import EditorDriver, build_sheet, open_editor
from PIL import Image, ImageDraw

from robocov_app.editor.ui.importing.dialog import ImportDialog
from robocov_app.editor.ui.importing.file_colors import (
    build_color_sheet,
    choose_next_role,
    find_role,
    list_declared_colors,
    set_role,
)
from robocov_app.editor.ui.importing.service import ImportService
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


def build_dialog(path: Path, kind: str = "svg") -> ImportDialog:
    import_dialog = ImportDialog(path, IMPORTERS[kind], DirectWorker(ImportService()), lambda _: None)
    import_dialog.poll()
    return import_dialog


def free_area(import_dialog: ImportDialog) -> float:
    import_dialog.poll()
    assert import_dialog.imported is not None and import_dialog.problem == ""
    return import_dialog.imported.environment.free_area


def test_clicks_cycle_a_color_through_its_roles(drawing: Path) -> None:
    import_dialog = build_dialog(drawing)
    assert free_area(import_dialog) == pytest.approx(ROOM - 6)
    for role, area in (("free", ROOM), ("solid", ROOM - 6), ("ignore", ROOM), (None, ROOM - 6)):
        import_dialog.form.cycle_color((224, 224, 255))
        assert find_role(import_dialog.form.texts, (224, 224, 255)) == role
        assert free_area(import_dialog) == pytest.approx(area)
        # Ignored shapes can still be clicked.
        assert import_dialog.imported is not None and import_dialog.imported.sheet is not None
        assert import_dialog.imported.sheet.find_color(*RUG) == (224, 224, 255)
    assert import_dialog.form.texts == {}


def test_clicked_colors_are_added_to_typed_ones() -> None:
    entries = {"free_color": "red, lightblue", "cell": "1"}
    set_role(entries, (0, 0, 255), "free")
    assert entries == {"free_color": "red, lightblue, #0000ff", "cell": "1"}
    set_role(entries, (255, 0, 0), "solid")
    assert entries == {"free_color": "lightblue, #0000ff", "solid_color": "#ff0000", "cell": "1"}
    assert list_declared_colors(entries) == [(173, 216, 230), (0, 0, 255), (255, 0, 0)]
    set_role(entries, (255, 0, 0), None)
    assert "solid_color" not in entries
    # Half a name is not a color.
    entries["free_color"] = "lightbl"
    assert list_declared_colors(entries) == []
    assert choose_next_role(choose_next_role(choose_next_role(choose_next_role(None)))) is None


def test_a_click_finds_the_topmost_shape(drawing: Path) -> None:
    color_sheet = build_color_sheet(IMPORTERS["svg"].read(drawing, ReadOptions()))
    assert color_sheet is not None
    assert color_sheet.colors == ((200, 200, 200), (0, 0, 0), (224, 224, 255))
    assert color_sheet.find_color(*RUG) == (224, 224, 255)
    assert color_sheet.find_color(5.0, 5.0) == (0, 0, 0)
    assert color_sheet.find_color(8.0, 1.0) == (200, 200, 200)
    assert color_sheet.find_color(-1.0, 1.0) is None


def save_picture(folder: Path) -> Path:
    """Save a plan with soft edges, a pale blue rug and a red line."""
    large = Image.new("RGB", (800, 480), "white")
    draw = ImageDraw.Draw(large)
    draw.rectangle((0, 0, 799, 479), outline="black", width=16)
    draw.rectangle((83, 83, 322, 242), fill="#a0c0ff")
    draw.line((0, 350, 799, 350), fill="red", width=8)
    large.resize((200, 120), Image.Resampling.LANCZOS).save(folder / "plan.png")
    return folder / "plan.png"


def test_colors_of_a_picture_ignore_soft_edges(tmp_path: Path) -> None:
    color_sheet = build_color_sheet(IMPORTERS["image"].read(save_picture(tmp_path), ReadOptions(cell=0.1)))
    assert color_sheet is not None
    names = {(255, 255, 255), (160, 192, 255), (0, 0, 0), (255, 0, 0)}
    assert set(color_sheet.colors) == names
    assert color_sheet.find_color(5.0, 8.0) == (160, 192, 255)
    assert color_sheet.find_color(5.0, 12.0 - 35.0 / 4) == (255, 0, 0)
    assert color_sheet.find_color(25.0, 5.0) is None and color_sheet.find_color(5.0, -0.01) is None
    import_dialog = build_dialog(save_picture(tmp_path), "image")
    import_dialog.form.set_text("cell", "0.1")
    split = free_area(import_dialog)
    import_dialog.form.cycle_color((255, 0, 0))
    assert find_role(import_dialog.form.texts, (255, 0, 0)) == "free"
    assert free_area(import_dialog) > split + 50


def test_a_map_without_colors_has_no_sheet(tmp_path: Path) -> None:
    foreign = IMPORTERS["svg"].read(write_drawing(tmp_path), ReadOptions())
    assert build_color_sheet(foreign) is not None
    path = tmp_path / "plan.wkt"
    path.write_text(shapely.box(0, 0, 5, 5).wkt)
    import_dialog = build_dialog(path, "wkt")
    assert free_area(import_dialog) == pytest.approx(25.0)
    assert (
        import_dialog.imported is not None
        and import_dialog.imported.sheet is None
        and import_dialog.sheet is None
    )


def write_drawing(folder: Path) -> Path:
    path = folder / "plan.svg"
    path.write_text(SVG)
    return path


@pytest.fixture(params=[("light", (900, 600)), ("dark", (1280, 720))])
def driver(request: Any, tmp_path: Path) -> Iterator[EditorDriver]:
    theme, size = request.param
    write_drawing(tmp_path)
    with open_editor(tmp_path, build_sheet(), theme=theme, size=size) as driver:
        driver.press_key("ctrl+o")
        driver.type("plan.svg")
        driver.press_key("return")
        driver.run_frames(3)
        yield driver


def get_dialog(driver: EditorDriver) -> tuple[ImportDialog, Any]:
    driver.run_frames(2)
    import_dialog = driver.editor.dialogs.current
    assert isinstance(import_dialog, ImportDialog)
    return import_dialog, driver.window.dialogs.ui.widgets


def get_pixel(driver: EditorDriver, point: Any) -> tuple[int, ...]:
    x, y = point
    return tuple(driver.window.screen.get_at((round(x), round(y))))[:3]


def test_a_click_on_the_preview_changes_a_color_and_the_preview(driver: EditorDriver) -> None:
    import_dialog, widgets = get_dialog(driver)
    driver.click(*widgets["button:clicks:color"].rect.center)
    import_dialog, widgets = get_dialog(driver)
    camera_before, camera_after = import_dialog.preview.cameras
    before = camera_before.to_pixels(np.array(RUG))
    after = camera_after.to_pixels(np.array(RUG))
    assert get_pixel(driver, before) == (224, 224, 255)
    solid = get_pixel(driver, after)
    driver.click(*before.tolist())
    import_dialog, widgets = get_dialog(driver)
    assert import_dialog.form.texts == {"free_color": "#e0e0ff"}
    # The rows of colors are visible and do not move the maps.
    chip = widgets["button:color:#e0e0ff"]
    assert chip.text.strip() == "free"
    assert get_pixel(driver, import_dialog.preview.cameras[1].to_pixels(np.array(RUG))) != solid
    # A click on the right map still keeps a part.
    driver.click(*import_dialog.preview.cameras[1].to_pixels(np.array((8.0, 1.0))).tolist())
    import_dialog, _ = get_dialog(driver)
    assert [float(word) for word in import_dialog.form.texts["inside"].split()] == pytest.approx(
        (8.0, 1.0), abs=0.1
    )


def test_colors_can_be_set_by_keyboard(driver: EditorDriver) -> None:
    get_dialog(driver)
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
    import_dialog, _ = get_dialog(driver)
    assert import_dialog.form.texts == {"free_color": "#e0e0ff"}
    assert ui.focus is not None and ui.focus == "color:#e0e0ff"
    driver.press_key("space")
    import_dialog, _ = get_dialog(driver)
    assert import_dialog.form.texts == {"solid_color": "#e0e0ff"}


def test_the_report_is_visible(driver: EditorDriver) -> None:
    import_dialog, _ = get_dialog(driver)
    foot = max(camera.view[1] + camera.view[3] for camera in import_dialog.preview.cameras)
    left = round(import_dialog.preview.cameras[0].view[0])
    lines = np.array(
        [
            [driver.window.screen.get_at((x, y))[:3] for x in range(left, left + 120)]
            for y in range(round(foot) + 8, round(foot) + 60)
        ]
    )
    assert len(np.unique(lines.reshape(-1, 3), axis=0)) > 5
