"""Effects of every action, typed command and field of the editor on the map."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from driven_editor import EditorDriver, build_sheet, open_editor
from driven_window import open_viewer

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, WallObstacle
from robocov_app.editor.edits import create
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.ui.commands import GROUPS
from robocov_app.editor.ui.context_menu import list_menu_commands
from robocov_app.editor.ui.typed_commands import TYPED_COMMANDS, list_typed_commands
from robocov_app.toolkit.commands.palette import list_options
from robocov_app.toolkit.dialogs import Choice

LOW = PolygonObstacle(((1, 1), (4, 1), (4, 4), (1, 4)))
HIGH = PolygonObstacle(((3, 3), (6, 3), (6, 6), (3, 6)))
FAR = CircleObstacle((8, 8), 0.5)
WALLS = (WallObstacle(((1, 8), (3, 8)), 0.1), WallObstacle(((3, 8), (3, 9)), 0.1))


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, build_sheet(LOW, HIGH, FAR, *WALLS)) as driver:
        yield driver


# the list of actions


def test_keys_are_unique_and_every_command_has_a_group(driver: EditorDriver) -> None:
    listed = driver.window.commands.commands
    keys = [key for command in listed for key in command.keys]
    assert len(keys) == len(set(keys))
    names = [command.name for command in listed]
    assert len(names) == len(set(names))
    assert {command.group for command in listed if not command.hidden} == set(GROUPS)


def test_shared_commands_have_the_same_keys_in_the_viewer(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        theirs = {command.name: command.keys for command in driver.window.commands.commands}
    with open_editor(tmp_path) as driver:
        ours = {command.name: command.keys for command in driver.window.commands.commands}
    same = {
        *(
            "undo",
            "redo",
            "fit",
            "zoom:in",
            "zoom:out",
            "pan:left",
            "pan:right",
            "pan:up",
            "pan:down",
            "theme",
        ),
        *("panel", "tab", "fullscreen", "screenshot", "help", "palette", "quit", "cancel", "finish"),
        *("tool:polygon", "tool:wall", "tool:circle", "wider", "narrower", "more", "fewer"),
    }
    assert {name: ours[name] for name in same} == {name: theirs[name] for name in same}
    assert ours["save"] == theirs["save:session"] and ours["tool:measure"] == theirs["tool:ruler"]
    assert ours["show:grid"] == theirs["layer:grid"] and ours["tool:select"] == theirs["tool:hand"]


def test_every_menu_item_is_a_command(driver: EditorDriver) -> None:
    known = {command.name for command in driver.window.commands.commands}
    vertex = frozenset({Vertex(0, 0, 1)})
    for selection in (
        Selection(),
        Selection.of(0),
        Selection.of(2),
        Selection.of(3, 4),
        Selection.of(0, 1, 2),
        Selection.of(BOUNDARY),
        Selection(vertices=vertex),
        Selection(vertices=frozenset({Vertex(3, 0, 0)})),
        Selection(vertices=vertex | {Vertex(0, 0, 2)}),
    ):
        driver.editor.select(selection)
        names = list_menu_commands(driver.editor)
        assert {name for name in names if name} <= known
        assert names[0] and names[-1] and all(a or b for a, b in pairwise(names))


# edits by keys


def test_booleans_unite_subtract_and_intersect(driver: EditorDriver) -> None:
    driver.select(0, 1)
    driver.press_key("alt+u")
    assert driver.sketch.get_item(0).geometry.area == pytest.approx(17) and len(driver.shapes) == 4
    driver.press_key("ctrl+z")
    driver.select(0, 1)
    driver.press_key("alt+s")
    assert driver.sketch.obstacles[0].geometry.area == pytest.approx(8)
    driver.press_key("ctrl+z")
    driver.select(0, 1)
    driver.press_key("alt+i")
    assert driver.sketch.obstacles[0].geometry.area == pytest.approx(1)


def test_commands_align_and_distribute(driver: EditorDriver) -> None:
    driver.select(0, 1, 2)
    driver.press_key("alt+left")
    assert {item.geometry.bounds[0] for item in driver.sketch.obstacles[:3]} == {1.0}
    driver.press_key("ctrl+z")
    driver.select(0, 1, 2)
    driver.press_key("alt+x")
    lows = sorted(item.geometry.bounds[0] for item in driver.sketch.obstacles[:3])
    highs = sorted(item.geometry.bounds[2] for item in driver.sketch.obstacles[:3])
    assert lows[1] - highs[0] == pytest.approx(lows[2] - highs[1], abs=1e-3)


def test_commands_turn_and_mirror(driver: EditorDriver) -> None:
    driver.select(3)
    driver.press_key("q")
    assert {x for x, _ in driver.shapes[3].points} == {2.0}
    driver.press_key("e")
    driver.select(0, 2)
    before = driver.sketch.get_item(2).geometry.centroid.x
    driver.press_key("shift+h")
    assert driver.sketch.get_item(2).geometry.centroid.x != pytest.approx(before)


def test_walls_are_joined_split_and_extended(driver: EditorDriver) -> None:
    driver.select(3, 4)
    driver.press_key("alt+j")
    (joined,) = [shape for shape in driver.shapes if isinstance(shape, WallObstacle)]
    assert joined.points == ((1, 8), (3, 8), (3, 9))
    key = next(item.key for item in driver.sketch.obstacles if item.shape is joined)
    driver.editor.select(Selection(vertices=frozenset({Vertex(key, 0, 1)})))
    driver.press_key("shift+c")
    assert sum(isinstance(shape, WallObstacle) for shape in driver.shapes) == 2
    driver.press_key("ctrl+z")
    driver.editor.select(Selection(vertices=frozenset({Vertex(key, 0, 2)})))
    driver.move_to((5, 9))
    driver.press_key("shift+w")
    assert next(s for s in driver.shapes if isinstance(s, WallObstacle)).points[-1] == (5, 9)


def test_copies_go_through_the_clipboard_also_to_another_window(driver: EditorDriver, tmp_path: Path) -> None:
    driver.select(0, 2)
    driver.press_key("ctrl+c")
    driver.move_to((5, 5))
    driver.press_key("ctrl+v")
    assert len(driver.shapes) == 7
    driver.press_key("ctrl+x")
    assert len(driver.shapes) == 5
    text = driver.editor.clipboard.get()
    with open_editor(tmp_path) as other:
        other.editor.clipboard.put(text)
        other.press_key("ctrl+shift+v")
        assert len(other.shapes) == 2
        other.editor.clipboard.put("no map at all")
        other.press_key("ctrl+v")
        assert other.editor.has_error_message and len(other.shapes) == 2
        other.editor.clipboard.put("")
        other.press_key("ctrl+v")
        assert "empty" in other.message


def test_commands_delete_and_duplicate(driver: EditorDriver) -> None:
    driver.select(0)
    driver.press_key("ctrl+d")
    assert len(driver.shapes) == 6 and driver.shapes[5].vertices[0] == (1.5, 0.5)
    driver.press_key("delete")
    assert len(driver.shapes) == 5
    driver.press_key("delete")
    assert driver.editor.has_error_message and "Nothing is selected" in driver.message
    driver.press_key("ctrl+a")
    driver.press_key("backspace")
    assert driver.shapes == []


def test_tab_cycles_through_all_objects(driver: EditorDriver) -> None:
    seen = []
    for _ in range(7):
        driver.press_key("tab")
        seen.append(next(iter(driver.editor.selection.owners)))
    assert seen == [0, 1, 2, 3, 4, BOUNDARY, 0]
    driver.press_key("shift+tab")
    assert driver.editor.selection.owners == {BOUNDARY}


def test_an_obstacle_becomes_the_boundary_and_back(driver: EditorDriver) -> None:
    driver.select(0)
    driver.window.run_command("boundary:of")
    assert driver.sketch.boundary == LOW.vertices and len(driver.shapes) == 4


def test_the_next_start_is_selected_and_made_the_default(tmp_path: Path) -> None:
    starts = (("one", DiscStart((2, 2), 1.0)), ("two", DiscStart((7, 7), 1.0)))
    with open_editor(tmp_path, build_sheet(starts=starts)) as driver:
        assert driver.editor.start_name == "one"
        driver.press_key("shift+n")
        assert driver.editor.start_name == "two" and driver.editor.selection == Selection.of("two")
        driver.press_key("shift+d")
        # The first start is the default.
        assert driver.editor.start_names == ["two", "one"]


def test_a_map_without_starts_has_no_next_start(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        driver.press_key("shift+n")
        assert "no start yet" in driver.message


# typed commands


@pytest.mark.parametrize(
    ("text", "bounds"),
    [
        ("move 1 0.5", (2, 1.5, 5, 4.5)),
        ("place 0 0", (0, 0, 3, 3)),
        ("scale 2", (-0.5, -0.5, 5.5, 5.5)),
        ("scale 50%", (1.75, 1.75, 3.25, 3.25)),
        ("size 2 x 1", (1, 1, 3, 2)),
        ("offset 0.5", (0.5, 0.5, 4.5, 4.5)),
        ("offset -0.5", (1.5, 1.5, 3.5, 3.5)),
        ("rotate 90", (1, 1, 4, 4)),
    ],
)
def test_typed_commands_change_the_selection(
    driver: EditorDriver, text: str, bounds: tuple[float, ...]
) -> None:
    driver.select(0)
    driver.run_command(text)
    assert driver.sketch.get_item(0).geometry.bounds == pytest.approx(bounds)


def test_typed_commands_name_note_array_and_set(driver: EditorDriver) -> None:
    driver.select(0)
    for text in ("name desk", "note oak, heavy", "title Our office"):
        driver.run_command(text)
    item = driver.sketch.get_item(0)
    assert (item.shape.name, item.note, driver.sketch.name) == ("desk", "oak, heavy", "Our office")
    driver.select(2)
    driver.run_command("circle 0.25")
    assert driver.shapes[2].radius == 0.25
    driver.run_command("array 2 x 2 1 -1")
    assert sum(isinstance(shape, CircleObstacle) for shape in driver.shapes) == 4
    driver.select(3)
    driver.run_command("width 0.3")
    assert driver.shapes[3].width == 0.3
    for text in ("grid 0.25", "angle 30", "radius 20cm", "robots 9", "seed 4", "wall 0.2"):
        driver.run_command(text)
    editor = driver.editor
    assert (editor.grid, editor.snap_angle, editor.radius, editor.robots) == (0.25, 30.0, 0.2, 9)
    assert (editor.seed, editor.wall_width) == (4, 0.2)


def test_commands_that_take_a_value_are_found_by_typing(driver: EditorDriver) -> None:
    for word in TYPED_COMMANDS:
        assert f"{word} " in [option.completion for option in list_options(driver.window.commands, word)]
    assert {command.name for command in list_typed_commands(driver.editor)} == set(TYPED_COMMANDS)


def open_palette(driver: EditorDriver) -> Choice:
    asked = driver.editor.dialogs.current
    assert isinstance(asked, Choice)
    return asked


def test_a_command_chosen_from_the_palette_waits_for_its_value(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        driver.press_key("ctrl+k")
        driver.type("array")
        driver.press_key("return")
        assert open_palette(driver).text == "array "


def test_a_problem_is_fixed_by_the_button_next_to_it(driver: EditorDriver) -> None:
    driver.editor.apply(create.add_obstacle(driver.sketch, CircleObstacle((30.0, 5.0), 1.0, "lamp")))
    driver.settle()
    driver.press_key("ctrl+tab", times=3)
    driver.run_frames(3)
    driver.click(*driver.get_widget("option", "problem:0").rect.center)
    assert driver.editor.problem is not None and driver.editor.problem.kind == "outside"
    driver.wait()
    driver.push_button("fix:0")
    assert driver.message == "Circle “lamp” deleted"


def test_a_rejected_command_stays_for_correction(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        driver.run_command("grid 99999")
        assert "99999" in open_palette(driver).error and open_palette(driver).text == "grid 99999"


def test_a_negative_seed_is_rejected(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        driver.run_command("seed 5")
        driver.run_command("seed -3")
        assert open_palette(driver).error == "seed: expected a whole number of at least 0, got -3"
        assert driver.editor.seed == 5
