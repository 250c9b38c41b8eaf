"""What the actions that change the map do, by their names. Knows no pygame."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from robocov.environment import WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import (
    boolean,
    create,
    fixes,
    motion_path,
    properties,
    simplify,
    transform,
    vertices,
)
from robocov_app.editor.edits import density as density_edits
from robocov_app.editor.edits.clipboard import copied, pasted
from robocov_app.editor.model.selection import Selection, place_of
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.tools.density import DensityTool

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Point
    from robocov_app.editor.model.selection import Change, Vertex
    from robocov_app.editor.model.sketch import Owner
    from robocov_app.editor.ui.desk import Desk

FAR = 10
"""How many times farther arrows nudge with Shift."""

FINGER = 12.0
"""Pixels at scale 1 that a finger is wide."""

WIDER = 1.25

TOLERANCE = 0.02
"""Metres that simplified outlines may be off."""

_NUDGES = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}


def deeds(desk: Desk) -> dict[str, Callable[[], object]]:
    """Return what the actions do, by their names."""
    return {
        "undo": desk.undo,
        "redo": desk.redo,
        "cut": lambda: cut(desk),
        "copy": lambda: copy(desk),
        "paste": lambda: paste(desk, desk.cursor),
        "paste:there": lambda: paste(desk, None),
        "duplicate": lambda: _do(desk, transform.duplicated, desk.grid * FAR / 2, -desk.grid * FAR / 2),
        "delete": lambda: delete(desk),
        "back": lambda: back(desk),
        "finish": lambda: desk.tool.finish(desk),
        "cancel": lambda: cancel(desk),
        "select:all": lambda: desk.select(Selection.all(desk.sketch)),
        "select:next": lambda: select_next(desk, 1),
        "select:previous": lambda: select_next(desk, -1),
        **{name: partial(nudge, desk, x, y) for name, (x, y) in _NUDGES.items()},
        **{f"{name}:far": partial(nudge, desk, FAR * x, FAR * y) for name, (x, y) in _NUDGES.items()},
        "rotate:left": lambda: _do(desk, transform.rotated, 90.0),
        "rotate:right": lambda: _do(desk, transform.rotated, -90.0),
        "mirror:x": lambda: _do(desk, transform.mirrored, "x"),
        "mirror:y": lambda: _do(desk, transform.mirrored, "y"),
        **{
            f"align:{side}": partial(_do, desk, transform.aligned, side, single=True)
            for side in transform.SIDES
        },
        "distribute:x": lambda: _do(desk, transform.distributed, "x"),
        "distribute:y": lambda: _do(desk, transform.distributed, "y"),
        "raise": lambda: _do(desk, properties.raised, "top"),
        "lower": lambda: _do(desk, properties.raised, "bottom"),
        "group": lambda: _do(desk, properties.grouped),
        "ungroup": lambda: _do(desk, properties.ungrouped),
        "lock": lambda: _do(desk, properties.locked),
        "hide": lambda: _do(desk, properties.hidden),
        "release": lambda: desk.change(properties.released(desk.sketch)),
        "unite": lambda: _do(desk, boolean.united),
        "subtract": lambda: _do(desk, boolean.subtracted),
        "intersect": lambda: _do(desk, boolean.intersected),
        "divide": lambda: _do(desk, boolean.divided),
        "clip": lambda: desk.change(boolean.clipped(desk.sketch, desk.selection.without_vertices())),
        "repair": lambda: _do(desk, boolean.repaired),
        "join": lambda: _do(desk, vertices.joined),
        "polygons": lambda: _do(desk, properties.made_polygons),
        "boundary:of": lambda: _do(desk, properties.made_boundary),
        "bevel": lambda: bevel(desk, 2 * desk.grid),
        "round": lambda: round_corners(desk, 2 * desk.grid),
        "split": lambda: desk.change(vertices.split(desk.sketch, one_vertex(desk))),
        "extend": lambda: extend(desk),
        "fill": lambda: fill(desk),
        "simplify": lambda: simplify_outlines(desk, TOLERANCE),
        "straighten": lambda: _do(desk, simplify.straightened),
        "wider": lambda: widen(desk, WIDER),
        "narrower": lambda: widen(desk, 1.0 / WIDER),
        "grid:finer": lambda: desk.change_grid(-1),
        "grid:coarser": lambda: desk.change_grid(1),
        "start:uniform": lambda: desk.change(create.uniform_start_added(desk.sketch)),
        "start:next": lambda: next_start(desk),
        "start:default": lambda: make_default(desk),
        "more": lambda: desk.set_robots(min(desk.robots + 1, 1000)),
        "fewer": lambda: desk.set_robots(max(desk.robots - 1, 1)),
        "background:none": lambda: desk.change(properties.underlaid(desk.sketch, None)),
        "problem:next": lambda: next_problem(desk),
        "problem:fix": lambda: fix_problem(desk),
        "fill:unreachable": lambda: desk.change(fixes.unreachable_filled(desk.sketch, desk.radius)),
        "density:area": lambda: _do(desk, density_edits.areas_made, density_weight(desk)),
        "path:repeat": lambda: _do(desk, motion_path.path_turned),
        "path:none": lambda: _do(desk, motion_path.path_removed),
        "path:play": lambda: play(desk),
    }


def _do(desk: Desk, edit: Callable[..., Change], *rest: object, single: bool = False) -> None:
    """Make an edit of whole things; with `single`, of single vertices where some are selected."""
    selection = desk.selection
    if not (single and selection.vertices):
        selection = whole(selection)
    if not selection:
        raise MapError("nothing is selected: click something first, or press Ctrl A")
    desk.change(edit(desk.sketch, selection, *rest))


def whole(selection: Selection) -> Selection:
    """Return the selected things; of selected vertices, what they belong to."""
    return selection.without_vertices().plus(Selection.of(*{vertex.of for vertex in selection.vertices}))


def play(desk: Desk) -> str:
    """Show where obstacles that move get to, or show them no more.

    Raises
    ------
    MapError
        When none moves.
    """
    if desk.moves_since is not None:
        desk.moves_since = None
        return "obstacles stand as they are at time zero"
    if not motion_path.moving(desk.sketch):
        raise MapError("no obstacle moves: the tool Path gives one a path")
    desk.moves_since = desk.now
    return "obstacles move as they will; L ends it"


def back(desk: Desk) -> None:
    """Take the last point back, else delete what is selected."""
    if not desk.tool.back(desk) and not desk.tool.busy and desk.selection:
        delete(desk)


def delete(desk: Desk) -> None:
    """Delete the selected vertices, or else the selected things."""
    selection = desk.selection
    if not selection:
        raise MapError("nothing is selected: click something first")
    act = vertices.deleted if selection.vertices else properties.deleted
    single = Selection(vertices=selection.vertices)
    desk.change(act(desk.sketch, single if selection.vertices else selection))


def copy(desk: Desk) -> str:
    """Copy what is selected to the clipboard."""
    selection = whole(desk.selection)
    desk.pasteboard.put(copied(desk.sketch, selection))
    return f"copied: {selection.words(desk.sketch)}"


def cut(desk: Desk) -> None:
    """Copy what is selected, and delete it."""
    copy(desk)
    desk.change(properties.deleted(desk.sketch, whole(desk.selection)))


def paste(desk: Desk, at: Point | None) -> None:
    """Paste what is in the clipboard, its middle at a place."""
    text = desk.pasteboard.get()
    if not text.strip():
        raise MapError("the clipboard is empty")
    grid = desk.grid if "grid" in desk.snaps else None
    desk.change(pasted(desk.sketch, text, at, grid))


def nudge(desk: Desk, x: int, y: int) -> None:
    """Move what is selected by so many spacings of the grid."""
    selection = desk.selection
    if not selection:
        raise MapError("nothing is selected: arrows move what is; Ctrl and arrows move the sheet")
    act = vertices.moved if selection.vertices else transform.moved
    single = Selection(vertices=selection.vertices) if selection.vertices else selection
    desk.change(act(desk.sketch, single, x * desk.grid, y * desk.grid), drag=("nudge", selection))


def cancel(desk: Desk) -> None:
    """Give up what is half done, else put the tool away, else select nothing."""
    if desk.typed:
        desk.typed = ""
    elif not desk.tool.cancel(desk) and desk.tool is not desk.selector:
        desk.choose("select", tell=False)


def select_next(desk: Desk, by: int) -> None:
    """Select the next obstacle, start or boundary, in the order of the map."""
    order: list[Owner] = [
        *(item.key for item in desk.sketch.obstacles if not item.hidden),
        *(name for name, _ in desk.sketch.starts),
    ]
    if desk.sketch.boundary is not None:
        order.append(BOUNDARY)
    if not order:
        return
    now = [order.index(each) for each in whole(desk.selection).owners if each in order]
    place = (max(now) + by if by > 0 else min(now) + by) if now else (0 if by > 0 else -1)
    desk.select(Selection.of(order[place % len(order)]))


def one_vertex(desk: Desk) -> Vertex:
    """Return the one vertex that is selected.

    Raises
    ------
    MapError
        When it is none, or more.
    """
    if len(desk.selection.vertices) != 1:
        raise MapError("select one vertex first: click an obstacle, then one of its corners")
    (vertex,) = desk.selection.vertices
    return vertex


def corners(desk: Desk) -> Selection:
    """Return the selected corners.

    Raises
    ------
    MapError
        When none is selected.
    """
    if not desk.selection.vertices:
        raise MapError("select corners first: click an obstacle, then its corners, or drag a box around them")
    return Selection(vertices=desk.selection.vertices)


def bevel(desk: Desk, length: float) -> None:
    """Cut the selected corners off."""
    desk.change(vertices.bevelled(desk.sketch, corners(desk), length))


def round_corners(desk: Desk, radius: float) -> None:
    """Round the selected corners."""
    desk.change(vertices.rounded_off(desk.sketch, corners(desk), radius))


def simplify_outlines(desk: Desk, tolerance: float) -> None:
    """Leave vertices out of what is selected."""
    _do(desk, simplify.simplified, tolerance)


def extend(desk: Desk) -> None:
    """Go on with a wall from the vertex that is selected, to where the cursor is."""
    if desk.cursor is None:
        raise MapError("move the mouse to where the wall is to go on to")
    vertex = one_vertex(desk)
    to = desk.snapped(desk.cursor, FINGER * desk.pixel, place_of(desk.sketch, vertex)).point
    desk.change(vertices.extended(desk.sketch, vertex, to))


def fill(desk: Desk) -> None:
    """Fill the hole whose vertex is selected."""
    vertex = one_vertex(desk)
    if not isinstance(vertex.of, int) or vertex.ring == 0:
        raise MapError("select a vertex of the hole first")
    desk.change(vertices.hole_filled(desk.sketch, vertex.of, vertex.ring))


def widen(desk: Desk, factor: float) -> None:
    """Make the selected walls wider or narrower, and those that are drawn."""
    walls = {key: desk.sketch.item(key).shape for key in whole(desk.selection).items}
    widths = [shape.width for shape in walls.values() if isinstance(shape, WallObstacle)]
    width = round(max((widths[0] if widths else desk.wall_width) * factor, 0.01), 3)
    if widths and not desk.tool.busy:
        desk.change(
            properties.widened(desk.sketch, whole(desk.selection), width), drag=("width", desk.selection)
        )
    desk.set_wall_width(width)
    desk.say(f"walls are {width:g} m wide")


def next_start(desk: Desk) -> None:
    """Show the team at the next start."""
    names = desk.start_names
    if not names:
        raise MapError("the map has no start yet: S draws one")
    now = desk.start_name
    name = names[(names.index(now) + 1) % len(names)] if now in names else names[0]
    desk.start = name
    desk.select(Selection.of(name))
    desk.say(f"start “{name}”")


def make_default(desk: Desk) -> None:
    """Make the selected start the map's default."""
    if len(desk.selection.starts) != 1:
        raise MapError("select one start first")
    (name,) = desk.selection.starts
    desk.change(properties.start_first(desk.sketch, name))


def density_weight(desk: Desk) -> float:
    """Return the weight of what is drawn next with the tool Density."""
    tool = desk.tools["density"]
    return tool.weight if isinstance(tool, DensityTool) else 1.0


def fix_problem(desk: Desk) -> None:
    """Mend the problem that is shown, or the first that can be."""
    found = [desk.problem] if desk.problem is not None else list(desk.problems)
    for problem in found:
        change = fixes.fixed(desk.sketch, problem, desk.radius)
        if change is not None:
            desk.change(change)
            return
    raise MapError("there is nothing that can be mended by itself")


def next_problem(desk: Desk) -> None:
    """Show the next problem with its words."""
    found = desk.problems
    if not found:
        desk.problem = None
        desk.say("nothing is wrong with the map" if desk.measurement is not None else "not looked at yet")
        return
    place = found.index(desk.problem) + 1 if desk.problem in found else 0
    desk.problem = found[place % len(found)]
    desk.say(desk.problem.words, trouble=desk.problem.grave)
