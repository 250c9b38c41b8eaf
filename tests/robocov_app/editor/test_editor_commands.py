"""What every action, typed command and field of the editor does to the map."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from driven_editor import Hands, of_map, opened_editor, sheet
from driven_window import opened as opened_viewer

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import create
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.tools.snapping import KINDS
from robocov_app.editor.tools.toolbox import toolbox
from robocov_app.editor.ui import commands
from robocov_app.editor.ui.commands import GROUPS, TYPED, all_commands, offered, run_typed, told_commands
from robocov_app.editor.ui.dialogs import Commands
from robocov_app.editor.ui.editor import GRIDS
from robocov_app.editor.ui.fields import FIELDS, coordinate
from robocov_app.editor.ui.settings import SHOWN, SNAPS, EditorSettings, kinds_of

LOW = PolygonObstacle(((1, 1), (4, 1), (4, 4), (1, 4)))
HIGH = PolygonObstacle(((3, 3), (6, 3), (6, 6), (3, 6)))
FAR = CircleObstacle((8, 8), 0.5)
WALLS = (WallObstacle(((1, 8), (3, 8)), 0.1), WallObstacle(((3, 8), (3, 9)), 0.1))


@pytest.fixture
def hands(tmp_path: Path) -> Iterator[Hands]:
    with opened_editor(tmp_path, sheet(LOW, HIGH, FAR, *WALLS)) as driver:
        yield driver


# the list of actions


def test_no_key_does_two_things_and_every_action_has_a_group() -> None:
    keys = [key for action in all_commands() for key in action.keys]
    assert len(keys) == len(set(keys))
    names = [action.name for action in all_commands()]
    assert len(names) == len(set(names))
    assert {action.group for action in told_commands()} == set(GROUPS)


def test_the_same_things_have_the_same_keys_as_in_the_demo(tmp_path: Path) -> None:
    with opened_viewer(tmp_path) as driver:
        theirs = {command.name: command.keys for command in driver.window.commands.listed}
    ours = {action.name: action.keys for action in all_commands()}
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


def test_every_action_is_done_by_something(hands: Hands) -> None:
    for action in all_commands():
        kind = action.name.partition(":")[0]
        assert kind in ("tool", "show", "snap") or action.name in hands.window._own, action.name
    assert set(commands._TOOL_KEYS) == set(toolbox())


def test_every_action_of_the_menus_is_one(hands: Hands) -> None:
    known = {action.name for action in all_commands()}
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
        hands.desk.select(selection)
        names = offered(hands.desk)
        assert {name for name in names if name} <= known
        assert names[0] and names[-1] and all(a or b for a, b in pairwise(names))


# edits by keys


def test_booleans_unite_subtract_and_intersect(hands: Hands) -> None:
    hands.select(0, 1)
    hands.key("alt+u")
    assert hands.sketch.item(0).geometry.area == pytest.approx(17) and len(hands.shapes) == 4
    hands.key("ctrl+z")
    hands.select(0, 1)
    hands.key("alt+s")
    assert hands.sketch.obstacles[0].geometry.area == pytest.approx(8)
    hands.key("ctrl+z")
    hands.select(0, 1)
    hands.key("alt+i")
    assert hands.sketch.obstacles[0].geometry.area == pytest.approx(1)


def test_aligning_and_distributing(hands: Hands) -> None:
    hands.select(0, 1, 2)
    hands.key("alt+left")
    assert {item.geometry.bounds[0] for item in hands.sketch.obstacles[:3]} == {1.0}
    hands.key("ctrl+z")
    hands.select(0, 1, 2)
    hands.key("alt+x")
    lows = sorted(item.geometry.bounds[0] for item in hands.sketch.obstacles[:3])
    highs = sorted(item.geometry.bounds[2] for item in hands.sketch.obstacles[:3])
    assert lows[1] - highs[0] == pytest.approx(lows[2] - highs[1], abs=1e-3)


def test_turning_and_mirroring(hands: Hands) -> None:
    hands.select(3)
    hands.key("q")
    assert {x for x, _ in hands.shapes[3].points} == {2.0}
    hands.key("e")
    hands.select(0, 2)
    before = hands.sketch.item(2).geometry.centroid.x
    hands.key("shift+h")
    assert hands.sketch.item(2).geometry.centroid.x != pytest.approx(before)


def test_walls_are_joined_split_and_extended(hands: Hands) -> None:
    hands.select(3, 4)
    hands.key("alt+j")
    (joined,) = [shape for shape in hands.shapes if isinstance(shape, WallObstacle)]
    assert joined.points == ((1, 8), (3, 8), (3, 9))
    key = next(item.key for item in hands.sketch.obstacles if item.shape is joined)
    hands.desk.select(Selection(vertices=frozenset({Vertex(key, 0, 1)})))
    hands.key("shift+c")
    assert sum(isinstance(shape, WallObstacle) for shape in hands.shapes) == 2
    hands.key("ctrl+z")
    hands.desk.select(Selection(vertices=frozenset({Vertex(key, 0, 2)})))
    hands.go((5, 9))
    hands.key("shift+w")
    assert next(s for s in hands.shapes if isinstance(s, WallObstacle)).points[-1] == (5, 9)


def test_copies_go_through_the_clipboard_also_to_another_window(hands: Hands, tmp_path: Path) -> None:
    hands.select(0, 2)
    hands.key("ctrl+c")
    hands.go((5, 5))
    hands.key("ctrl+v")
    assert len(hands.shapes) == 7
    hands.key("ctrl+x")
    assert len(hands.shapes) == 5
    text = hands.desk.pasteboard.get()
    with opened_editor(tmp_path) as other:
        other.desk.pasteboard.put(text)
        other.key("ctrl+shift+v")
        assert len(other.shapes) == 2
        other.desk.pasteboard.put("no map at all")
        other.key("ctrl+v")
        assert other.desk.trouble and len(other.shapes) == 2
        other.desk.pasteboard.put("")
        other.key("ctrl+v")
        assert "empty" in other.said


def test_deleting_and_duplicating(hands: Hands) -> None:
    hands.select(0)
    hands.key("ctrl+d")
    assert len(hands.shapes) == 6 and hands.shapes[5].vertices[0] == (1.5, 0.5)
    hands.key("delete")
    assert len(hands.shapes) == 5
    hands.key("delete")
    assert hands.desk.trouble and "nothing is selected" in hands.said
    hands.key("ctrl+a")
    hands.key("backspace")
    assert hands.shapes == []


def test_tab_goes_round_all_things(hands: Hands) -> None:
    seen = []
    for _ in range(7):
        hands.key("tab")
        seen.append(next(iter(hands.desk.selection.owners)))
    assert seen == [0, 1, 2, 3, 4, BOUNDARY, 0]
    hands.key("shift+tab")
    assert hands.desk.selection.owners == {BOUNDARY}


def test_an_obstacle_becomes_the_boundary_and_back(hands: Hands) -> None:
    hands.select(0)
    hands.window.do("boundary:of")
    assert hands.sketch.boundary == LOW.vertices and len(hands.shapes) == 4


def test_starts_are_chosen_and_ordered(tmp_path: Path) -> None:
    starts = (("one", DiscStart((2, 2), 1.0)), ("two", DiscStart((7, 7), 1.0)))
    with opened_editor(tmp_path, sheet(starts=starts)) as hands:
        assert hands.desk.start_name == "one"
        hands.key("shift+n")
        assert hands.desk.start_name == "two" and hands.desk.selection == Selection.of("two")
        hands.key("shift+d")
        assert hands.desk.start_names == ["two", "one"]
    with opened_editor(tmp_path, sheet()) as hands:
        hands.key("shift+n")
        assert "no start yet" in hands.said


# typed commands


@pytest.mark.parametrize(
    ("text", "wanted"),
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
def test_typed_commands_change_what_is_selected(hands: Hands, text: str, wanted: tuple[float, ...]) -> None:
    hands.select(0)
    hands.command(text)
    assert hands.sketch.item(0).geometry.bounds == pytest.approx(wanted)


def test_typed_commands_name_note_array_and_set(hands: Hands) -> None:
    hands.select(0)
    for text in ("name desk", "note oak, heavy", "title Our office"):
        hands.command(text)
    item = hands.sketch.item(0)
    assert (item.shape.name, item.note, hands.sketch.name) == ("desk", "oak, heavy", "Our office")
    hands.select(2)
    hands.command("circle 0.25")
    assert hands.shapes[2].radius == 0.25
    hands.command("array 2 x 2 1 -1")
    assert sum(isinstance(shape, CircleObstacle) for shape in hands.shapes) == 4
    hands.select(3)
    hands.command("width 0.3")
    assert hands.shapes[3].width == 0.3
    for text in ("grid 0.25", "angle 30", "radius 20cm", "robots 9", "seed 4", "wall 0.2"):
        hands.command(text)
    desk = hands.desk
    assert (desk.grid, desk.snap_angle, desk.radius, desk.robots) == (0.25, 30.0, 0.2, 9)
    assert (desk.seed, desk.wall_width) == (4, 0.2)


@pytest.mark.parametrize("word", sorted(TYPED))
def test_typed_commands_refuse_what_means_nothing_in_a_sentence(hands: Hands, word: str) -> None:
    before = hands.sketch
    for value in ("", "zzz", "-1e999", "1 2 3 4 5"):
        hands.desk.message = ""
        hands.desk.attempt(lambda value=value: run_typed(hands.desk, f"{word} {value}"))
        if word not in ("name", "note", "title", "seed"):
            assert hands.desk.trouble and hands.said and "\n" not in hands.said, (word, value)
    if word not in ("title",):
        assert hands.sketch is before
    with pytest.raises(MapError, match="did you mean"):
        run_typed(hands.desk, "rotat 30")


# fields


def test_fields_show_and_take_places_and_sizes(hands: Hands) -> None:
    hands.select(0)
    desk = hands.desk
    assert [FIELDS[name].text(desk) for name in ("x", "y", "wide", "high")] == ["1", "1", "3", "3"]
    FIELDS["x"].take(desk, "+0.5")
    FIELDS["high"].take(desk, "*2")
    assert hands.sketch.item(0).geometry.bounds == (1.5, 1, 4.5, 7)
    desk.select(Selection(vertices=frozenset({Vertex(0, 0, 0)})))
    FIELDS["y"].take(desk, "0.25")
    assert hands.shapes[0].vertices[0] == (1.5, 0.25)
    desk.select(Selection.of(2))
    assert [FIELDS[name].text(desk) for name in ("x", "y", "size:radius")] == ["8", "8", "0.5"]
    FIELDS["size:radius"].take(desk, "0.75")
    assert hands.shapes[2].radius == 0.75
    desk.select(Selection.of(3))
    FIELDS["width"].take(desk, "12cm")
    assert hands.shapes[3].width == 0.12 and FIELDS["width"].text(desk) == "0.12"


def test_fields_without_a_selection_are_empty_and_refuse(hands: Hands) -> None:
    hands.desk.select(Selection())
    for name in ("x", "y", "wide", "high", "width", "size:radius", "name", "note"):
        assert FIELDS[name].text(hands.desk) == ""
    for name in ("x", "wide", "picture:scale", "picture:turn", "picture:opacity"):
        with pytest.raises(MapError):
            FIELDS[name].take(hands.desk, "1")


@pytest.mark.parametrize(("text", "wanted"), [("3", 3.0), ("+0.5", 2.5), ("-1", -1.0), ("120cm", 1.2)])
def test_coordinates_are_typed_whole_or_as_a_step(text: str, wanted: float) -> None:
    assert coordinate(text, 2.0) == pytest.approx(wanted)


# settings, switches, messages


def test_the_grid_goes_through_round_spacings(hands: Hands) -> None:
    for _ in range(20):
        hands.key("-")
    assert hands.desk.grid == GRIDS[0]
    for _ in range(20):
        hands.key("=")
    assert hands.desk.grid == GRIDS[-1]


def test_switches_are_remembered_by_name(hands: Hands) -> None:
    hands.key("1")
    assert "grid" not in hands.desk.snaps
    hands.key("0")
    assert not hands.desk.snaps
    hands.key("0")
    assert hands.desk.snaps == set(SNAPS)
    hands.key("a")
    assert "robots" in hands.desk.shown
    assert kinds_of(set(SNAPS)) == KINDS
    assert set(EditorSettings().shown) <= set(SHOWN)


def test_messages_go_after_a_while(hands: Hands) -> None:
    hands.desk.say("hello")
    hands.window.frame(4.0)
    assert hands.said == "hello"
    hands.window.frame(2.0)
    assert hands.said == ""


def test_problems_are_gone_through_one_by_one(tmp_path: Path) -> None:
    crossed = PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4)))
    with opened_editor(tmp_path, sheet(crossed, WallObstacle(((0, 5), (9.9, 5)), 0.1))) as hands:
        assert any(problem.grave for problem in hands.desk.problems)
        hands.key("f8")
        first = hands.desk.problem
        assert first is hands.desk.problems[0] and hands.said == first.words
        hands.select(0)
        hands.key("alt+r")
        assert not any(problem.grave for problem in hands.desk.problems)
    with opened_editor(tmp_path, of_map("square")) as hands:
        hands.key("n")
        assert hands.said == "nothing is wrong with the map"


def test_groups_locks_and_what_is_hidden(hands: Hands) -> None:
    hands.select(0, 1)
    hands.key("ctrl+g")
    hands.key("escape")
    item = hands.sketch.obstacles[0]
    before = hands.picture()
    middle = item.geometry.representative_point()
    hands.click_at((middle.x, middle.y))
    assert hands.desk.selection.items == {0, 1}
    hands.key("ctrl+l")
    assert not hands.desk.selection.items and hands.said.endswith("locked")
    hands.wait()
    hands.click_at((middle.x, middle.y))
    assert not hands.desk.selection.items & {0, 1}
    hands.key("ctrl+shift+l")
    hands.key("ctrl+h")
    hands.go((0.2, 9.8))
    assert not hands.same(before) and all(item.hidden for item in hands.sketch.obstacles[:2])
    hands.key("ctrl+shift+l")
    hands.key("ctrl+shift+g")
    assert not any(item.group or item.hidden for item in hands.sketch.obstacles)


def test_a_problem_is_mended_by_a_key(hands: Hands) -> None:
    hands.desk.change(create.start_added(hands.sketch, PointsStart(((50.0, 5.0),))))
    hands.settle()
    hands.frames(3)
    hands.key("f8")
    assert "outside the boundary" in hands.said
    hands.key("shift+f8")
    assert "moved to where a robot fits" in hands.said
    hands.settle()
    hands.frames(3)
    assert not any(problem.grave for problem in hands.desk.problems)


@pytest.mark.parametrize("word", sorted(TYPED))
def test_commands_that_take_a_value_are_found_by_typing(word: str) -> None:
    palette = Commands()
    palette.show()
    palette.type(word)
    assert f"type:{word}" in [action.name for action in palette.found]
    assert not palette.is_command()


def test_a_command_chosen_from_the_palette_waits_for_its_value(tmp_path: Path) -> None:
    with opened_editor(tmp_path) as hands:
        hands.key("ctrl+k")
        hands.type("array")
        hands.key("return")
        assert hands.window.palette.open and hands.window.palette.text == "array "


def test_a_problem_is_mended_by_the_button_beside_it(hands: Hands) -> None:
    hands.desk.change(create.drawn(hands.sketch, CircleObstacle((30.0, 5.0), 1.0, "lamp")))
    hands.settle()
    hands.key("ctrl+tab", times=3)
    hands.frames(3)
    found = hands.window.panel.list
    (left, top, width, _) = found.box
    hands.click(left + 40, top + 14)
    assert hands.desk.problem is not None and hands.desk.problem.kind == "outside"
    hands.wait()
    hands.click(left + width - 30, top + 14)
    assert hands.said == "circle “lamp” deleted"


def test_what_was_typed_and_cannot_be_done_stays_to_be_corrected(tmp_path: Path) -> None:
    with opened_editor(tmp_path) as hands:
        hands.command("grid 99999")
        assert hands.desk.trouble and hands.window.palette.open and hands.window.palette.text == "grid 99999"
