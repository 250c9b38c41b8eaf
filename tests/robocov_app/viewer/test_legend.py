"""The layer bar: chips that explain the visible layers and toggle them, presets, and the menu of layers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pygame
import pytest

from robocov.mapfile import load_map
from robocov_app.look import legend
from robocov_app.render.canvas import Canvas
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.overlay import create_flat_canvas
from robocov_app.toolkit.widgets import tool_tip
from robocov_app.viewer.canvas.layer_chips import build_layer_entries, measure_chip
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.layer_presets import LAYER_GROUPS, LAYER_PRESETS
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.window.window import ViewerWindow

MIN_GAP_PX = 2
"""Minimum distance between a title in a menu and its shortcut at scale 1, px."""


@contextmanager
def open_window(
    tmp_path: Path, *controllers: str, size: tuple[int, int] = (1280, 720), n_frames: int = 10
) -> Iterator[ViewerWindow]:
    choices = tuple(ControllerChoice(name) for name in controllers or ("rapf",))
    session = Session(SessionScenario(load_map("square"), choices))
    with ViewerLauncher(session, "square", tmp_path, size=size, headless=True, lattice=32).window() as window:
        for _ in range(n_frames):
            window.run_frame(1 / 30)
        yield window


def find_chips(window: ViewerWindow) -> dict[str, pygame.Rect]:
    return {chip.command: box for chip, box in window.layer_bar.chips}


def list_texts(window: ViewerWindow) -> list[str]:
    """Return the texts next to the symbols of the chips."""
    return [text for chip, _ in window.layer_bar.chips if chip.entries for text in chip.texts]


def click(window: ViewerWindow, box: pygame.Rect) -> None:
    for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
        window.handle_event(pygame.event.Event(kind, pos=box.center, button=1, touch=False))
    window.run_frame(1 / 30)


@pytest.mark.parametrize("controllers", [("rpf", "lloyd"), ("lloyd", "rpf")])
def test_the_chip_of_centroids_names_controllers_without_goals(
    tmp_path: Path, controllers: tuple[str, str]
) -> None:
    with open_window(tmp_path, *controllers) as window:
        assert "Centroids (not RPF)" in list_texts(window)


def test_the_chip_of_contacts_stays_after_the_first_contact(tmp_path: Path) -> None:
    with open_window(tmp_path) as window:
        session = window.viewer.session
        assert "Contacts" not in list_texts(window)
        low_x, low_y, _, _ = session.displayed.environment.region.bounds
        radius = session.displayed.get_setup(window.viewer.pane).team.min_radius
        session.place_robot(1, (low_x + radius, low_y + 1.0))
        window.run_frame(0.0)
        assert len(window.canvas.scenes[0].contacts) == 1
        session.place_robot(1, (low_x + 1.0, low_y + 1.0))
        window.run_frame(0.0)
        assert len(window.canvas.scenes[0].contacts) == 0
        assert "Contacts" in list_texts(window)


def test_chips_explain_each_symbol_once(tmp_path: Path) -> None:
    with open_window(tmp_path, "rpf", "lloyd", "atlas") as window:
        texts = list_texts(window)
    assert {"Centroids (not RPF)", "Goals"} < set(texts)
    assert len(texts) == len(set(texts))


@pytest.mark.parametrize("controllers", [("rapf",), ("rapf", "lloyd")])
def test_a_click_toggles_a_layer_and_nothing_moves(tmp_path: Path, controllers: tuple[str, ...]) -> None:
    with open_window(tmp_path, *controllers) as window:
        before = find_chips(window)
        place = window.canvas.to_pixel((1.0, 1.0))
        click(window, before["layer:starts"])
        assert "starts" not in window.viewer.view.layers
        assert find_chips(window) == before
        assert window.canvas.to_pixel((1.0, 1.0)) == place
        click(window, before["layer:starts"])
        assert "starts" in window.viewer.view.layers


def test_a_click_on_a_chip_does_not_act_on_the_map(tmp_path: Path) -> None:
    with open_window(tmp_path) as window:
        window.run_command("tool:robot")
        robots = len(window.viewer.robot_numbers)
        click(window, find_chips(window)["layer:cells"])
        assert len(window.viewer.robot_numbers) == robots


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1920, 1080)])
@pytest.mark.parametrize("preset", LAYER_PRESETS, ids=lambda preset: preset.name)
def test_chips_stay_within_the_arena(tmp_path: Path, size: tuple[int, int], preset) -> None:
    with open_window(tmp_path, size=size) as window:
        window.run_command(f"preset:{preset.name}")
        window.run_command("layers")
        window.run_frame(1 / 30)
        left, _, width, _ = window.layout.arena
        boxes = [box for _, box in window.layer_bar.chips]
        assert all(left <= box.left and box.right <= left + width for box in boxes)
        assert all(first.right < second.left for first, second in itertools.pairwise(boxes))
        assert all(box.right <= left + width for _, box in window.layer_bar.rows)
        assert all(box.bottom <= size[1] for _, box in window.layer_bar.rows)


@pytest.mark.parametrize("width", range(900, 1921, 75))
@pytest.mark.parametrize("preset", LAYER_PRESETS, ids=lambda preset: preset.name)
def test_no_chip_lacks_a_text_for_which_there_is_space(preset, width: int, tmp_path: Path) -> None:
    with open_window(tmp_path, size=(width, 720), n_frames=1) as window:
        window.run_command(f"preset:{preset.name}")
        window.run_frame(1 / 30)
        canvas = create_flat_canvas(window.screen, window.theme, window.layout.scale)
        placed = window.layer_bar.chips
        spaces = [second.left - first.right for (_, first), (_, second) in itertools.pairwise(placed)]
        free_width = max(spaces) - min(spaces)
        for chip, box in placed:
            if not chip.has_text:
                missing_width = measure_chip(canvas, replace(chip, has_text=True)) - box.width
                assert missing_width > free_width, chip.command


def test_arrows_of_the_lesson_keep_their_words_in_a_small_window(tmp_path: Path) -> None:
    with open_window(tmp_path, size=(900, 600)) as window:
        assert "Centroids" in list_texts(window)
        window.run_command("tour")
        for _ in range(10):
            window.run_frame(1 / 30)
        assert {"Attraction", "Robot repulsion", "Obstacle repulsion"} <= set(list_texts(window))


@pytest.mark.parametrize("width", [900, 1280])
def test_the_shading_of_a_density_is_explained(tmp_path: Path, width: int) -> None:
    session = Session(SessionScenario(load_map("hospital")))
    launcher = ViewerLauncher(session, "hospital", tmp_path, size=(width, 720), headless=True, lattice=16)
    with launcher.window() as window:
        window.run_frame(1 / 30)
        assert "Density φ" in list_texts(window)


@pytest.mark.parametrize("width", [900, 1280])
def test_a_lesson_shows_no_presets_next_to_its_chips(tmp_path: Path, width: int) -> None:
    def has_presets() -> bool:
        return any(command.startswith("preset") for command in find_chips(window))

    with open_window(tmp_path, size=(width, 720)) as window:
        assert has_presets()
        window.run_command("tour")
        window.run_frame(1 / 30)
        assert "layer:force_attraction" in find_chips(window)
        assert not has_presets()
        window.run_command("tour")
        window.run_frame(1 / 30)
        assert has_presets()


def test_chips_of_a_lesson_disappear_with_it(tmp_path: Path) -> None:
    with open_window(tmp_path) as window:
        before = find_chips(window)
        window.run_command("tour")
        window.run_frame(1 / 30)
        assert find_chips(window) != before
        window.run_command("cancel")
        window.run_frame(1 / 30)
        assert find_chips(window) == before


@pytest.mark.parametrize("preset", LAYER_PRESETS, ids=lambda preset: preset.name)
def test_every_unusual_symbol_has_a_chip_in_a_small_window(tmp_path: Path, preset) -> None:
    """Chips that do not fit with their text remain with a tip; only standard layers are left out."""
    with open_window(tmp_path, size=(900, 600)) as window:
        window.run_command(f"preset:{preset.name}")
        window.run_frame(1 / 30)
        unusual = [layer for layer in window.canvas.layers if not layer.is_default]
        explained = [layer for layer in unusual if build_layer_entries(layer, window.canvas.scenes)]
        visible = {f"layer:{layer.name}" for layer in explained if layer.name in preset.layers}
        assert visible <= set(find_chips(window))


def test_presets_and_the_menu_have_every_layer(tmp_path: Path) -> None:
    names = {layer.name for layer in build_standard_layers()}
    grouped = [name for group in LAYER_GROUPS.values() for name in group]
    assert sorted(grouped) == sorted(names)
    for preset in LAYER_PRESETS:
        assert preset.layers <= names
    with open_window(tmp_path) as window:
        click(window, find_chips(window)["layers"])
        rows = {chip.command: box for chip, box in window.layer_bar.rows}
        assert {f"layer:{name}" for name in names} <= set(rows)
        click(window, rows["layer:distances"])
        assert "distances" in window.viewer.view.layers
        click(window, rows["preset:why"])
        assert window.viewer.view.layers == next(p.layers for p in LAYER_PRESETS if p.name == "why")
        window.run_command("cancel")
        assert not window.layer_bar.is_open


@pytest.mark.parametrize(("width", "has_shortcuts"), [(900, False), (1100, True), (1280, True), (1920, True)])
def test_shortcuts_in_the_layer_menu_do_not_overlap_the_titles(
    width: int, has_shortcuts: bool, tmp_path: Path
) -> None:
    drawn: list[tuple[int, float, float]] = []

    def record_text(canvas: Canvas, text: str, position, *arguments, anchor="left", **options) -> float:
        text_width = canvas.measure_text(text, options.get("size", canvas.theme.text))
        left = position[0] - (text_width if anchor == "right" else 0.0)
        drawn.append((round(position[1]), left, left + text_width))
        return text_width

    with open_window(tmp_path, size=(width, 700)) as window:
        click(window, find_chips(window)["layers"])
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Canvas, "draw_text", record_text)
            window.run_frame(1 / 30)
        scale = window.layout.scale
        rows = window.layer_bar.rows
    menu_rows = [box for chip, box in rows if chip.kind == "row"]
    gaps = []
    for box in menu_rows:
        texts = sorted(
            (left, right) for y, left, right in drawn if box.collidepoint(left, y) and right > left
        )
        gaps += [start - end for (_, end), (start, _) in itertools.pairwise(texts)]
    assert menu_rows
    # In a narrow menu, shortcuts would leave too little space for the titles.
    assert bool(gaps) == has_shortcuts
    assert all(gap >= MIN_GAP_PX * scale for gap in gaps)


def test_different_marks_of_goals_share_a_chip(tmp_path: Path) -> None:
    with open_window(tmp_path, "rapf", "atlas", n_frames=2) as window:
        window.viewer.view.layers = window.viewer.view.layers | {"goals"}
        window.run_frame(1 / 30)
        (chip,) = [chip for chip, _ in window.layer_bar.chips if chip.command == "layer:goals"]
        assert {entry.style for entry in chip.entries} == {legend.CELL_CENTROID, legend.GOAL}
        assert "".join(chip.texts) == "Goals"


def test_a_key_goes_through_the_presets(tmp_path: Path) -> None:
    with open_window(tmp_path) as window:
        for preset in (*LAYER_PRESETS, LAYER_PRESETS[0]):
            window.run_command("preset:next")
            assert window.viewer.view.layers == preset.layers


def test_in_a_small_window_a_menu_replaces_the_presets(tmp_path: Path) -> None:
    with open_window(tmp_path, size=(900, 600)) as window:
        window.run_command("preset:why")
        window.run_frame(1 / 30)
        chips = find_chips(window)
        assert not any(command.startswith("preset:") for command in chips)
        click(window, chips["presets"])
        menu = window.dialogs.current
        assert isinstance(menu, Menu)
        assert [row.name for row in menu.rows if row] == [f"preset:{preset.name}" for preset in LAYER_PRESETS]


def test_the_tooltip_of_a_chip_says_what_a_click_does(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("robocov_app.toolkit.widgets.tool_tip.TIP_DELAY_S", 0.0)
    tips = []
    monkeypatch.setattr(
        "robocov_app.viewer.canvas.layer_bar.draw_tool_tip",
        lambda screen, text, *args, **kw: tips.append(text),
    )
    with open_window(tmp_path) as window:
        pixel = find_chips(window)["layer:cells"].center
        event = pygame.event.Event(pygame.MOUSEMOTION, pos=pixel, rel=(1, 1), buttons=(0, 0, 0), touch=False)
        window.handle_event(event)
        window.run_frame(1 / 30)
    assert tips[-1] == "Hide: Voronoi cells (1)"


def test_the_tooltip_of_the_first_chip_is_not_covered_by_the_tool_rail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[pygame.Rect] = []
    draw_box = tool_tip._draw_box

    def record_and_draw(screen: pygame.Surface, box: pygame.Rect, *arguments: Any) -> None:
        boxes.append(box)
        draw_box(screen, box, *arguments)

    monkeypatch.setattr(tool_tip, "_draw_box", record_and_draw)
    monkeypatch.setattr(tool_tip, "TIP_DELAY_S", 0.0)
    with open_window(tmp_path) as window:
        window.layer_bar.hover(find_chips(window)["layers"].center)
        window.draw()
        (box,) = boxes
        assert box.left < window.layout.arena.left
        left_color = window.screen.get_at((box.left + 4, box.centery))
        assert left_color == window.screen.get_at((box.right - 4, box.centery))
