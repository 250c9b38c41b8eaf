"""The context menu: what it selects, and its commands, which depend on the selection."""

from robocov.environment import Point, PolygonObstacle, WallObstacle
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.hit_test import find_owners
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.ui.actions import select_owners
from robocov_app.toolkit.tools.viewport import REACH_PX

DRAW_COMMANDS = (
    "tool:polygon",
    "tool:rectangle",
    "tool:circle",
    "tool:wall",
    "tool:boundary",
    "tool:disc",
)


def select_for_menu(editor: Editor, point: Point) -> None:
    """Select the object at a point, m, unless it is selected already or vertices are selected."""
    if editor.selection.vertices:
        return
    owners = find_owners(editor.sketch, point, 0.5 * REACH_PX * editor.pixel)
    if not any(owner in editor.selection.owners for owner in owners):
        editor.select(Selection.of(*owners[:1]))


def list_menu_commands(editor: Editor) -> list[str]:
    """Return the names of the commands that apply to the selection; an empty name separates two groups."""
    if editor.selection.vertices:
        groups = _list_vertex_groups(editor)
    else:
        groups = _list_object_groups(editor)
    names: list[str] = []
    for group in groups:
        if group and names:
            names.append("")
        names += group
    return names


def _list_object_groups(editor: Editor) -> list[list[str]]:
    selection = editor.selection
    if not selection:
        return [["paste", "select:all"], [*DRAW_COMMANDS], ["fit", "background", "try"]]
    if selection.items & editor.sketch.index_by_key.keys():
        return _list_obstacle_groups(editor)
    if selection.starts:
        return [["copy", "duplicate", "delete"], ["name", "show:robots", "fit:selection"]]
    return [["fit", "simplify", "straighten", "repair"], ["tool:boundary"]]


def _list_obstacle_groups(editor: Editor) -> list[list[str]]:
    """Return the groups of commands for a selection that contains obstacles."""
    selection = editor.selection
    obstacle_count = len(selection.items & editor.sketch.index_by_key.keys())
    groups = [["cut", "copy", "duplicate", "delete"]]
    groups.append(_list_width_commands(editor))
    if len(selection.owners) == 1 and not selection.boundary:
        groups.append(["name", "fit:selection"])
    groups.append(["rotate:left", "rotate:right", "mirror:x", "mirror:y"])
    if obstacle_count > 1:
        # The commands that align objects are only in the panel, so that the menu fits into the window.
        groups.append(["unite", "subtract", "intersect", "divide"])
        groups.append(["group", "lock", "hide"])
    else:
        groups.append(["lock", "hide"])
    groups.append(_list_shape_commands(editor))
    return groups


def _list_width_commands(editor: Editor) -> list[str]:
    """Return the commands for the width of selected walls; a width can be typed for a single wall."""
    index_by_key = editor.sketch.index_by_key
    shapes = [editor.sketch.get_item(key).shape for key in editor.selection.items if key in index_by_key]
    if not any(isinstance(shape, WallObstacle) for shape in shapes):
        return []
    commands = ["wider", "narrower"]
    if len(editor.selection.owners) == 1:
        commands.append("wall:width")
    return commands


def _list_shape_commands(editor: Editor) -> list[str]:
    """Return the commands that depend on the kinds of the selected obstacles and on their problems."""
    selection = editor.selection
    index_by_key = editor.sketch.index_by_key
    shapes = [editor.sketch.get_item(key).shape for key in selection.items if key in index_by_key]
    walls = sum(isinstance(shape, WallObstacle) for shape in shapes)
    polygons = sum(isinstance(shape, PolygonObstacle) for shape in shapes)
    names: list[str] = []
    if len(shapes) > 1 and walls == len(shapes):
        names.append("join")
    if polygons < len(shapes):
        names.append("polygons")
    if polygons or selection.boundary:
        names += ["simplify", "straighten"]
    if len(selection.owners) == 1 and len(shapes) == polygons == 1:
        names.append("boundary:of")
    if any(problem.owner in selection.owners and problem.is_error for problem in editor.problems):
        names.append("repair")
    return names


def _list_vertex_groups(editor: Editor) -> list[list[str]]:
    """Return the groups of commands for selected vertices."""
    selection = editor.selection
    edit = ["delete", "bevel", "round"]
    align = ["align:left", "align:bottom"]
    if len(selection.vertices) == 1:
        align = []
        (vertex,) = selection.vertices
        shape = editor.sketch.get_shape(vertex.owner)
        if isinstance(shape, WallObstacle):
            if vertex.index in (0, len(shape.points) - 1):
                edit.append("extend")
            else:
                edit.append("split")
        if vertex.ring:
            edit.append("fill")
    copy: list[str] = []
    if BOUNDARY not in select_owners(selection).owners:
        copy = ["copy", "duplicate"]
    return [edit, align, ["straighten", "simplify"], copy]
