"""Editor actions that are shared by commands, menus and fields of the panel."""

from collections.abc import Callable

from robocov.environment import CircleObstacle, DiscStart, Point, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import clipboard, density, fixes, paths, properties, transform, vertices
from robocov_app.editor.model import require
from robocov_app.editor.model.selection import Change, Selection, Vertex, find_position
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.toolkit.tools.viewport import REACH_PX

Edit = Callable[..., Change]
FAR_STEPS = 10  # grid steps by which an arrow key with Shift moves the selection
DUPLICATE_STEPS = 5.0  # displacement of a duplicate, in grid steps
TRIM_STEPS = 2  # default length that is cut off corners, in grid steps
MIN_WALL_WIDTH_M = 0.01
# Types of shapes that have each attribute.
_SHAPES_WITH = {"width": (WallObstacle,), "radius": (CircleObstacle, DiscStart)}


def require_selection(editor: Editor) -> Selection:
    """Return the selected objects and owners of selected vertices; raise MapError if there are none."""
    return require(
        select_owners(editor.selection), "nothing is selected: click something first, or press Ctrl+A"
    )


def select_owners(selection: Selection) -> Selection:
    """Return a selection in which the owners of vertices replace the vertices."""
    owners = {vertex.owner for vertex in selection.vertices}
    return selection.without_vertices().union(Selection.of(*owners))


def prefer_vertices(selection: Selection) -> Selection:
    """Return only the vertices of a selection, or all of it if there are none."""
    if not selection.vertices:
        return selection
    return Selection(vertices=selection.vertices)


def align(editor: Editor, side: transform.Side) -> None:
    """Align the selected vertices at a side or, if no vertices are selected, the selected objects."""
    selection = editor.selection
    if not selection.vertices:
        selection = require_selection(editor)
    editor.apply(transform.align(editor.sketch, selection, side))


def toggle_motion(editor: Editor) -> str:
    """Start or stop the animation of moving obstacles; return the status message."""
    if editor.motion_start_s is not None:
        editor.motion_start_s = None
        return "obstacles are shown at time zero"
    require(paths.list_moving_obstacles(editor.sketch), "no obstacle moves: the tool Path gives one a path")
    editor.motion_start_s = editor.now
    return "obstacles move as in a run; L stops them"


def remove_last(editor: Editor) -> None:
    """Remove the last point of the drawing or, if nothing is being drawn, delete the selection."""
    has_removed = editor.tool.remove_last(editor)
    if not has_removed and not editor.tool.is_busy and editor.selection:
        delete(editor)


def delete(editor: Editor) -> None:
    """Delete the selected vertices or, if no vertices are selected, the selected objects."""
    selection = prefer_vertices(require(editor.selection, "nothing is selected: click something first"))
    if selection.vertices:
        editor.apply(vertices.delete_vertices(editor.sketch, selection))
    else:
        editor.apply(properties.delete(editor.sketch, selection))


def copy(editor: Editor) -> str:
    """Copy the selected objects to the clipboard; return the status message."""
    selection = select_owners(editor.selection)
    editor.clipboard.put(clipboard.copy_selection(editor.sketch, selection))
    return f"copied: {selection.describe(editor.sketch)}"


def cut(editor: Editor) -> None:
    """Copy the selected objects to the clipboard, and delete them."""
    copy(editor)
    editor.apply(properties.delete(editor.sketch, select_owners(editor.selection)))


def paste(editor: Editor, position: Point | None) -> None:
    """Paste the clipboard at a position, m; None pastes objects at their original positions."""
    text = editor.clipboard.get()
    require(text.strip(), "the clipboard is empty")
    grid = None
    if "grid" in editor.snaps:
        grid = editor.grid
    editor.apply(clipboard.paste(editor.sketch, text, position, grid))


def duplicate(editor: Editor) -> None:
    """Duplicate the selected objects with a displacement to the lower right."""
    offset = editor.grid * DUPLICATE_STEPS
    editor.apply(transform.duplicate(editor.sketch, require_selection(editor), offset, -offset))


def level(editor: Editor) -> None:
    """Rotate the map so that the measured line is horizontal or vertical."""
    measured = editor.toolbox.tape.measured
    require(len(measured) == 2, "measure along a wall first: the tool Measure, two clicks")
    start, end = measured
    editor.apply(transform.level_map(editor.sketch, start, end))
    editor.toolbox.tape.cancel(editor)


def nudge(editor: Editor, steps: int, x: int, y: int) -> None:
    """Move the selection by a number of grid steps in a direction (x, y)."""
    selection = require(
        editor.selection, "nothing is selected: arrows move the selection; Ctrl and arrows move the sheet"
    )
    length = steps * editor.grid
    change = move(editor, x * length, y * length, prefer_vertices(selection))
    editor.apply(change, drag=("nudge", selection))


def move(editor: Editor, dx: float, dy: float, selection: Selection) -> Change:
    """Return the change that moves the selected vertices, or else the selected objects, by (dx, dy), m."""
    if selection.vertices:
        return vertices.move_vertices(editor.sketch, selection, dx, dy)
    return transform.move(editor.sketch, selection, dx, dy)


def cancel(editor: Editor) -> None:
    """Clear the typed value; without one, cancel the tool's action, or choose the selection tool."""
    if editor.typed:
        editor.typed = ""
        return
    had_something = editor.tool.cancel(editor)
    if not had_something and editor.tool is not editor.toolbox.selector:
        editor.choose_tool("select", shows_hint=False)


def select_next(editor: Editor, step: int) -> None:
    """Select the next object of the map, or the previous one if the step is -1."""
    order: list[Owner] = [item.key for item in editor.sketch.obstacles if not item.hidden]
    order += editor.start_names
    if editor.sketch.boundary is not None:
        order.append(BOUNDARY)
    if not order:
        return
    selected = [order.index(owner) for owner in select_owners(editor.selection).owners if owner in order]
    if not selected:
        # If nothing is selected, start at the first object, or at the last one.
        index = 0 if step > 0 else -1
    elif step > 0:
        index = max(selected) + step
    else:
        index = min(selected) + step
    editor.select(Selection.of(order[index % len(order)]))


def require_vertex(editor: Editor) -> Vertex:
    """Return the selected vertex; raise MapError unless exactly one is selected."""
    selected = editor.selection.vertices
    require(len(selected) == 1, "select one vertex first: click an obstacle, then one of its corners")
    return next(iter(selected))


def trim_corners(editor: Editor, edit: Edit, length: float | None = None) -> None:
    """Bevel or round the selected corners with a length, m; by default, `TRIM_STEPS` grid steps."""
    corners = require(
        Selection(vertices=editor.selection.vertices),
        "select corners first: click an obstacle, then its corners, or drag a box around them",
    )
    editor.apply(edit(editor.sketch, corners, length or TRIM_STEPS * editor.grid))


def split_wall(editor: Editor) -> None:
    """Split a wall into two at the selected vertex."""
    editor.apply(vertices.split_wall(editor.sketch, require_vertex(editor)))


def extend_wall(editor: Editor) -> None:
    """Extend a wall from the selected end to the cursor."""
    cursor = require(editor.cursor, "move the mouse to the new end of the wall")
    vertex = require_vertex(editor)
    origin = find_position(editor.sketch, vertex)
    end = editor.snap(cursor, REACH_PX * editor.pixel, origin).point
    editor.apply(vertices.extend_wall(editor.sketch, vertex, end))


def fill_hole(editor: Editor) -> None:
    """Fill the hole to which the selected vertex belongs."""
    vertex = require_vertex(editor)
    if not isinstance(vertex.owner, int) or vertex.ring == 0:
        raise MapError("select a vertex of the hole first")
    editor.apply(vertices.fill_hole(editor.sketch, vertex.owner, vertex.ring))


def scale_wall_width(editor: Editor, factor: float) -> None:
    """Multiply the width of the selected walls and of new walls by a factor."""
    selection = select_owners(editor.selection)
    shapes = [editor.sketch.get_item(key).shape for key in selection.items]
    widths = [shape.width for shape in shapes if isinstance(shape, WallObstacle)]
    previous = next(iter(widths), editor.wall_width)
    width = round(max(previous * factor, MIN_WALL_WIDTH_M), 3)
    if widths and not editor.tool.is_busy:
        change = properties.set_width(editor.sketch, selection, width)
        editor.apply(change, drag=("width", editor.selection))
    editor.set_length("wall_width", width)
    editor.show_message(f"walls are {width:g} m wide")


def select_next_start(editor: Editor) -> None:
    """Select the next start, and show the team there."""
    names = require(editor.start_names, "the map has no start yet: S draws one")
    name = names[0]
    if editor.start_name is not None and editor.start_name in names:
        name = names[(names.index(editor.start_name) + 1) % len(names)]
    editor.start = name
    editor.select(Selection.of(name))
    editor.show_message(f"start “{name}”")


def make_default_start(editor: Editor) -> None:
    """Make the selected start the default."""
    require(len(editor.selection.starts) == 1, "select one start first")
    (name,) = editor.selection.starts
    editor.apply(properties.make_default_start(editor.sketch, name))


def convert_to_areas(editor: Editor) -> None:
    """Turn the selected polygons into areas of the density."""
    weight = editor.toolbox.density.weight
    editor.apply(density.convert_polygons(editor.sketch, require_selection(editor), weight))


def fix_problem(editor: Editor) -> None:
    """Fix the chosen problem or, if none is chosen, the first that can be fixed automatically."""
    problems = editor.problems
    if editor.problem is not None:
        problems = (editor.problem,)
    for problem in problems:
        change = fixes.find_fix(editor.sketch, problem, editor.radius)
        if change is not None:
            editor.apply(change)
            return
    raise MapError("no problem can be fixed automatically")


def show_next_problem(editor: Editor) -> None:
    """Choose the next problem, and show its message."""
    problems = editor.problems
    if not problems:
        editor.problem = None
        if editor.measurement is None:
            editor.show_message("the map has not been checked yet")
        else:
            editor.show_message("the map has no problems")
        return
    index = 0
    if editor.problem in problems:
        index = problems.index(editor.problem) + 1
    problem = problems[index % len(problems)]
    editor.problem = problem
    editor.show_message(problem.message, is_error=problem.is_error)


def rename(editor: Editor, name: str) -> None:
    """Rename the selected obstacle or start."""
    owners = select_owners(editor.selection).owners
    require(len(owners) == 1, "select one obstacle or start first")
    (owner,) = owners
    editor.apply(properties.rename(editor.sketch, owner, name))


def find_common_length(editor: Editor, attribute: str) -> float | None:
    """Return the common width or radius of the selected objects, m; None if they differ or have none."""
    sketch, selection = editor.displayed
    lengths: set[float] = set()
    for owner in selection.owners:
        shape = sketch.get_shape(owner)
        if isinstance(shape, _SHAPES_WITH[attribute]):
            lengths.add(getattr(shape, attribute))
    if len(lengths) != 1:
        return None
    return lengths.pop()
